//! wn and zeta as they change with amplitude: one least-squares fit to every three cycles.

use super::damped_sinusoid::DampedSinusoid;
use super::least_squares::{fit_mode, linear_start, refine, ModeFit};
use super::samples::{Samples, Stretch};
use super::{uncertainty, AtAmplitude};
use crate::quantity::Quantity;
use crate::record::Derivative;
use crate::statistics::median;
use std::f64::consts::TAU;

/// Cycles in a window.
pub(crate) const WINDOW_CYCLES: f64 = 3.0;
/// Share of three cycles a window holds at least.
pub(crate) const MIN_SHARE: f64 = 0.95;
/// A residual this many standard deviations out belongs to a wild sample: once in 500 million samples by
/// chance.
const WILD: f64 = 6.0;

/// Ratio of the frequencies of two windows, one behind the other, beyond which they are of two modes.
const LEAP: f64 = 1.25;
/// Multiples of a third of the oscillation's frequency at which the residual's spectrum is looked at: about
/// the oscillation, which the fit has emptied, and clear of its harmonics.
const NEIGHBOUR_BINS: [usize; 3] = [2, 4, 5];
/// What fitting amplitude, phase, wn and zeta leaves of white noise there, in bins. Of the columns t cos and
/// t sin 30 % of the power lie one bin off on either side and 8 % two bins off.
const LEFT_OVER: f64 = 3.0 - 0.30 - 0.30 - 0.08;

/// One window. Uncertainties hold for noise as coloured as the residuals of all windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    /// Envelope at the middle of the window, of what is recorded.
    pub(crate) amplitude_deg: f64,
    /// Mid-line of the oscillation.
    pub(crate) midline_deg: f64,
    /// For white noise.
    pub(crate) midline_u_deg: f64,
    pub(crate) natural_frequency_rad_s: f64,
    pub(crate) natural_frequency_u: f64,
    pub(crate) damping_ratio: f64,
    pub(crate) damping_ratio_u: f64,
    /// Standard deviation of the residual.
    pub(crate) noise_deg: f64,
    /// Standard deviation of white noise as dense as the residuals of all windows are about the oscillation.
    pub(crate) noise_near_deg: f64,
    /// Standard deviation of the angle.
    pub(crate) motion_deg: f64,
}

impl Window {
    /// Amplitude of the motion at its middle.
    pub(crate) fn motion_amplitude_deg(&self, derivative: Derivative) -> f64 {
        derivative.of_motion(self.amplitude_deg, self.natural_frequency_rad_s)
    }

    /// wn and zeta at that amplitude.
    pub(crate) fn at_amplitude(&self, derivative: Derivative) -> AtAmplitude {
        AtAmplitude {
            amplitude_deg: self.motion_amplitude_deg(derivative),
            natural_frequency_rad_s: Quantity::new(
                self.natural_frequency_rad_s,
                self.natural_frequency_u,
            ),
            damping_ratio: Quantity::new(self.damping_ratio, self.damping_ratio_u),
        }
    }

    /// Whether another motion than the fit's is the larger one, and more than white noise of the given standard
    /// deviation.
    fn is_of_another(&self, white_noise_deg: f64) -> bool {
        let (white, left) = (white_noise_deg.powi(2), self.noise_deg.powi(2));
        left - white > white.max(self.motion_deg.powi(2) - left)
    }

    /// Share of the motion that the fit explains, white noise of the given standard deviation taken off both.
    pub(crate) fn explained(&self, white_noise_deg: f64) -> f64 {
        let white = white_noise_deg.powi(2);
        let motion = self.motion_deg.powi(2) - white;
        if motion > 0.1 * white {
            1.0 - (self.noise_deg.powi(2) - white).max(0.0) / motion
        } else {
            0.0
        }
    }
}

