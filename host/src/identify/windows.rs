//! wn and zeta as they change with amplitude: one least-squares fit to every three cycles.

use super::damped_sinusoid::DampedSinusoid;
use super::least_squares::{fit_mode, linear_start, refine, ModeFit};
use super::samples::{median, Samples, Stretch};
use super::uncertainty;
use std::f64::consts::TAU;

/// Cycles in a window.
pub const WINDOW_CYCLES: f64 = 3.0;
/// A residual this many standard deviations out belongs to a wild sample: once in 500 million samples by chance.
const WILD: f64 = 6.0;

/// Multiples of a third of the oscillation's frequency at which the residual's spectrum is looked at: about the
/// oscillation, which the fit has emptied, and clear of its harmonics.
const NEIGHBOURS: [usize; 3] = [2, 4, 5];
/// What fitting amplitude, phase, wn and zeta leaves of white noise there, in bins. Of the columns t cos and t sin
/// 30 % of the power lie one bin off on either side and 8 % two bins off.
const LEFT_OVER: f64 = 3.0 - 0.30 - 0.30 - 0.08;

/// One window. Uncertainties hold for noise as coloured as the residuals of all windows together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    pub from_s: f64,
    pub to_s: f64,
    /// Envelope at the middle of the window.
    pub amplitude_deg: f64,
    pub natural_frequency_rad_s: f64,
    pub natural_frequency_u: f64,
    pub damping_ratio: f64,
    pub damping_ratio_u: f64,
    /// Standard deviation of the residual.
    pub noise_deg: f64,
    /// Share of the angle's variance in the window that the fit explains.
    pub explained: f64,
}

/// Consecutive windows over `from_s..to_s`; wild samples are excluded from `samples` on the way.
pub fn windows(samples: &mut Samples<'_>, from_s: f64, to_s: f64, frequency: f64) -> Vec<Window> {
    let mut out: Vec<Window> = Vec::new();
    let (mut power, mut white) = (0.0, 0.0);
    let mut begin = from_s;
    let mut last: Option<ModeFit> = None;
    let mut guess = frequency;
    // A last window may lack a hundredth of its length.
    while begin + 0.99 * WINDOW_CYCLES * TAU / guess <= to_s {
        let end = begin + WINDOW_CYCLES * TAU / guess;
        let found = fit_window(&samples.between(begin, end), last.as_ref(), guess);
        let Some(mut found) = found else {
            begin = end;
            last = None;
            continue;
        };
        if exclude_wild(samples, begin, end, &found) {
            if let Some(again) = refine(&samples.between(begin, end), &found.mode) {
                found = again;
            }
        }
        let stretch = samples.between(begin, end);
        if let Some(window) = window(&stretch, &found) {
            let residuals = DampedSinusoid { stretch }.residuals_deg(&found.mode);
            power += uncertainty::power(&stretch, &residuals, &NEIGHBOURS);
            white += LEFT_OVER * window.noise_deg.powi(2);
            out.push(window);
        }
        // The next one is as long as three cycles are by now.
        guess = found.mode.damped_frequency_rad_s.clamp(0.8 * guess, 1.25 * guess);
        begin = end;
        last = Some(found);
    }
    let colour = (power / white).sqrt();
    if colour.is_finite() {
        for window in &mut out {
            window.natural_frequency_u *= colour;
            window.damping_ratio_u *= colour;
        }
    }
    out
}

fn fit_window(stretch: &Stretch<'_>, last: Option<&ModeFit>, frequency: f64) -> Option<ModeFit> {
    last.and_then(|found| {
        let mode = found.mode;
        let start = linear_start(stretch, mode.decay_rate_1_s, mode.damped_frequency_rad_s)?;
        refine(stretch, &start)
    })
    .or_else(|| fit_mode(stretch, frequency))
}

fn window(stretch: &Stretch<'_>, found: &ModeFit) -> Option<Window> {
    let deviations = uncertainty::white(found)?;
    let middle = stretch.start_s() + 0.5 * stretch.duration_s();
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for (_, y) in stretch.kept() {
        let y = y - found.mode.offset_deg;
        n += 1.0;
        sum += y;
        squares += y * y;
    }
    let total = squares - sum * sum / n;
    Some(Window {
        from_s: stretch.start_s(),
        to_s: stretch.start_s() + stretch.duration_s(),
        amplitude_deg: found.mode.amplitude_deg(middle),
        natural_frequency_rad_s: found.mode.natural_frequency_rad_s(),
        natural_frequency_u: deviations.natural_frequency_rad_s,
        damping_ratio: found.mode.damping_ratio(),
        damping_ratio_u: deviations.damping_ratio,
        noise_deg: found.fit.variance().sqrt(),
        explained: 1.0 - found.fit.sum_of_squares / total,
    })
}

/// Excludes what lies off the window's own fit by far more than the rest does. Whether there was anything.
fn exclude_wild(samples: &mut Samples<'_>, from_s: f64, to_s: f64, found: &ModeFit) -> bool {
    let stretch = samples.between(from_s, to_s);
    let residuals = DampedSinusoid { stretch }.residuals_deg(&found.mode);
    let mut sizes: Vec<f64> =
        (0..stretch.len()).filter(|&k| !stretch.excluded[k]).map(|k| residuals[k].abs()).collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    // Rounding of noise-free data is no wild sample.
    let floor = 1e-6 * found.mode.amplitude_deg(stretch.start_s());
    let limit = (WILD * median(&mut sizes) / 0.6745).max(floor);
    if largest <= limit {
        return false;
    }
    let wild: Vec<usize> = (0..stretch.len())
        .filter(|&k| !stretch.excluded[k] && residuals[k].abs() > limit)
        .map(|k| stretch.first + k)
        .collect();
    for k in wild {
        samples.exclude(k);
    }
    true
}
