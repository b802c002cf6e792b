//! Lines in the spectrum of what a model leaves.

use std::f64::consts::TAU;

/// Highest frequency looked for, in natural frequencies: half a dozen block means a cycle.
pub(crate) const FASTEST: f64 = 8.0;

/// Strongest frequency of the residuals below and above the natural frequency, rad/s, at least `gap` of it away.
pub(super) fn peaks(residuals: &[f64], step_s: f64, wn: f64, least: f64, gap: f64) -> Vec<f64> {
    let fastest = FASTEST.min(0.45 * TAU / step_s / wn) * wn;
    let above = strongest(residuals, step_s, (1.0 + gap) * wn, fastest);
    let below = strongest(residuals, step_s, least * wn, (1.0 - gap) * wn);
    above.into_iter().chain(below).collect()
}

/// Strongest frequency from `from` to `to`, rad/s.
pub(super) fn strongest(residuals: &[f64], step_s: f64, from: f64, to: f64) -> Option<f64> {
    let spacing = 0.25 * TAU / (residuals.len() as f64 * step_s);
    let count = ((to - from) / spacing).max(0.0) as usize + 1;
    (0..count)
        .map(|i| from + i as f64 * spacing)
        .map(|w| (w, power(residuals, w * step_s)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(w, _)| w)
}

/// |sum of r_k window_k e^(i x k)|^2, Hann-windowed so that what is left of the free decay does not leak.
fn power(residuals: &[f64], x: f64) -> f64 {
    let n = residuals.len() as f64;
    let (turn, hann) = (x.sin_cos(), (TAU / n).sin_cos());
    let (mut s, mut c) = (0.0, 1.0);
    let (mut hs, mut hc) = (0.0, 1.0);
    let (mut a, mut b) = (0.0, 0.0);
    for r in residuals {
        let weighted = r * (1.0 - hc);
        a += weighted * c;
        b += weighted * s;
        (s, c) = (s * turn.1 + c * turn.0, c * turn.1 - s * turn.0);
        (hs, hc) = (hs * hann.1 + hc * hann.0, hc * hann.1 - hs * hann.0);
    }
    a * a + b * b
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