/// wn and zeta from the motion's largest amplitude in the windows to its smallest, each between its two
/// neighbours in proportion to the logarithm of the amplitude.
pub(crate) fn at_amplitudes(windows: &[Window], derivative: Derivative) -> Vec<AtAmplitude> {
    let of_motion = |w: &Window| Window { amplitude_deg: w.motion_amplitude_deg(derivative), ..*w };
    let mut sorted: Vec<Window> =
        windows.iter().map(of_motion).filter(|w| w.amplitude_deg > 0.0).collect();
    sorted.sort_by(|a, b| b.amplitude_deg.total_cmp(&a.amplitude_deg));
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else { return Vec::new() };
    let at = |amplitude_deg: f64| {
        let next = sorted.partition_point(|w| w.amplitude_deg > amplitude_deg);
        let (below, above) = (&sorted[next.min(sorted.len() - 1)], &sorted[next.saturating_sub(1)]);
        let between = (above.amplitude_deg / below.amplitude_deg).ln();
        let share = match between > 0.0 {
            true => ((above.amplitude_deg / amplitude_deg).ln() / between).clamp(0.0, 1.0),
            false => 0.0,
        };
        let mean = |of: fn(&Window) -> (f64, f64)| {
            let ((a, u_a), (b, u_b)) = (of(above), of(below));
            let value = a + share * (b - a);
            Quantity::new(value, ((1.0 - share) * u_a).hypot(share * u_b))
        };
        AtAmplitude {
            amplitude_deg,
            natural_frequency_rad_s: mean(|w| (w.natural_frequency_rad_s, w.natural_frequency_u)),
            damping_ratio: mean(|w| (w.damping_ratio, w.damping_ratio_u)),
        }
    };
    AtAmplitude::amplitudes(first.amplitude_deg, last.amplitude_deg).map(at).collect()
}

/// Where the mode of this `frequency` begins behind another motion that is larger at first, as a blow leaves it: most
/// windows up to there hold little of it, or have another frequency and then leap to this. `None` without one in the
/// first half.
pub(crate) fn settled_from_s(
    windows: &[Window],
    frequency: f64,
    white_noise_deg: f64,
) -> Option<f64> {
    let is_near = |a: f64, b: f64| (1.0 / LEAP..=LEAP).contains(&(a / b));
    let wn = |k: usize| windows[k].natural_frequency_rad_s;
    let is_lost = |k: usize| windows[k].is_of_another(white_noise_deg);
    let of_another = |k: usize| is_lost(k) || !is_near(wn(k), frequency);
    let (mut first, mut others) = (None, 0);
    for k in 1..windows.len() / 2 {
        let before = of_another(k - 1);
        others += usize::from(before);
        let leaps = is_lost(k - 1) || !is_near(wn(k - 1), wn(k));
        if before && !of_another(k) && leaps && 2 * others > k {
            first = Some(k);
        }
    }
    first.map(|k: usize| windows[k].from_s)
}

/// Consecutive windows over `from_s..to_s` and the spectral density, as a variance, of what they leave about
/// the oscillation's frequency; wild samples are excluded from `samples` on the way.
pub(crate) fn windows(
    samples: &mut Samples<'_>,
    from_s: f64,
    to_s: f64,
    frequency: f64,
) -> (Vec<Window>, f64) {
    let mut fits = consecutive(samples, from_s, to_s, frequency);
    // The middle scatter of all windows: in few cycles of coloured noise a window's own can be small by
    // chance.
    let mut scatters: Vec<f64> = fits.iter().map(|f| f.scatter_deg).collect();
    let scatter = median(&mut scatters);
    for f in &mut fits {
        if exclude_wild(samples, f, scatter)
            && let Some(again) = refine(&samples.between(f.from_s, f.to_s), &f.found.mode)
        {
            f.found = again;
        }
    }
    let mut out: Vec<Window> = Vec::new();
    let (mut power, mut variance) = (0.0, 0.0);
    for f in &fits {
        let stretch = samples.between(f.from_s, f.to_s);
        if let Some(window) = window(&stretch, &f.found) {
            let residuals = DampedSinusoid { stretch }.residuals_deg(&f.found.mode);
            power += uncertainty::power(&stretch, &residuals, &NEIGHBOUR_BINS);
            variance += window.noise_deg.powi(2);
            out.push(window);
        }
    }
    let density = power / LEFT_OVER / out.len() as f64;
    let colour = (density / (variance / out.len() as f64)).sqrt();
    if colour.is_finite() {
        for window in &mut out {
            window.natural_frequency_u *= colour;
            window.damping_ratio_u *= colour;
            window.noise_near_deg *= colour;
        }
    }
    (out, density)
}

