//! Amplitude of the oscillation as it goes, before any model of its decay.

use super::samples::{Samples, Stretch};
use super::spectrum::Periodogram;
use crate::solver::linear_fit;
use std::f64::consts::TAU;

/// Rate to which the record is averaged before its spectrum is looked at, Hz.
const SPECTRUM_RATE_HZ: f64 = 200.0;
/// Up to this frequency the spectrum is weighted like that of the yaw rate (rad/s): the step from the hold to the
/// swing, which fills the low frequencies, then weighs less than the swing. Above, noise would win.
const RATE_WEIGHT_TO_RAD_S: f64 = 30.0;
/// Highest frequency looked for, as a share of the sampling rate and in Hz.
const HIGHEST_SHARE: f64 = 0.35;
const HIGHEST_HZ: f64 = 50.0;
/// Points of the envelope per cycle.
pub(crate) const POINTS_PER_CYCLE: usize = 8;

/// Frequency of the strongest oscillation in the record, rad/s, to a few percent; `None` for a constant.
pub(crate) fn strongest_frequency_rad_s(samples: &Samples<'_>) -> Option<f64> {
    let block = (samples.rate_hz() / SPECTRUM_RATE_HZ).floor().max(1.0);
    let step_s = block / samples.rate_hz();
    let means = samples.all().block_means(block as usize);
    let even = evenly(&means.time_s, &means.yaw_deg, step_s);
    // Twice the length at least, so that the peak is well sampled.
    let periodogram = Periodogram::of(&even, step_s, 2 * even.len());
    let lowest = 2.0 / samples.all().duration_s();
    let highest = (HIGHEST_SHARE * samples.rate_hz()).min(HIGHEST_HZ);
    let weight = |hz: f64| (hz * TAU).min(RATE_WEIGHT_TO_RAD_S).powi(2);
    let bin = periodogram.strongest_bin(lowest..=highest, weight)?;
    Some(periodogram.interpolated_hz(bin) * TAU)
}

/// Straight lines through (time, value) read off every `step`.
fn evenly(time: &[f64], value: &[f64], step: f64) -> Vec<f64> {
    let count = ((time[time.len() - 1] - time[0]) / step + 0.5) as usize + 1;
    let mut k = 0;
    (0..count)
        .map(|i| {
            let t = time[0] + i as f64 * step;
            while k + 2 < time.len() && time[k + 1] <= t {
                k += 1;
            }
            let share = ((t - time[k]) / (time[k + 1] - time[k])).clamp(0.0, 1.0);
            value[k] + share * (value[k + 1] - value[k])
        })
        .collect()
}

/// Amplitude about the local mean at one time, from one cycle centred there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub time_s: f64,
    pub amplitude_deg: f64,
    /// Standard deviation of what the sinusoid leaves.
    pub scatter_deg: f64,
}

/// Envelope of `means` at `frequency_rad_s`: a sinusoid and a constant fitted to each cycle, eight a cycle.
/// Right to a few percent, also where the amplitude falls fast within the cycle. The first and last point lie half a cycle inside.
pub(crate) fn envelope(means: &Stretch<'_>, frequency_rad_s: f64) -> Vec<Point> {
    let period = TAU / frequency_rad_s;
    // Three unknowns need some samples more, also where a cycle has hardly five.
    let width = period.max(6.5 * means.step_s);
    let hop = period / POINTS_PER_CYCLE as f64;
    let begin = means.start_s();
    let last = begin + means.duration_s() - width;
    let phase: Vec<(f64, f64)> =
        means.time_s.iter().map(|t| (frequency_rad_s * (t - begin)).sin_cos()).collect();
    let count = ((last - begin) / hop + 1e-9).floor().max(-1.0) as i64 + 1;
    (0..count)
        .filter_map(|i| {
            let from = begin + i as f64 * hop;
            let a = means.time_s.partition_point(|&t| t < from - 0.25 * means.step_s);
            let b = means.time_s.partition_point(|&t| t < from + width - 0.25 * means.step_s);
            if b - a < 5 {
                return None;
            }
            let rows = phase[a..b].iter().zip(&means.yaw_deg[a..b]);
            let x = linear_fit(rows.map(|((sine, cosine), yaw)| ([*cosine, *sine, 1.0], *yaw)))?;
            let squares: f64 = (a..b)
                .map(|k| {
                    let model = x[0] * phase[k].1 + x[1] * phase[k].0 + x[2];
                    (means.yaw_deg[k] - model).powi(2)
                })
                .sum();
            Some(Point {
                time_s: from + 0.5 * width,
                amplitude_deg: x[0].hypot(x[1]),
                scatter_deg: (squares / (b - a - 3) as f64).sqrt(),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequency_and_amplitude_of_a_swing_between_hold_and_rest() {
        let (rate, release) = (500.0, 8.0);
        let t: Vec<f64> = (0..30_000).map(|k| k as f64 / rate).collect();
        let y: Vec<f64> = t
            .iter()
            .map(|t| {
                let s = t - release;
                2.0 + if s < 0.0 { 15.0 } else { 15.0 * (-0.3 * s).exp() * (7.5 * s).cos() }
            })
            .collect();
        let samples = Samples::new(&t, &y);
        let frequency = strongest_frequency_rad_s(&samples).unwrap();
        assert!((frequency - 7.5).abs() < 0.1, "{frequency}");
        let points = envelope(&samples.all(), frequency);
        for p in &points {
            let s = p.time_s - release;
            let expected = if s < -0.5 { 0.0 } else { 15.0 * (-0.3 * s).exp() };
            if s.abs() > 0.6 {
                assert!((p.amplitude_deg - expected).abs() < 0.03 * expected + 1e-9, "{p:?}");
            }
        }
    }

    #[test]
    fn a_constant_has_no_frequency() {
        let t: Vec<f64> = (0..400).map(|k| k as f64 * 0.01).collect();
        assert_eq!(strongest_frequency_rad_s(&Samples::new(&t, &[4.0; 400])), None);
    }
}
