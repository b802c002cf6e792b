//! Sampling rate and jitter from time stamps.

/// How a record's time stamps are spaced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Median step, s: dropped samples and jitter do not move it.
    pub(crate) step_s: f64,
    /// 1 / median step, Hz.
    pub rate_hz: f64,
    /// Rms departure of the steps from their median, as a share of it. A lost sample counts.
    pub(crate) jitter: f64,
    /// Longest step, s: a gap where it is many times the median.
    pub(crate) longest_step_s: f64,
    /// Last time stamp less the first, s.
    pub duration_s: f64,
}

impl Timing {
    /// Whether every step is the median but for the rounding of the stamps (1 us at 10 kHz is 1 %).
    pub fn is_regular(&self) -> bool {
        self.jitter < 0.01 && self.longest_step_s < 1.5 * self.step_s
    }
}

pub(super) fn measure(time_s: &[f64]) -> Timing {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    // One sample has no step.
    let step_s = match steps.is_empty() {
        true => f64::NAN,
        false => *steps.select_nth_unstable_by(middle, f64::total_cmp).1,
    };
    let squares: f64 = steps.iter().map(|step| (step - step_s) * (step - step_s)).sum();
    Timing {
        step_s,
        rate_hz: 1.0 / step_s,
        jitter: (squares / steps.len() as f64).sqrt() / step_s,
        longest_step_s: steps.iter().copied().fold(0.0, f64::max),
        duration_s: time_s[time_s.len() - 1] - time_s[0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_sample_shows_as_a_gap_and_not_in_the_rate() {
        let time_s: Vec<f64> = (0..1000).filter(|i| *i != 400).map(|i| i as f64 * 1e-3).collect();
        let timing = measure(&time_s);
        assert!((timing.rate_hz - 1000.0).abs() < 1e-6);
        assert!((timing.longest_step_s - 2e-3).abs() < 1e-9);
        assert!((timing.duration_s - 0.999).abs() < 1e-12);
        assert!(!timing.is_regular());
    }

    #[test]
    fn jitter_is_relative_to_the_step() {
        let time_s: Vec<f64> =
            (0..1000).map(|i| f64::from(i) * 0.05 + if i % 2 == 0 { 0.0 } else { 0.005 }).collect();
        let timing = measure(&time_s);
        assert!(timing.jitter > 0.1 && timing.jitter < 0.3, "{}", timing.jitter);
        assert!(!timing.is_regular());
    }

    #[test]
    fn stamps_rounded_to_microseconds_are_regular() {
        let time_s: Vec<f64> =
            (0..1000).map(|i| (f64::from(i) / 7.0 * 1e3).round() * 1e-6).collect();
        assert!(measure(&time_s).is_regular());
    }
}
