//! What shows that no law of angle and rate holds a release, as lines to be drawn.

use super::beside::{Beside, Kind};
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::fit::noise::{periodogram, OF_RESIDUALS};
use std::f64::consts::TAU;

/// Bins of the reading.
const BINS: usize = 30;

/// What the lines are over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// What is not the law's (rad) over time since the release (s).
    Time,
    /// Share of its power over frequency (rad/s).
    Frequency,
    /// Its mean (rad) over the yaw angle shown (rad).
    Reading,
    /// The moment that remembers (rad/s2) over yaw angle (rad), out and back between turning points at three
    /// amplitudes.
    Turns,
}

/// Lines, each by its x, ascending, and y.
#[derive(Clone, Debug)]
pub struct Left {
    /// What x and y of the lines are.
    pub over: Over,
    /// Each `[x, y]`, of equal length.
    pub lines: Vec<[Vec<f64>; 2]>,
}

impl Left {
    /// What is to be drawn of what stands `beside` a law of `decay`.
    pub fn beside(decay: &FreeDecay, beside: &Beside) -> Self {
        let residuals = &beside.residuals_rad;
        let (over, line) = match beside.kind {
            Kind::Time | Kind::Randomness => (Over::Time, over_time(decay, residuals)),
            Kind::SecondFrequency => {
                let w = beside.frequency_rad_s.unwrap_or_default().max(decay.frequency_rad_s);
                (Over::Frequency, over_frequency(residuals, decay.grid.step_s, 3.0 * w))
            }
            Kind::Sensor => (Over::Reading, over_reading(&decay.yaw_rad, residuals)),
        };
        Self { over, lines: vec![line] }
    }

    /// The loops of the memory in `fit`, which a law of angle and rate has no place for.
    pub fn memory(decay: &FreeDecay, fit: &Fitted) -> Self {
        let mut lines = Vec::new();
        for amplitude_rad in [1.0, 0.5, 0.25].map(|share| share * decay.amplitude_rad) {
            let mut memories = fit.motion().memories(0.0);
            let mut end = amplitude_rad;
            // Until the loop is closed.
            for _ in 0..12 {
                memories.turn(end);
                end = -end;
            }
            for end in [end, -end] {
                // Out from where it turned last, and back.
                memories.turn(-end);
                let at = |k: u8| end * (2.0 * f64::from(k) / 39.0 - 1.0);
                let mut x: Vec<f64> = (0..40).map(at).collect();
                let mut y: Vec<f64> = x.iter().map(|b| memories.moment(*b)).collect();
                if end < 0.0 {
                    x.reverse();
                    y.reverse();
                }
                lines.push([x, y]);
            }
        }
        Self { over: Over::Turns, lines }
    }
}

/// The least and the largest of each of three hundred stretches, in their order.
fn over_time(decay: &FreeDecay, residuals: &[f64]) -> [Vec<f64>; 2] {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    let length = residuals.len().div_ceil(300).max(1);
    for (k, part) in residuals.chunks(length).enumerate() {
        let by = |a: &usize, b: &usize| part[*a].total_cmp(&part[*b]);
        let ends = [(0..part.len()).min_by(by), (0..part.len()).max_by(by)];
        let mut ends: Vec<usize> = ends.into_iter().flatten().collect();
        ends.sort_unstable();
        ends.dedup();
        x.extend(ends.iter().map(|i| decay.grid.time_s(k * length + i)));
        y.extend(ends.iter().map(|i| part[*i]));
    }
    [x, y]
}

fn over_frequency(residuals: &[f64], step_s: f64, highest_rad_s: f64) -> [Vec<f64>; 2] {
    let power = periodogram(residuals, &OF_RESIDUALS);
    let sum: f64 = power.iter().sum();
    let bin_rad_s = TAU / (residuals.len() as f64 * step_s);
    let shown = ((highest_rad_s / bin_rad_s) as usize).min(power.len());
    let shares = power[..shown].iter().map(|p| p / sum).collect();
    [(0..shown).map(|k| k as f64 * bin_rad_s).collect(), shares]
}

fn over_reading(yaw_rad: &[f64], residuals: &[f64]) -> [Vec<f64>; 2] {
    let low = yaw_rad.iter().copied().fold(f64::INFINITY, f64::min);
    let high = yaw_rad.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut bins = [(0usize, 0.0); BINS];
    for (yaw, residual) in yaw_rad.iter().zip(residuals) {
        let at = ((yaw - low) / (high - low) * BINS as f64) as usize;
        let (count, sum) = &mut bins[at.min(BINS - 1)];
        *count += 1;
        *sum += residual;
    }
    let middle = |k: usize| low + (k as f64 + 0.5) / BINS as f64 * (high - low);
    let filled = bins.iter().enumerate().filter(|(_, (count, _))| *count >= 3);
    let points = filled.map(|(k, (count, sum))| (middle(k), sum / *count as f64));
    let (x, y) = points.unzip();
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_at_its_frequency_and_a_bent_reading_over_its_angle() {
        let residuals: Vec<f64> = (0..2000).map(|k| (11.0 * 0.01 * k as f64).cos()).collect();
        let [w, share] = over_frequency(&residuals, 0.01, 30.0);
        let most = (0..w.len()).max_by(|a, b| share[*a].total_cmp(&share[*b])).expect("bins");
        assert!((w[most] - 11.0).abs() < 0.4, "{}", w[most]);
        let yaw: Vec<f64> = (0..2000).map(|k| (0.05 * k as f64).sin()).collect();
        let bent: Vec<f64> = yaw.iter().map(|b| b * b).collect();
        let [x, y] = over_reading(&yaw, &bent);
        assert_eq!(x.len(), BINS);
        // Somewhere in its bin, half of whose width is 1 / BINS.
        let most = |x: f64| 2.0 * x.abs() / BINS as f64 + 0.01;
        assert!(x.iter().zip(&y).all(|(x, y)| (x * x - y).abs() < most(*x)));
    }
}
