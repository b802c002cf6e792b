//! wn and zeta of a window over which they change: those of its mean cycle, and how far they change.
//!
//! Every cycle counts alike. The mean logarithmic decrement is the fall of the logarithm of the amplitude
//! over the number of cycles, the mean period the time over the same number; wn and zeta follow from the two
//! as for one mode. Amplitude and phase are fitted to a cycle by itself, at every half cycle, frequency and
//! decay being those of the nearest three cycles, so that nothing has to keep the phase of one frequency all
//! along; smooth curves are laid through both, over all that is analysed. Half a cycle, not a whole one, is the
//! step: of four or five cycles whose damping changes, as friction's does, a curve through one value each is
//! too stiff to follow to the ends.

use super::envelope::ENVELOPE_SAMPLES;
use super::samples::{Samples, Stretch};
use super::smooth::{Curve, Point};
use super::windows::{Window, MIN_SHARE, WINDOW_CYCLES};
use crate::quantity::{Quantity, CHANCE};
use crate::record::Derivative;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::f64::consts::{PI, TAU};

/// Means over the window, and how far both change over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OverWindow {
    pub(super) natural_frequency_rad_s: Quantity,
    pub(super) damping_ratio: Quantity,
    pub(super) ranges: Ranges,
    /// Whether the change of wn, and of zeta, is more than chance.
    pub(super) changes: [bool; 2],
}

/// Lowest and highest over the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ranges {
    pub(super) natural_frequency_rad_s: [f64; 2],
    pub(super) damping_ratio: [f64; 2],
}

/// Of the samples between `ends_s` with their `windows` in order of time; `None` of fewer than two cycles.
pub(super) fn of(
    samples: &Samples<'_>,
    ends_s: [f64; 2],
    windows: &[Window],
    derivative: Derivative,
) -> Option<OverWindow> {
    // Where three cycles had no fit nothing is to be read off one. Behind the last of them fewer are left.
    let last = windows.last()?;
    let too_few_s = MIN_SHARE * WINDOW_CYCLES * TAU / last.natural_frequency_rad_s;
    let to_s = if ends_s[1] < last.to_s + too_few_s { ends_s[1] } else { last.to_s };
    let cycles = cycles(samples, [ends_s[0], to_s], windows)?;
    let first = cycles.first()?;
    let ends_s = [first.time_s - 0.5 * TAU / first.damped_rad_s, to_s];
    let points = |of: &dyn Fn(&Cycle) -> (f64, f64)| -> Vec<Point> {
        let point = |c: &Cycle| Point { time_s: c.time_s, value: of(c).0, u: of(c).1 };
        cycles.iter().map(point).collect()
    };
    let phase = Curve::through(&points(&|c| (c.phase_rad, c.phase_u)), ends_s)?;
    // The motion's own amplitude by the smooth frequency: what a cycle's is off is no change of amplitude.
    let motion_deg = |c: &Cycle| derivative.of_motion(c.amplitude_deg, phase.rate(c.time_s).0);
    let ln = |c: &Cycle| (motion_deg(c).ln(), c.amplitude_u);
    let amplitude = Curve::through(&points(&ln), ends_s)?;
    let [wn, zeta] = modal(phase.mean_rate(), amplitude.mean_rate());
    let at = |c: &Cycle| modal(phase.rate(c.time_s), amplitude.rate(c.time_s));
    let each: Vec<[Quantity; 2]> = cycles.iter().map(at).collect();
    let ends = |k: usize| {
        let by_value = |a: &&[Quantity; 2], b: &&[Quantity; 2]| a[k].value.total_cmp(&b[k].value);
        Some([each.iter().min_by(by_value)?[k], each.iter().max_by(by_value)?[k]])
    };
    let (of_wn, of_zeta) = (ends(0)?, ends(1)?);
    let is_change =
        |[low, high]: [Quantity; 2]| high.value - low.value > CHANCE * high.u.hypot(low.u);
    // What does not bend has no range but its mean, and a mean lies in its range.
    let range = |curve: &Curve, mean: Quantity, [low, high]: [Quantity; 2]| match curve.bends() {
        true => [low.value.min(mean.value), high.value.max(mean.value)],
        false => [mean.value; 2],
    };
    Some(OverWindow {
        natural_frequency_rad_s: wn,
        damping_ratio: zeta,
        ranges: Ranges {
            natural_frequency_rad_s: range(&phase, wn, of_wn),
            damping_ratio: range(&amplitude, zeta, of_zeta),
        },
        changes: [phase.bends() && is_change(of_wn), amplitude.bends() && is_change(of_zeta)],
    })
}

