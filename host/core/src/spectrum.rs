//! Periodogram of an evenly sampled stretch and its peak.

use crate::statistics::median;
use realfft::RealFftPlanner;
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

thread_local! {
    // Plans of lengths that are a power of two are kept: there are few.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// |FFT|^2 of `values` by bin.
pub(crate) fn power(mut values: Vec<f64>) -> Vec<f64> {
    let length = values.len();
    let plan = match length.is_power_of_two() {
        true => PLANNER.with(|p| p.borrow_mut().plan_fft_forward(length)),
        false => RealFftPlanner::new().plan_fft_forward(length),
    };
    let mut spectrum = plan.make_output_vec();
    plan.process(&mut values, &mut spectrum).expect("lengths come from the plan");
    spectrum.iter().map(|z| z.norm_sqr()).collect()
}

/// |FFT|^2 by bin, bin k at k times `resolution_hz`.
#[derive(Clone, Debug)]
pub(crate) struct Periodogram {
    pub(crate) resolution_hz: f64,
    pub(crate) power: Vec<f64>,
}

impl Periodogram {
    /// Of `values` every `step_s`, the mean taken off, filled up with zeros to the power of two that holds
    /// `length` and all values.
    pub(crate) fn new(values: &[f64], step_s: f64, length: usize) -> Self {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        Self::padded(values.iter().map(|v| v - mean).collect(), step_s, length)
    }

    /// Of `values` every `step_s` under a Hann window, so that what is left of a free decay does not leak,
    /// four bins or more where the stretch itself tells one.
    pub(crate) fn windowed(values: &[f64], step_s: f64) -> Self {
        let turn = TAU / values.len() as f64;
        let windowed = values.iter().enumerate().map(|(k, v)| v * (1.0 - (turn * k as f64).cos()));
        Self::padded(windowed.collect(), step_s, 4 * values.len())
    }

    fn padded(mut padded: Vec<f64>, step_s: f64, length: usize) -> Self {
        let length = length.max(padded.len()).max(2).next_power_of_two();
        padded.resize(length, 0.0);
        Self { resolution_hz: 1.0 / (length as f64 * step_s), power: power(padded) }
    }

    /// Bins whose frequency lies in `hz`, the constant left out.
    fn bins(&self, hz: &RangeInclusive<f64>) -> std::ops::Range<usize> {
        let from = (hz.start() / self.resolution_hz).ceil().max(1.0) as usize;
        let to = (hz.end() / self.resolution_hz).min(self.power.len() as f64) as usize;
        from..(to + 1).min(self.power.len())
    }

    /// Mean power of white noise within `hz`: that of most bins.
    pub(crate) fn noise(&self, hz: &RangeInclusive<f64>) -> f64 {
        let mut power: Vec<f64> = self.bins(hz).map(|k| self.power[k]).collect();
        if power.is_empty() {
            return 0.0;
        }
        // The median of an exponential distribution is its mean times ln 2.
        median(&mut power) / std::f64::consts::LN_2
    }

    /// The strongest bin within `hz` after weighting by `weight(frequency in Hz, power of the bin)`.
    pub(crate) fn strongest_bin(
        &self,
        hz: &RangeInclusive<f64>,
        weight: impl Fn(f64, f64) -> f64,
    ) -> Option<usize> {
        self.bins(hz)
            .map(|k| (k, self.power[k] * weight(k as f64 * self.resolution_hz, self.power[k])))
            .filter(|(_, p)| *p > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(k, _)| k)
    }

    /// Frequency of a bin, Hz.
    pub(crate) fn frequency_hz(&self, bin: usize) -> f64 {
        bin as f64 * self.resolution_hz
    }

    /// Frequency of the parabola through the logarithms of a peak and its two neighbours, Hz. Meant for a
    /// stretch filled up with zeros to four times its length at least.
    pub(crate) fn interpolated_hz(&self, bin: usize) -> f64 {
        let shift = match (bin.checked_sub(1), self.power.get(bin + 1)) {
            (Some(before), Some(&after)) if before > 0 => {
                let (a, b, c) = (self.power[before].ln(), self.power[bin].ln(), after.ln());
                let curvature = a - 2.0 * b + c;
                if curvature < 0.0 {
                    (0.5 * (a - c) / curvature).clamp(-0.5, 0.5)
                } else {
                    0.0
                }
            }
            _ => 0.0,
        };
        (bin as f64 + shift) * self.resolution_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(hz: f64, n: usize) -> Vec<f64> {
        (0..n)
            .map(|k| {
                let t = k as f64 * 0.01;
                7.0 + (-0.2 * t).exp() * (std::f64::consts::TAU * hz * t).cos()
            })
            .collect()
    }

    #[test]
    fn the_peak_is_the_nearest_bin_and_interpolation_comes_nearer() {
        let periodogram = Periodogram::new(&swing(1.27, 1000), 0.01, 1000);
        let bin = periodogram.strongest_bin(&(0.0..=20.0), |_, _| 1.0).unwrap();
        assert_eq!(bin, 13);
        assert!((periodogram.frequency_hz(bin) - 13.0 / 10.24).abs() < 1e-12);
        // Filled up fourfold, as interpolation wants it: a parabola fits only the tip of the peak.
        let filled = Periodogram::new(&swing(1.27, 1000), 0.01, 4000);
        let bin = filled.strongest_bin(&(0.0..=20.0), |_, _| 1.0).unwrap();
        let error = (filled.interpolated_hz(bin) - 1.27).abs();
        assert!(error < 0.004, "{error}");
    }

    #[test]
    fn a_constant_has_no_peak() {
        let periodogram = Periodogram::new(&[3.0; 64], 0.01, 64);
        assert_eq!(periodogram.strongest_bin(&(0.0..=50.0), |_, _| 1.0), None);
    }
}
