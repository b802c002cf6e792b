//! The 10 Hz low-pass of the conventional method.
//!
//! Fourth-order Butterworth run forwards and backwards: no phase, half the power gone twice at the corner. At
//! the rig's fastest mode (4.2 Hz) it takes 0.1 % of the amplitude, the same all along the record. The ends
//! are continued by reflection through the end point.

use std::f64::consts::PI;

/// Pole qualities of a fourth-order Butterworth filter in two sections.
const QUALITIES: [f64; 2] = [0.541_196_100_146_197, 1.306_562_964_876_377];
/// Periods of the corner frequency by which the ends are continued; the filter forgets within two.
const PADDING_PERIODS: f64 = 5.0;

/// `values` sampled at `rate_hz`, filtered at `corner_hz`; `None` where the corner is not below half the
/// rate.
pub(super) fn zero_phase(values: &[f64], rate_hz: f64, corner_hz: f64) -> Option<Vec<f64>> {
    let n = values.len();
    if corner_hz >= 0.5 * rate_hz || n == 0 {
        return None;
    }
    let padding = ((PADDING_PERIODS * rate_hz / corner_hz) as usize).min(n - 1);
    let (first, last) = (values[0], values[n - 1]);
    let mut work: Vec<f64> = (1..=padding)
        .rev()
        .map(|k| 2.0 * first - values[k])
        .chain(values.iter().copied())
        .chain((1..=padding).map(|k| 2.0 * last - values[n - 1 - k]))
        .collect();
    for _ in 0..2 {
        for quality in QUALITIES {
            Section::low_pass(rate_hz, corner_hz, quality).run(&mut work);
        }
        work.reverse();
    }
    Some(work[padding..padding + n].to_vec())
}

/// Two poles: y_k = b (x_k + 2 x_(k-1) + x_(k-2)) - a1 y_(k-1) - a2 y_(k-2).
struct Section {
    b: f64,
    a1: f64,
    a2: f64,
}

impl Section {
    /// Bilinear transform of 1/(s^2 + s/quality + 1) with the corner kept in place.
    fn low_pass(rate_hz: f64, corner_hz: f64, quality: f64) -> Self {
        let k = (PI * corner_hz / rate_hz).tan();
        let scale = 1.0 / (1.0 + k / quality + k * k);
        Self {
            b: k * k * scale,
            a1: 2.0 * (k * k - 1.0) * scale,
            a2: (1.0 - k / quality + k * k) * scale,
        }
    }

    /// In place, as if the first value had stood there for ever.
    fn run(&self, values: &mut [f64]) {
        let level = values[0];
        let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
        for value in values {
            let x = *value - level;
            let y = self.b * (x + 2.0 * x1 + x2) - self.a1 * y1 - self.a2 * y2;
            (x2, x1, y2, y1) = (x1, x, y1, y);
            *value = y + level;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn sine(hz: f64) -> Vec<f64> {
        (0..5000).map(|k| (TAU * hz * k as f64 * 1e-3).sin() + 3.0).collect()
    }

    #[test]
    fn the_gain_is_that_of_the_filter_run_twice_and_there_is_no_delay() {
        for (hz, gain) in [(1.0, 1.0), (4.2, 0.999), (10.0, 0.5), (40.0, 0.0)] {
            let input = sine(hz);
            let output = zero_phase(&input, 1000.0, 10.0).unwrap();
            for k in 1000..4000 {
                let expected = 3.0 + gain * (input[k] - 3.0);
                assert!(
                    (output[k] - expected).abs() < 2e-3,
                    "{hz} Hz at {k}: {} {expected}",
                    output[k]
                );
            }
        }
    }

    #[test]
    fn a_corner_beyond_half_the_rate_is_no_filter() {
        assert!(zero_phase(&[0.0; 100], 20.0, 10.5).is_none());
    }
}
