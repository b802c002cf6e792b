//! Amplitude of the oscillation as it goes, before any model of its decay.

use super::samples::{Samples, Stretch};
use super::MIN_CYCLES;
use crate::solver::linear_fit;
use crate::spectrum::Periodogram;
use crate::statistics::median;
use std::f64::consts::TAU;

/// Highest frequency looked for, as a share of the sampling rate.
const HIGHEST_SHARE: f64 = 0.35;
/// Values that gaps are filled with, times the samples there are.
const MAX_INTERPOLATED: f64 = 4.0;
/// Over the noise of a periodogram's bins, beyond the largest of them: what stands out by more is no noise.
const PEAK_STANDS_OUT: f64 = 3.0;
/// An amplitude over what the sinusoid leaves of its own cycle, from which on there is an oscillation: a ramp
/// comes to 1.8.
const CLEAR: f64 = 2.0;
/// Peaks nearer to each other are one.
const SAME_PEAK: f64 = 0.1;
/// A rise from the least amplitude so far that is none of a free decay, and the share of the amplitude it began
/// at above which none is allowed.
pub(super) const RISES: f64 = 1.15;
const RETURNS_TO: f64 = 0.25;
/// Block means per cycle in which an oscillation is looked at.
pub(super) const ENVELOPE_MEANS_PER_CYCLE: f64 = 24.0;
/// Fewest samples of a cycle in which its amplitude is seen: two more than a sinusoid and a constant have
/// numbers.
pub(super) const ENVELOPE_SAMPLES: usize = 5;
/// Points of the envelope per cycle.
pub(crate) const POINTS_PER_CYCLE: usize = 8;

/// Frequency of the strongest oscillation in the record, rad/s, to a few percent; `None` for a constant.
///
/// The step from the hold to the swing fills the low frequencies, vibration and noise the high ones, a knock
/// all of them. So the peaks of the record's spectra, and of those after its largest excursion, are held
/// against each other by what lasts: the amplitude over all the time in which it is clear of all else, of
/// those that are so for three cycles. What rings for a moment after a knock may be larger.
pub(crate) fn strongest_frequency_rad_s(samples: &Samples<'_>) -> Option<f64> {
    let mut peaks = peaks_rad_s(samples)?;
    let after = after_largest(samples);
    let fewest_rad_s = MIN_CYCLES * TAU / after.all().duration_s();
    if after.all().len() > ENVELOPE_SAMPLES {
        let later = peaks_rad_s(&after).unwrap_or_default();
        peaks.extend(later.into_iter().filter(|p| *p > fewest_rad_s));
    }
    let first = peaks[0];
    if peaks.iter().all(|p| (p / first - 1.0).abs() < SAME_PEAK) {
        return Some(first);
    }
    let lasts = |frequency: f64| {
        let block = block_of(samples, frequency);
        let means = samples.all().block_means(block);
        let none = vec![false; means.len()];
        let points = envelope(&means.stretch(&none), frequency);
        let clear = points.iter().filter(|p| p.swings());
        let clear: Vec<f64> = clear.map(|p| p.amplitude_deg).collect();
        let cycles = (clear.len() as f64 - 1.0) / POINTS_PER_CYCLE as f64 + 1.0;
        (cycles >= MIN_CYCLES, clear.iter().sum::<f64>() / frequency)
    };
    peaks.sort_by(f64::total_cmp);
    peaks.dedup_by(|a, b| (*a / *b - 1.0).abs() < SAME_PEAK);
    let longest = peaks
        .iter()
        .map(|p| (lasts(*p), *p))
        .max_by(|((a, x), _), ((b, y), _)| a.cmp(b).then(x.total_cmp(y)));
    longest.map(|(_, frequency)| frequency)
}

/// Of the spectra of angle, rate, and between them, rad/s: the largest that stands out of the noise.
fn peaks_rad_s(samples: &Samples<'_>) -> Option<Vec<f64>> {
    // Where most of the time nothing was sampled, no finer than there are samples.
    let duration_s = samples.all().duration_s();
    let finest_s = duration_s / (MAX_INTERPOLATED * samples.all().len() as f64);
    let step_s = samples.rate_hz().recip().max(finest_s);
    let means = samples.all().block_means(1);
    let even = evenly(&means.time_s, &means.yaw_deg, step_s);
    // Twice the length at least, so that the peak is well sampled.
    let periodogram = Periodogram::new(&even, step_s, 2 * even.len());
    let range = 2.0 / duration_s..=HIGHEST_SHARE / step_s;
    let floor = periodogram.noise(&range) * (PEAK_STANDS_OUT + (even.len() as f64).ln());
    let of = |power: i32| {
        let weight = |hz: f64, of_bin: f64| if of_bin > floor { hz.powi(power) } else { 0.0 };
        let peak = periodogram.strongest_bin(&range, weight);
        let peak = peak.or_else(|| periodogram.strongest_bin(&range, |hz, _| hz.powi(power)));
        Some(periodogram.interpolated_hz(peak?) * TAU)
    };
    (0..3).map(of).collect()
}

/// What follows the sample that is farthest from the middle.
fn after_largest<'a>(samples: &Samples<'a>) -> Samples<'a> {
    let all = samples.all();
    let middle = median(&mut all.yaw_deg.to_vec());
    let kept = all.kept().max_by(|a, b| (a.1 - middle).abs().total_cmp(&(b.1 - middle).abs()));
    samples.after(kept.map_or(all.start_s(), |(time_s, _)| time_s))
}

/// Samples in a block mean where the oscillation has this frequency.
pub(super) fn block_of(samples: &Samples<'_>, frequency_rad_s: f64) -> usize {
    (TAU / frequency_rad_s * samples.rate_hz() / ENVELOPE_MEANS_PER_CYCLE).floor().max(1.0) as usize
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
    pub(crate) time_s: f64,
    pub(crate) amplitude_deg: f64,
    /// Standard deviation of what the sinusoid leaves.
    pub(crate) scatter_deg: f64,
}

impl Point {
    /// Whether it is of an oscillation, and not of a ramp or a step.
    pub(crate) fn swings(&self) -> bool {
        self.amplitude_deg > CLEAR * self.scatter_deg
    }
}

/// Envelope of `means` at `frequency_rad_s`: a sinusoid and a constant fitted to each cycle, eight a cycle.
/// Right to a few percent, also where the amplitude falls fast within the cycle. The first and last point lie
/// half a cycle inside. Of no samples, as between two gaps, there is none.
pub(crate) fn envelope(means: &Stretch<'_>, frequency_rad_s: f64) -> Vec<Point> {
    if means.is_empty() {
        return Vec::new();
    }
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
            if b - a < ENVELOPE_SAMPLES {
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

/// Whether amplitudes that begin at `level` rise again before they are small.
pub(super) fn rises(amplitude: &[f64], level: f64) -> bool {
    let mut least = f64::INFINITY;
    amplitude.iter().any(|a| {
        least = least.min(*a);
        *a > RETURNS_TO * level && *a > RISES * least
    })
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
