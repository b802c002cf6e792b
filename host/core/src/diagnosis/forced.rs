//! Definite effects of a free decay that is forced at random besides: generalised least squares, residuals and
//! sensitivities whitened by the Kalman filter of [`crate::diagnosis::buffeting`].

use crate::bic;
use crate::diagnosis::buffeting::{self, Buffeted, Whitener};
use crate::effects::Effect;
use crate::fit::fitting::{finished, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::problem::{problem_of_one, JointProblem, Release};
use crate::solver::{minimise, Fit, Options, Problem, Rows};
use rayon::prelude::*;

/// Evidence below which an effect is not believed beside random forcing: the filter is linear, the effects are not.
const MARGIN: f64 = 15.0;
const MOST_EFFECTS: usize = 2;
const EVALUATIONS: usize = 20;

/// A model under random forcing.
pub(crate) struct Forced {
    /// Fitted to whitened residuals; `residuals` are the plain ones.
    pub model: Fitted,
    pub forcing: Buffeted,
}

struct Whitened<'a> {
    inner: JointProblem<'a>,
    whitener: &'a Whitener,
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

fn solve(decay: &FreeDecay, structure: &Structure, start: &[f64], whitener: &Whitener) -> Fit {
    let inner = problem_of_one(Release::whole(decay), structure, start);
    let options =
        Options { max_evaluations: EVALUATIONS, tolerance: 0.02, accuracy: 0.0, damping: 1e-4 };
    minimise(&Whitened { inner, whitener }, start, &options)
}

fn whitener(decay: &FreeDecay, forcing: &Buffeted) -> Option<Whitener> {
    let Buffeted { natural_frequency_rad_s, damping_ratio, ratio, .. } = *forcing;
    Whitener::new(&decay.grid, natural_frequency_rad_s, damping_ratio, ratio, decay.yaw_rad.len())
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
    while model.structure.effects.len() - there < MOST_EFFECTS {
        let filter = whitener(decay, &forcing)?;
        let smaller = solve(decay, &model.structure, &model.parameters, &filter);
        let mut inner = model.clone();
        inner.parameters.clone_from(&smaller.parameters);
        // Lines are looked for in the innovations: the random motion is all about the natural frequency.
        filter.whiten(&mut inner.residuals);
        let best = candidates
            .par_iter()
            .filter(|e| !model.structure.effects.contains(e))
            .flat_map_iter(|e| {
                let structure = model.structure.with(e);
                let (inner, filter) = (&inner, &filter);
                crate::fit::starts::of(decay, inner, e).into_iter().map(move |start| {
                    let mut p = inner.parameters.clone();
                    p.extend(start);
                    (structure.clone(), solve(decay, &structure, &p, filter))
                })
            })
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
        model = finished(decay, &structure, fit, decay.yaw_rad.len());
        // The effect no longer counts as forcing; with less of it, the fit is another.
        forcing = buffeting::fit_residuals(decay, &model)?;
        let filter = whitener(decay, &forcing)?;
        let again = solve(decay, &structure, &model.parameters, &filter);
        if again.stop.is_minimum() {
            model = finished(decay, &structure, again, decay.yaw_rad.len());
            forcing = buffeting::fit_residuals(decay, &model)?;
        }
        // The covariance is that of white innovations; the plain residuals' correlation does not bear on it.
        (model.correlation, model.inflation, model.modal_inflation) = (0.0, 1.0, 1.0);
    }
    (model.structure.effects.len() > there).then_some(Forced { model, forcing })
}
