//! Whether any set of effects can bring a model down to the noise: one linear step with all of them at once.

use crate::effects::Effect;
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::fit::problem::{problem_of_one, Release};
use crate::solver::{Normal, Rows};
use nalgebra::{Cholesky, DMatrix};

/// Damping ratios at which a line that dies out is tried.
const MODE_DAMPING: [f64; 3] = [0.003, 0.015, 0.05];

/// Residual over noise that one linear step with every effect of `candidates` beside `model` would leave.
/// Bounds are not heeded: no set of them gets below, as far as linear steps tell.
pub(super) fn reach(decay: &FreeDecay, model: &Fitted, candidates: &[Effect]) -> f64 {
    let release = Release { decay, count: model.count };
    let n = model.parameters.len();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut residuals = Vec::new();
    let mut add = |effect: Option<Effect>, start: &[f64]| {
        let structure =
            effect.clone().map_or(model.structure.clone(), |e| model.structure.with(&e));
        let mut p = model.parameters.clone();
        p.extend(start);
        let problem = problem_of_one(release, &structure, &p);
        let part = &problem.parts[0];
        let is_own = |j: &&usize| effect.is_none() || **j >= n;
        let own: Vec<usize> = part.free.iter().filter(is_own).copied().collect();
        let (r, by_own) = part.linearised_by(&p, &own);
        columns.extend(by_own);
        residuals = r;
    };
    add(None, &[]);
    for effect in candidates.iter().filter(|e| !model.structure.effects.contains(e)) {
        for start in
            crate::fit::starts::of(decay, model, effect).into_iter().filter(|s| s[0] == 0.0)
        {
            let damping = effect.line().and_then(|line| effect.varied_place(line.damping?));
            let Some(at) = damping else {
                add(Some(effect.clone()), &start);
                continue;
            };
            for zeta in MODE_DAMPING {
                let mut start = start.clone();
                start[at] = zeta;
                add(Some(effect.clone()), &start);
            }
        }
    }
    let usable = |c: &Vec<f64>| {
        let power: f64 = c.iter().map(|x| x * x).sum();
        power.is_finite() && power > 0.0
    };
    columns.retain(usable);
    for column in &mut columns {
        let size = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        column.iter_mut().for_each(|x| *x /= size);
    }
    let mut normal = Normal::new(columns.len());
    let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    normal.block(&residuals, &slices);
    let (matrix, gradient) = (normal.matrix(), normal.gradient());
    let ridge = DMatrix::identity(columns.len(), columns.len()) * 1e-9;
    let gain = Cholesky::new(matrix + ridge).map_or(0.0, |c| c.solve(&gradient).dot(&gradient));
    let freedom = model.count.saturating_sub(columns.len()).max(1) as f64;
    ((normal.sum_of_squares() - gain).max(0.0) / freedom).sqrt()
}
