//! Definite effects of a free decay that is forced at random besides: generalised least squares, residuals
//! and sensitivities whitened by the Kalman filter of [`crate::motion::random`].

use crate::bic;
use crate::bic::MARGIN;
use crate::diagnosis::buffeting::{self, Buffeted};
use crate::diagnosis::likelihood::{explained_up_to, BREADTH};
use crate::effects::Effect;
use crate::fit::fitting::{Fitted, Modal, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::linear_gain::gain_of_step;
use crate::fit::part::Release;
use crate::fit::problem::{problem_of_one, JointProblem, EVALUATIONS};
use crate::motion::random::Whitener;
use crate::par_map::ParMap;
use crate::solver::{minimise, Fit, Options, Problem, Rows};

/// Standard deviations that chance does not bring: once in 16 000 records. All that is asked of innovations
/// is asked at this level.
pub(super) const BEYOND_CHANCE: f64 = 4.0;

/// The random forcing of the `plain` model, if it is one and far likelier than `best`.
pub(crate) fn forced_rather_than(
    decay: &FreeDecay,
    plain: &Fitted,
    best: &Fitted,
) -> Option<Buffeted> {
    let (deterministic, n) = buffeting::definite_criterion(decay, best);
    buffeting::fit(decay, plain).filter(|b| holds(b, plain.parameters.len(), deterministic, n))
}

/// Whether what a definite `model` leaves is random forcing, far likelier than that model's noise.
pub(crate) fn is_random(decay: &FreeDecay, model: &Fitted) -> bool {
    let (deterministic, n) = buffeting::definite_criterion(decay, model);
    buffeting::fit_residuals(decay, model, &states(decay, model))
        .is_some_and(|b| holds(&b, model.parameters.len(), deterministic, n))
}

/// Whether what a model of so many `numbers` leaves is random forcing, given the criterion of the best
/// definite model.
pub(super) fn holds(b: &Buffeted, numbers: usize, deterministic: f64, n: f64) -> bool {
    let random = bic::of_deviance(b.deviance, n, numbers + 1);
    deterministic - random > bic::MARGIN
        && b.unsteadiness < BEYOND_CHANCE
        && b.correlation_off.abs() < BEYOND_CHANCE / n.sqrt()
        && b.state_dependence < BEYOND_CHANCE
        // The largest of n normal variates, whose tails fall as exp(-x^2 / 2), and of n / 2 exponential ones.
        && b.largest < (BEYOND_CHANCE.powi(2) + 2.0 * n.ln()).sqrt()
        && b.line < 0.5 * BEYOND_CHANCE.powi(2) + (0.5 * n).ln()
        && b.over_noise <= explained_up_to(n)
}

/// A model under random forcing.
pub(crate) struct Forced {
    /// Fitted to whitened residuals; `residuals` are the plain ones.
    pub(crate) model: Fitted,
    pub(crate) forcing: Buffeted,
}

/// A model's numbers under random forcing. Its effects act along the motion, most of which the forcing may
/// make: what is left then follows the linear equation of motion.
struct Whitened<'a> {
    inner: JointProblem<'a>,
    whitener: &'a Whitener,
}

impl<'a> Whitened<'a> {
    fn new(decay: &'a FreeDecay, structure: &Structure, start: &[f64], known: &'a Known) -> Self {
        let mut inner = problem_of_one(Release::whole(decay), structure, start);
        inner.parts[0].states = Some(known.states);
        Self { inner, whitener: &known.whitener }
    }
}

/// What is known of a forced motion: how to whiten what it leaves, and its angle and rate at each instant.
struct Known<'a> {
    whitener: Whitener,
    states: &'a [[f64; 2]],
}

fn whitener(decay: &FreeDecay, forcing: &Buffeted) -> Option<Whitener> {
    let Modal { natural_frequency_rad_s: wn, damping_ratio: zeta } = forcing.modal;
    Whitener::new(&decay.grid, wn.value, zeta.value, forcing.ratio)
}

/// Angle and rate of `model` at each instant of `decay`.
fn states(decay: &FreeDecay, model: &Fitted) -> Vec<[f64; 2]> {
    let (yaw, rate) = model.motion().readings_and_rates(&decay.grid);
    yaw.into_iter().zip(rate).map(|(b, r)| [b, r]).collect()
}

/// Angle and rate at each instant of the motion that `decay` shows: those of its `plain` model, and what the
/// `forcing` adds to them.
fn forced_states(decay: &FreeDecay, plain: &Fitted, forcing: &Buffeted) -> Option<Vec<[f64; 2]>> {
    let left: Vec<f64> = plain.residuals.iter().map(|r| -r).collect();
    let random = whitener(decay, forcing)?.smoothed(&left);
    let both = states(decay, plain).into_iter().zip(random);
    Some(both.map(|([b, r], [db, dr])| [b + db, r + dr]).collect())
}

/// Hands on what it is given, whitened.
struct Filtered<'a> {
    rows: &'a mut dyn Rows,
    whitener: &'a Whitener,
}

impl Rows for Filtered<'_> {
    fn row(&mut self, residual: f64, row: &[f64]) {
        // Only what cannot be evaluated comes row by row.
        self.rows.row(residual, row);
    }

    fn part(&mut self, residuals: &[f64], which: &[usize], columns: &[&[f64]]) {
        let whitened = |series: &[f64]| {
            let mut out = series.to_vec();
            self.whitener.whiten(&mut out);
            out
        };
        let columns: Vec<Vec<f64>> = columns.iter().map(|c| whitened(c)).collect();
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        self.rows.part(&whitened(residuals), which, &slices);
    }
}