/// Amplitude and phase at the middle of a cycle.
struct Cycle {
    time_s: f64,
    /// Of the nearest three cycles.
    damped_rad_s: f64,
    amplitude_deg: f64,
    /// Whole turns counted.
    phase_rad: f64,
    phase_u: f64,
    /// Of its logarithm.
    amplitude_u: f64,
}

/// A cycle at every half cycle that enough samples count of; `None` where those in between cannot be counted:
/// from one to the next the phase has to be known to half a turn.
fn cycles(
    samples: &Samples<'_>,
    [from_s, to_s]: [f64; 2],
    windows: &[Window],
) -> Option<Vec<Cycle>> {
    let mut all: Vec<Cycle> = Vec::new();
    let mut begin = from_s;
    let mut near = 0;
    loop {
        let mut window = windows.get(near)?;
        if let Some(next) = windows.get(near + 1)
            && next.from_s <= begin + 0.5 * TAU / window.natural_frequency_rad_s
        {
            near += 1;
            window = next;
        }
        let decay_rate = window.natural_frequency_rad_s * window.damping_ratio;
        let damped = (window.natural_frequency_rad_s.powi(2) - decay_rate.powi(2)).sqrt();
        let period_s = TAU / damped;
        // An aperiodic window has no cycles.
        if period_s.is_nan() || begin + MIN_SHARE * period_s > to_s {
            return Some(all);
        }
        let stretch = samples.between(begin, begin + period_s);
        let time_s = begin + 0.5 * period_s;
        begin += 0.5 * period_s;
        let is_fitted =
            time_s > window.from_s && (time_s < window.to_s || near + 1 == windows.len());
        if !is_fitted {
            continue;
        }
        if let Some(([a, b], covariance)) = harmonic(&stretch, time_s, decay_rate, damped) {
            let (amplitude_deg, phase) = (a.hypot(b), (-b).atan2(a));
            let expected = match all.last() {
                Some(last) => {
                    let between_s = time_s - last.time_s;
                    if (damped - last.damped_rad_s).abs() * between_s > PI {
                        return None;
                    }
                    last.phase_rad + 0.5 * (damped + last.damped_rad_s) * between_s
                }
                None => phase,
            };
            let phase_rad = expected + (phase - expected + PI).rem_euclid(TAU) - PI;
            let u = |along: [f64; 2]| {
                let along = Vector2::from(along) / (a * a + b * b);
                // Every sample counts in two cycles, which together know what one does.
                window.noise_near_deg * (2.0 * along.dot(&(covariance * along))).sqrt()
            };
            all.push(Cycle {
                time_s,
                damped_rad_s: damped,
                amplitude_deg,
                phase_rad,
                phase_u: u([b, -a]),
                amplitude_u: u([a, b]),
            });
        }
    }
}

/// Parts of a cycle in cosine and sine at its middle, beside a constant, and their covariance for noise of
/// one. `None` of too few samples.
fn harmonic(
    stretch: &Stretch<'_>,
    middle_s: f64,
    decay_rate: f64,
    damped: f64,
) -> Option<([f64; 2], Matrix2<f64>)> {
    if stretch.len() < ENVELOPE_SAMPLES {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (t, y) in stretch.kept() {
        let e = (-decay_rate * (t - middle_s)).exp();
        let (s, c) = (damped * (t - middle_s)).sin_cos();
        let row = Vector3::new(e * c, e * s, 1.0);
        normal += row * row.transpose();
        right += row * y;
    }
    let normal = normal.cholesky()?;
    let found = normal.solve(&right);
    Some(([found[0], found[1]], normal.inverse().fixed_view::<2, 2>(0, 0).into_owned()))
}

/// wn and zeta from the rates of the phase and of the logarithm of the amplitude.
fn modal(phase: (f64, f64), amplitude: (f64, f64)) -> [Quantity; 2] {
    let ((damped, u_damped), (rate, u_rate)) = (phase, amplitude);
    let wn = damped.hypot(rate);
    let zeta = -rate / wn;
    let root = damped / wn;
    [
        Quantity::new(wn, (root * u_damped).hypot(zeta * u_rate)),
        Quantity::new(zeta, root * (root * u_rate / wn).hypot(zeta * u_damped / wn)),
    ]
}
