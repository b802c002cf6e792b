//! Lines in the spectrum of what a model leaves.

use crate::spectrum::Periodogram;
use std::f64::consts::TAU;

/// Highest frequency looked for, in natural frequencies: half a dozen block means a cycle.
pub(crate) const FASTEST: f64 = 8.0;

/// Strongest frequency of the residuals below and above the natural frequency, rad/s, at least `gap` of it
/// away.
pub(super) fn peaks(residuals: &[f64], step_s: f64, wn: f64, least: f64, gap: f64) -> [f64; 2] {
    let fastest = FASTEST.min(0.45 * TAU / step_s / wn) * wn;
    strongest(residuals, step_s, [((1.0 + gap) * wn, fastest), (least * wn, (1.0 - gap) * wn)])
}

/// Strongest frequency in each of two ranges, rad/s; of one in which the residuals tell none, its beginning.
pub(super) fn strongest(residuals: &[f64], step_s: f64, ranges: [(f64, f64); 2]) -> [f64; 2] {
    let spectrum = Periodogram::windowed(residuals, step_s);
    ranges.map(|(from, to)| {
        let bin = spectrum.strongest_bin(&(from / TAU..=to / TAU), |_, _| 1.0);
        bin.map_or(from, |bin| TAU * spectrum.frequency_hz(bin))
    })
}

pub(super) fn distinct(lines: Vec<f64>) -> Vec<f64> {
    let mut out: Vec<f64> = Vec::new();
    for w in lines {
        if out.iter().all(|o| (o / w - 1.0).abs() > 0.02) {
            out.push(w);
        }
    }
    out
}
