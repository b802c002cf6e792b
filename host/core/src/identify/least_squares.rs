//! Least squares on every sample of a free decay: amplitude, phase, offset, wn and zeta in one fit.
//!
//! The minimum has many neighbours, one for each wrong count of cycles. So the fit starts on three cycles,
//! from several starts, and is carried to longer and longer horizons on block means; only the last steps see
//! all samples. On synthetic decays its errors are those of the Cramer-Rao bound (see the tests).

use super::damped_sinusoid::{DampedSinusoid, Mode};
use super::pencil;
use super::samples::Stretch;
use crate::solver::{self, linear_fit, Fit, Options};
use std::f64::consts::TAU;

/// Block means per cycle while the start is sought: the fit of a sinusoid loses under 1 % of what it could
/// know.
const START_MEANS_PER_CYCLE: f64 = 16.0;
/// Cycles of the first horizon.
const FIRST_HORIZON: f64 = 3.0;
/// One more than there are parameters.
const MIN_SAMPLES: usize = 6;
/// How much longer the next horizon is. The phase at its end must be known to well under half a cycle.
const LENGTHENING: f64 = 2.0;

/// A mode fitted to a stretch.
#[derive(Clone, Debug)]
pub struct ModeFit {
    /// The mode at the least sum of squares.
    pub mode: Mode,
    pub(crate) fit: Fit,
}

/// Fits one mode to all of `stretch`; `frequency_rad_s` is known to some ten percent. `None` where no fit
/// reaches a minimum with an oscillation in it.
pub fn fit_mode(stretch: &Stretch<'_>, frequency_rad_s: f64) -> Option<ModeFit> {
    if stretch.len() < MIN_SAMPLES {
        return None;
    }
    let start = start(stretch, frequency_rad_s)?;
    refine(stretch, &start)
}

/// The last steps on all samples, from a mode that is already near.
pub(crate) fn refine(stretch: &Stretch<'_>, start: &Mode) -> Option<ModeFit> {
    fit_from(stretch, start, &Options { damping: 1e-6, ..Options::default() })
}

fn fit_from(stretch: &Stretch<'_>, start: &Mode, options: &Options) -> Option<ModeFit> {
    if stretch.len() < MIN_SAMPLES {
        return None;
    }
    let origin = stretch.start_s();
    let fit = solver::minimise(
        &DampedSinusoid { stretch: *stretch },
        &start.parameters_at(origin),
        options,
    );
    let mode = Mode::from_parameters(origin, &fit.parameters);
    let seen = mode.damped_frequency_rad_s * stretch.duration_s() > 0.5 * TAU;
    (fit.stop.is_minimum() && seen).then_some(ModeFit { mode, fit })
}

/// A mode near the minimum over all of `stretch`, from block means over lengthening horizons.
fn start(stretch: &Stretch<'_>, frequency_rad_s: f64) -> Option<Mode> {
    let period = TAU / frequency_rad_s;
    let block = (period / stretch.step_s / START_MEANS_PER_CYCLE).floor().max(1.0) as usize;
    let means = stretch.block_means(block);
    let none = vec![false; means.len()];
    let means = means.stretch(&none);
    if means.len() < MIN_SAMPLES {
        return None;
    }
    let coarse = Options { tolerance: 1e-2, max_evaluations: 30, ..Options::default() };
    let begin = means.start_s();
    let first = means.between(begin, begin + FIRST_HORIZON * period);
    let mut best = starts(&first, frequency_rad_s)
        .iter()
        .filter_map(|mode| fit_from(&first, mode, &coarse))
        .filter(|found| near(found.mode.damped_frequency_rad_s, frequency_rad_s))
        .min_by(by_misfit)
        .map(|found| found.mode);
    let mut horizon = FIRST_HORIZON * LENGTHENING * period;
    while let Some(mode) = best.filter(|_| horizon < means.duration_s()) {
        let longer = means.between(begin, begin + horizon);
        best = fit_from(&longer, &mode, &coarse).map(|found| found.mode);
        horizon *= LENGTHENING;
    }
    // The spectrum of the whole stretch as the last start: where the first cycles mislead, it wins.
    let whole = best
        .into_iter()
        .chain(linear_start(&means, 0.01 * frequency_rad_s, frequency_rad_s))
        .filter_map(|mode| fit_from(&means, &mode, &coarse))
        .min_by(by_misfit)?;
    Some(whole.mode)
}

fn by_misfit(a: &ModeFit, b: &ModeFit) -> std::cmp::Ordering {
    a.fit.sum_of_squares.total_cmp(&b.fit.sum_of_squares)
}

fn near(frequency: f64, guess: f64) -> bool {
    frequency > 0.5 * guess && frequency < 2.0 * guess
}

/// Starts for a stretch of a few cycles: the matrix pencil's poles and the spectrum's frequency at three
/// dampings.
fn starts(stretch: &Stretch<'_>, frequency_rad_s: f64) -> Vec<Mode> {
    let by_pencil = pencil::poles(stretch.yaw_deg, stretch.step_s, 1)
        .into_iter()
        .filter(|p| near(p.frequency_rad_s, frequency_rad_s))
        .map(|p| (p.decay_rate_1_s, p.frequency_rad_s));
    let by_spectrum = [0.0, 0.02, 0.1].map(|zeta| (zeta * frequency_rad_s, frequency_rad_s));
    by_pencil.chain(by_spectrum).filter_map(|(s, w)| linear_start(stretch, s, w)).collect()
}

/// The mode with this decay rate (1/s) and damped frequency (rad/s): its amplitude, phase and offset by
/// linear least squares. `None` where the samples do not determine them.
pub fn linear_start(stretch: &Stretch<'_>, decay_rate: f64, frequency: f64) -> Option<Mode> {
    if stretch.is_empty() {
        return None;
    }
    let origin = stretch.start_s();
    let row = |(t, y): (f64, f64)| {
        let e = (-decay_rate * (t - origin)).exp();
        let (s, c) = (frequency * (t - origin)).sin_cos();
        ([e * c, e * s, 1.0], y)
    };
    let [cosine, sine, zero] = linear_fit(stretch.kept().map(row))?;
    Some(Mode::from_parameters(origin, &[cosine, sine, zero, decay_rate, frequency]))
}
