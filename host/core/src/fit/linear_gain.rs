//! What adding an effect would gain, from one linear step: a screen that costs one evaluation.

use crate::effects::Effect;
use crate::fit::fitting::{Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::part::Release;
use crate::fit::problem::problem_of_one;
use crate::par_map::ParMap;
use crate::solver::{Normal, Problem, Rows};
use nalgebra::Cholesky;

/// A model to which effects may be added.
pub(crate) struct Screen<'a> {
    pub(crate) decay: &'a FreeDecay,
    pub(crate) inner: &'a Fitted,
    /// Its free numbers, and the derivatives of its residuals by them.
    free: Vec<usize>,
    columns: Vec<Vec<f64>>,
}

impl<'a> Screen<'a> {
    pub(crate) fn new(decay: &'a FreeDecay, inner: &'a Fitted) -> Self {
        let p = &inner.parameters;
        let problem = problem_of_one(Release { decay, count: inner.count }, &inner.structure, p);
        let part = &problem.parts[0];
        let (_, columns) = part.linearised(p);
        Self { decay, inner, free: part.free.clone(), columns }
    }

    /// What one linear step would leave of the sum of squares with `effect` added, and how many numbers it
    /// takes. Exact near the minimum, which is where it decides; elsewhere it orders.
    pub(crate) fn left_with(&self, effect: &Effect) -> (f64, usize) {
        let Self { decay, inner, .. } = *self;
        let structure = inner.structure.with(effect);
        let n = inner.parameters.len();
        if effect.is_own() {
            // Its parameters may be many and none of them a size: it is always worth a try.
            return (0.0, effect.parameters().len());
        }
        let mut best = (inner.sum_of_squares, 1);
        for start in crate::fit::starts::of(decay, inner, effect) {
            // From zero, where the model is that of `inner`; a frequency is tried where the residual has its
            // lines.
            if start[0] != 0.0 {
                continue;
            }
            let mut p = inner.parameters.clone();
            p.extend(&start);
            let problem = problem_of_one(Release { decay, count: inner.count }, &structure, &p);
            let part = &problem.parts[0];
            let own: Vec<usize> = part.free.iter().filter(|j| **j >= n).copied().collect();
            let (residuals, by_own) = part.linearised_by(&p, &own);
            let places: Vec<usize> = self.free.iter().chain(&own).copied().collect();
            let columns: Vec<&[f64]> =
                self.columns.iter().chain(&by_own).map(Vec::as_slice).collect();
            let mut normal = Normal::new(p.len());
            normal.part(&residuals, &places, &columns);
            let Some((gain, more)) = gain_at(&normal, n, problem.bounds(n)) else { continue };
            // The problem's residuals count over the noise, the model's are angles.
            let left = (inner.sum_of_squares - gain * decay.noise_rad.powi(2)).max(0.0);
            if left < best.0 {
                best = (left, more);
            }
        }
        best
    }

    /// With an effect of one's own whose whole moment is in proportion to one of its numbers: from none of it,
    /// the others at that one of its starts from which a linear step leaves the least. By fixed steps.
    pub(crate) fn begun_with(&self, effect: &Effect) -> Option<Begun> {
        let Self { decay, inner, .. } = *self;
        let Effect::Own(own) = effect else { return None };
        let of_own = own.size_parameter()?;
        let size = inner.parameters.len() + of_own;
        let structure = Structure { swift: true, ..inner.structure.with(effect) };
        let mut starts = crate::fit::starts::of(decay, inner, effect);
        starts.iter_mut().for_each(|start| start[of_own] = 0.0);
        // Those that differed by the size alone.
        starts.dedup();
        let begun = |start: Vec<f64>| {
            let mut p = [&inner.parameters[..], &start].concat();
            let problem = problem_of_one(Release { decay, count: inner.count }, &structure, &p);
            let (residuals, by_size) = problem.parts[0].linearised_by(&p, &[size]);
            let places: Vec<usize> = self.free.iter().copied().chain([size]).collect();
            let columns: Vec<&[f64]> =
                self.columns.iter().chain(&by_size).map(Vec::as_slice).collect();
            let mut normal = Normal::new(p.len());
            normal.part(&residuals, &places, &columns);
            let (gain, step) = step_at(&normal, &places)?;
            places.iter().zip(step).for_each(|(&at, by)| p[at] += by);
            let left = (inner.sum_of_squares - gain * decay.noise_rad.powi(2)).max(0.0);
            Some(Begun { structure: structure.clone(), parameters: p, left })
        };
        let all = starts.into_iter().par_map(begun);
        all.flatten().min_by(|a, b| a.left.total_cmp(&b.left))
    }
}

/// A model with an effect, where one linear step leads.
pub(crate) struct Begun {
    pub(crate) structure: Structure,
    pub(crate) parameters: Vec<f64>,
    /// Sum of squares that the step leaves, rad2.
    pub(crate) left: f64,
}

/// By how much one linear step from `p` lowers the sum of squares of `problem`, and how many numbers beyond
/// the first `n` it takes; none where it leads out of the bounds of an effect that can only be positive.
pub(crate) fn gain_of_step(problem: &dyn Problem, p: &[f64], n: usize) -> Option<(f64, usize)> {
    let mut normal = Normal::new(p.len());
    problem.evaluate(p, &mut normal);
    gain_at(&normal, n, problem.bounds(n))
}

fn gain_at(normal: &Normal, n: usize, bounds: (f64, f64)) -> Option<(f64, usize)> {
    let (a, g) = (normal.matrix(), normal.gradient());
    let only_up = bounds.0 == 0.0;
    let used: Vec<usize> = (0..g.len()).filter(|&i| i < n || a[(i, i)] > 0.0).collect();
    let (gain, step) = step_at(normal, &used)?;
    let inward = !only_up || used.len() <= n || step[n] > 0.0;
    inward.then(|| (gain, used.len() - n))
}

/// The linear step itself by the numbers at `places`, and by how much it lowers the sum of squares.
fn step_at(normal: &Normal, places: &[usize]) -> Option<(f64, Vec<f64>)> {
    let mut part = normal.matrix().select_rows(places).select_columns(places);
    let g = normal.gradient().select_rows(places);
    for i in 0..places.len() {
        part[(i, i)] *= 1.0 + 1e-10;
    }
    let step = Cholesky::new(part)?.solve(&g);
    Some((step.dot(&g), step.iter().map(|s| -s).collect()))
}