struct WindowFit {
    from_s: f64,
    to_s: f64,
    found: ModeFit,
    /// Standard deviation of the residual from its median size.
    scatter_deg: f64,
}

/// Fits to every three cycles, each window as long as three cycles were in the one before.
fn consecutive(samples: &Samples<'_>, from_s: f64, to_s: f64, frequency: f64) -> Vec<WindowFit> {
    let mut out: Vec<WindowFit> = Vec::new();
    let mut begin = from_s;
    let mut guess = frequency;
    while begin + MIN_SHARE * WINDOW_CYCLES * TAU / guess <= to_s {
        let end = begin + WINDOW_CYCLES * TAU / guess;
        let stretch = samples.between(begin, end);
        let last = out.last().filter(|last| last.to_s == begin).map(|last| &last.found);
        if let Some(found) = fit_window(&stretch, last, guess) {
            guess = found.mode.damped_frequency_rad_s.clamp(guess / LEAP, LEAP * guess);
            let mut sizes = sizes(&stretch, &found).map(|(_, size)| size).collect::<Vec<_>>();
            let scatter_deg = median(&mut sizes) / 0.6745;
            out.push(WindowFit { from_s: begin, to_s: end, found, scatter_deg });
        }
        begin = end;
    }
    out
}

/// Index in the record and size of the residual of every sample that counts.
fn sizes<'a>(stretch: &Stretch<'a>, found: &ModeFit) -> impl Iterator<Item = (usize, f64)> + 'a {
    let stretch = *stretch;
    let residuals = DampedSinusoid { stretch }.residuals_deg(&found.mode);
    (0..stretch.len())
        .filter(move |&k| !stretch.excluded[k])
        .map(move |k| (stretch.first + k, residuals[k].abs()))
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
    Some(Window {
        from_s: stretch.start_s(),
        to_s: stretch.start_s() + stretch.duration_s(),
        amplitude_deg: found.mode.amplitude_deg(middle),
        midline_deg: found.mode.offset_deg,
        midline_u_deg: uncertainty::white_midline_deg(found)?,
        natural_frequency_rad_s: found.mode.natural_frequency_rad_s(),
        natural_frequency_u: deviations.natural_frequency_rad_s,
        damping_ratio: found.mode.damping_ratio(),
        damping_ratio_u: deviations.damping_ratio,
        noise_deg: found.fit.variance().sqrt(),
        noise_near_deg: found.fit.variance().sqrt(),
        motion_deg: ((squares - sum * sum / n) / n).sqrt(),
    })
}

/// Excludes what lies off the window's fit by far more than scatter does. Whether there was anything.
fn exclude_wild(samples: &mut Samples<'_>, fit: &WindowFit, scatter_deg: f64) -> bool {
    let stretch = samples.between(fit.from_s, fit.to_s);
    // Rounding of noise-free data is no wild sample.
    let floor = 1e-6 * fit.found.mode.amplitude_deg(fit.from_s);
    // A fit to a dozen samples comes nearer to most of them than noise would let it.
    let few = 1.0 + 10.0 / stretch.len() as f64;
    let limit = (few * WILD * fit.scatter_deg.max(scatter_deg)).max(floor);
    let wild: Vec<usize> = sizes(&stretch, &fit.found)
        .filter(|(_, size)| *size > limit)
        .map(|(index, _)| index)
        .collect();
    for &k in &wild {
        samples.exclude(k);
    }
    !wild.is_empty()
}