impl Problem for Whitened<'_> {
    fn parameters(&self) -> usize {
        self.inner.parameters()
    }
    fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
        self.inner.evaluate(p, &mut Filtered { rows, whitener: self.whitener });
    }
    fn bounds(&self, index: usize) -> (f64, f64) {
        self.inner.bounds(index)
    }
}

fn solve(decay: &FreeDecay, structure: &Structure, start: &[f64], known: &Known) -> Fit {
    let options =
        Options { max_evaluations: EVALUATIONS, tolerance: 0.02, accuracy: 0.0, damping: 1e-4 };
    minimise(&Whitened::new(decay, structure, start, known), start, &options)
}

/// What `fit` leaves is the random motion's, and noise.
fn finished(decay: &FreeDecay, structure: &Structure, fit: Fit, known: &Known) -> Fitted {
    let Whitened { inner, .. } = Whitened::new(decay, structure, &fit.parameters, known);
    let (converged, covariance) = (fit.stop.is_minimum(), fit.covariance.as_ref());
    let mut model = inner.parts[0].fitted(&fit.parameters, converged, covariance);
    // The covariance is that of white innovations; the plain residuals' correlation does not bear on it.
    (model.correlation, model.inflation, model.modal_inflation) = (0.0, 1.0, 1.0);
    model
}

/// Those of `candidates` beside `inner` for which a linear step under the filter predicts evidence, most
/// first.
fn promising(
    decay: &FreeDecay,
    inner: &Fitted,
    known: &Known,
    sum_of_squares: f64,
    candidates: &[Effect],
) -> Vec<Effect> {
    let (n, count) = (inner.parameters.len(), decay.yaw_rad.len() as f64);
    let delta_bic = |effect: &Effect| -> f64 {
        if effect.is_own() {
            // Its numbers may be many and none of them a size.
            return f64::INFINITY;
        }
        let structure = inner.structure.with(effect);
        let starts = crate::fit::starts::of(decay, inner, effect);
        let from = |start: &Vec<f64>| {
            let p = [&inner.parameters[..], start].concat();
            let problem = Whitened::new(decay, &structure, &p, known);
            let (gain, more) = gain_of_step(&problem, &p, n)?;
            let left = (sum_of_squares - gain).max(f64::MIN_POSITIVE);
            Some(bic::gain(sum_of_squares, left, count, more as f64))
        };
        let unmoved = starts.iter().filter(|start| start[0] == 0.0);
        unmoved.filter_map(from).fold(f64::NEG_INFINITY, f64::max)
    };
    let there = &inner.structure.effects;
    let mut out: Vec<(f64, Effect)> = candidates
        .iter()
        .filter(|e| !there.contains(e))
        .par_map(|e| (delta_bic(e), e.clone()))
        .filter(|(delta_bic, _)| *delta_bic > MARGIN)
        .collect();
    out.sort_by(|a, b| b.0.total_cmp(&a.0));
    out.into_iter().take(BREADTH).map(|(_, e)| e).collect()
}

/// The effects that `decay` shows beside the random `forcing` of its plain model; none where it shows none.
pub(crate) fn search(
    decay: &FreeDecay,
    plain: &Fitted,
    forcing: &Buffeted,
    candidates: &[Effect],
) -> Option<Forced> {
    let n = decay.yaw_rad.len() as f64;
    let mut forcing = forcing.clone();
    let mut model = plain.clone();
    let there = plain.structure.effects.len();
    let states = &forced_states(decay, plain, &forcing)?;
    // No third, for speed: each is fitted through the filter.
    while model.structure.effects.len() - there < 2 {
        let known = Known { whitener: whitener(decay, &forcing)?, states };
        let smaller = solve(decay, &model.structure, &model.parameters, &known);
        let mut inner = model.clone();
        inner.parameters.clone_from(&smaller.parameters);
        // Lines are looked for in the innovations: the random motion is all about the natural frequency.
        known.whitener.whiten(&mut inner.residuals);
        let best = promising(decay, &inner, &known, smaller.sum_of_squares, candidates)
            .iter()
            .par_map(|e| {
                let structure = model.structure.with(e);
                let (inner, known) = (&inner, &known);
                let starts = crate::fit::starts::of(decay, inner, e).into_iter();
                let from = starts.map(|start| {
                    let mut p = inner.parameters.clone();
                    p.extend(start);
                    (structure.clone(), solve(decay, &structure, &p, known))
                });
                from.collect::<Vec<_>>()
            })
            .flatten()
            .filter(|(_, fit)| fit.stop.is_minimum())
            .map(|(structure, fit)| {
                let more = (fit.parameters.len() - smaller.parameters.len()) as f64;
                let gain = bic::gain(smaller.sum_of_squares, fit.sum_of_squares, n, more);
                (gain, structure, fit)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((gain, structure, fit)) = best else { break };
        if gain < MARGIN {
            break;
        }
        model = finished(decay, &structure, fit, &known);
        // The effect no longer counts as forcing; with less of it, the fit is another.
        forcing = buffeting::fit_residuals(decay, &model, states)?;
        let known = Known { whitener: whitener(decay, &forcing)?, states };
        let again = solve(decay, &structure, &model.parameters, &known);
        if again.stop.is_minimum() {
            model = finished(decay, &structure, again, &known);
            forcing = buffeting::fit_residuals(decay, &model, states)?;
        }
    }
    (model.structure.effects.len() > there).then_some(Forced { model, forcing })
}
