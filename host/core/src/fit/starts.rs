//! Where the fit of an added effect begins.

use crate::effects::{Effect, FASTEST};
use crate::fit::fitting::Fitted;
use crate::fit::swing::Swing;
use std::f64::consts::TAU;
use yawrig_expression::OwnEffect;

/// Sizes tried, of that at which the effect rivals the spring.
const SMALL: f64 = 0.02;

/// Starting values of what the fit varies; the first leaves the motion of `inner` as it is.
pub fn of(swing: &Swing, inner: &Fitted, effect: Effect) -> Vec<Vec<f64>> {
    let sizes = effect.sizes(&swing.scale());
    let wn = inner.parameters[0];
    match effect {
        Effect::HarmonicForcing => {
            // A line that lasts shows best in the second half, where the swing has died down.
            let half = &inner.residuals[inner.count / 2..];
            let mut lines = peaks(half, swing.grid.step_s, wn, 0.1, 0.1);
            lines.extend(peaks(&inner.residuals, swing.grid.step_s, wn, 0.1, 0.1));
            distinct(lines).into_iter().map(|w| vec![0.0, 0.0, w]).collect()
        }
        Effect::SecondMode => {
            let early = ((6.0 * swing.per_cycle()) as usize).min(inner.count);
            let step = swing.grid.step_s;
            let mut lines = peaks(&inner.residuals[..early], step, wn, 0.3, 0.3);
            lines.extend(peaks(&inner.residuals, step, wn, 0.3, 0.3));
            distinct(lines).into_iter().map(|w| vec![0.0, 0.0, w, 0.02]).collect()
        }
        Effect::Own(own) => of_own(own, wn, swing.amplitude_rad),
        _ => {
            let positive = effect.parameters()[0].min >= 0.0;
            let mut starts = vec![vec![0.0], vec![SMALL * sizes[0]]];
            if !positive {
                starts.push(vec![-SMALL * sizes[0]]);
            }
            starts
        }
    }
}

/// Of a user's own effect: without it where one of its parameters is its size, then at its own starts, at the size
/// which would show in this swing, and with each other parameter three times smaller and larger.
fn of_own(own: &OwnEffect, wn: f64, amplitude: f64) -> Vec<Vec<f64>> {
    let signed = own.starts.clone();
    let bounded = |k: usize, value: f64| {
        let p = &own.parameters[k];
        value.clamp(p.min, p.max)
    };
    let Some(size) = own.size_parameter() else {
        let mut out = vec![signed.clone()];
        for k in 0..signed.len() {
            for factor in [1.0 / 3.0, 3.0] {
                let mut other = signed.clone();
                other[k] = bounded(k, factor * signed[k]);
                out.push(other);
            }
        }
        return out;
    };
    let with = |from: &[f64], k: usize, value: f64| {
        let mut other = from.to_vec();
        other[k] = bounded(k, value);
        other
    };
    let strength = own.strength(&signed, amplitude, wn) / (wn * wn * amplitude);
    let visible = signed[size] * SMALL / strength.max(f64::MIN_POSITIVE);
    let seen = with(&signed, size, if visible.is_finite() { visible } else { signed[size] });
    let mut out = vec![with(&signed, size, 0.0), signed.clone(), seen.clone()];
    if own.parameters[size].min < 0.0 && own.parameters[size].max > 0.0 {
        out.push(with(&seen, size, -seen[size]));
    }
    for k in (0..signed.len()).filter(|k| *k != size) {
        for factor in [1.0 / 3.0, 3.0] {
            out.push(with(&seen, k, factor * seen[k]));
        }
    }
    out
}

/// Strongest frequency of the residuals below and above the swing's, rad/s, at least `gap` of it away.
fn peaks(residuals: &[f64], step_s: f64, wn: f64, least: f64, gap: f64) -> Vec<f64> {
    let n = residuals.len();
    let duration = n as f64 * step_s;
    let spacing = 0.25 * TAU / duration;
    let strongest = |from: f64, to: f64| {
        let count = ((to - from) / spacing).max(0.0) as usize + 1;
        (0..count)
            .map(|i| from + i as f64 * spacing)
            .map(|w| (w, power(residuals, w * step_s)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(w, _)| w)
    };
    let mut out = Vec::new();
    out.extend(strongest((1.0 + gap) * wn, FASTEST.min(0.45 * TAU / step_s / wn) * wn));
    out.extend(strongest(least * wn, (1.0 - gap) * wn));
    out
}

/// |sum of r_k window_k e^(i x k)|^2, Hann-windowed so that what is left of the swing does not leak.
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

fn distinct(lines: Vec<f64>) -> Vec<f64> {
    let mut out: Vec<f64> = Vec::new();
    for w in lines {
        if out.iter().all(|o| (o / w - 1.0).abs() > 0.02) {
            out.push(w);
        }
    }
    out
}
