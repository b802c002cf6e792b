//! A model with effects fitted to a free swing: natural frequency, damping, initial state and every coefficient.

use super::effects::{Effect, Terms};
use super::simulate::{readings_of_all, Grid, Motion};
use super::swing::Swing;
use crate::fit::{minimise, Fit, Normal, Options, Problem, Rows};
use crate::quantity::Quantity;
use nalgebra::DMatrix;

/// Of an effect's size (where it rivals the spring): the step of the differences.
const DIFFERENCE: f64 = 1e-6;
/// wn, zeta, yaw angle and yaw rate at the first instant.
const PLAIN: usize = 4;
/// Cycles of the first, shortest fit.
const FIRST_CYCLES: f64 = 5.0;
const LONGER: f64 = 1.8;
const EVALUATIONS: usize = 30;
/// Evaluations after which a further start has to be this near, in the sum of squares, to the best one so far.
const SHORT: usize = 7;
const NEAR: f64 = 1.5;
/// Residual over noise below which no further start is tried.
const SURELY: f64 = 1.04;

/// Which effects a model holds and whether the sensor's nought is unknown.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Structure {
    pub effects: Vec<Effect>,
    pub zero_unknown: bool,
}

impl Structure {
    pub fn with(&self, effect: Effect) -> Self {
        let mut effects = self.effects.clone();
        effects.push(effect);
        Self { effects, ..self.clone() }
    }

    pub fn without(&self, effect: Effect) -> Self {
        let effects = self.effects.iter().copied().filter(|e| *e != effect).collect();
        Self { effects, ..self.clone() }
    }

    /// Where the numbers of each effect begin, and how many there are in all.
    fn layout(&self, swing: &Swing) -> (Vec<usize>, usize) {
        let mut at = PLAIN + usize::from(self.zero_unknown);
        let starts = self
            .effects
            .iter()
            .map(|e| {
                let begin = at;
                at += e.sizes(&swing.scale()).len();
                begin
            })
            .collect();
        (starts, at)
    }
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    pub structure: Structure,
    /// wn, zeta, yaw, rate, sensor's nought where unknown, then each effect's.
    pub parameters: Vec<f64>,
    pub sum_of_squares: f64,
    pub count: usize,
    pub converged: bool,
    pub covariance: Option<DMatrix<f64>>,
    /// Model less record, rad.
    pub residuals: Vec<f64>,
    /// Lag-one correlation of the residuals.
    pub correlation: f64,
    starts: Vec<usize>,
}

impl Fitted {
    pub fn rms_rad(&self) -> f64 {
        (self.sum_of_squares / self.degrees_of_freedom()).sqrt()
    }
    fn degrees_of_freedom(&self) -> f64 {
        self.count.saturating_sub(self.parameters.len()).max(1) as f64
    }
    pub fn over_noise(&self, swing: &Swing) -> f64 {
        self.rms_rad() / swing.noise_rad
    }
    /// Residuals that count as independent: (1 - c)/(1 + c) of them at lag-one correlation c.
    pub fn effective_count(&self) -> f64 {
        let c = self.correlation.clamp(0.0, 0.999);
        (self.count as f64 * (1.0 - c) / (1.0 + c)).max(2.0)
    }
    /// Variance inflation of the parameters by correlated residuals.
    fn inflation(&self) -> f64 {
        self.count as f64 / self.effective_count()
    }
    fn quantity(&self, index: usize) -> Quantity {
        let u = self
            .covariance
            .as_ref()
            .map_or(f64::NAN, |c| (c[(index, index)] * self.inflation()).max(0.0).sqrt());
        Quantity::new(self.parameters[index], u)
    }
    pub fn natural_frequency_rad_s(&self) -> Quantity {
        self.quantity(0)
    }
    pub fn damping_ratio(&self) -> Quantity {
        self.quantity(1)
    }
    /// `effect.name` and value of everything the effects are made of.
    pub fn effect_parameters(&self) -> Vec<(String, Quantity)> {
        let mut out = Vec::new();
        for (effect, &at) in self.structure.effects.iter().zip(&self.starts) {
            let varied = self.of_effect(*effect, at);
            let (values, rows) = effect.published(varied);
            for (i, parameter) in effect.parameters().iter().enumerate() {
                let variance = self.covariance.as_ref().map_or(f64::NAN, |c| {
                    let n = varied.len();
                    (0..n)
                        .flat_map(|a| (0..n).map(move |b| (a, b)))
                        .map(|(a, b)| rows[i][a] * rows[i][b] * c[(at + a, at + b)])
                        .sum::<f64>()
                });
                let u = (variance * self.inflation()).max(0.0).sqrt();
                out.push((format!("{effect}.{}", parameter.name), Quantity::new(values[i], u)));
            }
        }
        out
    }
    fn of_effect(&self, effect: Effect, at: usize) -> &[f64] {
        let n = effect.parameters().len();
        &self.parameters[at..at + n]
    }
    /// The numbers of `effect`, if it is in the model.
    pub fn varied(&self, effect: Effect) -> Option<&[f64]> {
        let k = self.structure.effects.iter().position(|e| *e == effect)?;
        Some(self.of_effect(effect, self.starts[k]))
    }
    /// Where the numbers of `effect`, which is in the model, begin.
    pub(super) fn start_of(&self, effect: Effect) -> usize {
        let k = self.structure.effects.iter().position(|e| *e == effect);
        self.starts[k.expect("an effect of the model")]
    }
    pub fn motion(&self) -> Motion {
        motion(&self.structure, &self.starts, &self.parameters).0
    }
    /// Readings of the model on `grid`, which begins where the swing does.
    pub fn readings(&self, grid: &Grid) -> Vec<f64> {
        let (motion, zero) = motion(&self.structure, &self.starts, &self.parameters);
        let mut y = vec![0.0; grid.count];
        motion.readings(grid, &mut y);
        y.iter_mut().for_each(|y| *y += zero);
        y
    }
}

fn motion(structure: &Structure, starts: &[usize], p: &[f64]) -> (Motion, f64) {
    let mut terms = Terms::default();
    for (effect, &at) in structure.effects.iter().zip(starts) {
        effect.write(&p[at..], &mut terms);
    }
    let motion = Motion {
        natural_frequency_rad_s: p[0],
        damping_ratio: p[1],
        yaw_rad: p[2],
        rate_rad_s: p[3],
        terms,
    };
    (motion, if structure.zero_unknown { p[PLAIN] } else { 0.0 })
}

/// Residuals of the first `count` means.
pub(super) struct SwingProblem<'a> {
    swing: &'a Swing,
    structure: &'a Structure,
    starts: Vec<usize>,
    bounds: Vec<(f64, f64)>,
    steps: Vec<f64>,
    count: usize,
}

impl<'a> SwingProblem<'a> {
    pub fn new(swing: &'a Swing, structure: &'a Structure, start: &[f64], count: usize) -> Self {
        let scale = swing.scale();
        let (starts, n) = structure.layout(swing);
        let wn = swing.frequency_rad_s;
        let mut bounds = vec![(0.2 * wn, 5.0 * wn), (-0.5, 0.7)];
        bounds.resize(
            PLAIN + usize::from(structure.zero_unknown),
            (f64::NEG_INFINITY, f64::INFINITY),
        );
        let a = scale.amplitude_rad;
        let mut sizes = vec![wn * 0.1, 1.0, a, wn * a];
        if structure.zero_unknown {
            sizes.push(a);
        }
        for (effect, &at) in structure.effects.iter().zip(&starts) {
            bounds.extend(effect.bounds(&start[at..], start[0]));
            sizes.extend(effect.sizes(&scale));
        }
        debug_assert_eq!(sizes.len(), n);
        let steps = sizes.iter().map(|s| DIFFERENCE * s).collect();
        Self { swing, structure, starts, bounds, steps, count }
    }

    fn grid(&self) -> Grid {
        Grid { count: self.count, ..self.swing.grid }
    }

    fn readings(&self, p: &[f64], out: &mut [f64]) {
        let (motion, zero) = motion(self.structure, &self.starts, p);
        motion.readings(&self.grid(), out);
        out.iter_mut().for_each(|y| *y += zero);
    }
}

impl Problem for SwingProblem<'_> {
    fn parameters(&self) -> usize {
        self.bounds.len()
    }

    fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
        let n = p.len();
        let at = |p: &[f64]| motion(self.structure, &self.starts, p);
        let (base, zero) = at(p);
        let mut motions = vec![base];
        let mut zeros = vec![zero];
        let mut steps = Vec::with_capacity(n);
        let mut q = p.to_vec();
        for j in 0..n {
            let (low, high) = self.bounds[j];
            if low == high {
                continue;
            }
            // Into the range of the parameter.
            let moved = p[j] + self.steps[j];
            q[j] = if moved <= high { moved } else { p[j] - self.steps[j] };
            steps.push((j, q[j] - p[j]));
            let (motion, zero) = at(&q);
            motions.push(motion);
            zeros.push(zero);
            q[j] = p[j];
        }
        let mut readings = vec![vec![0.0; self.count]; motions.len()];
        readings_of_all(&motions, &self.grid(), &mut readings);
        for (readings, zero) in readings.iter_mut().zip(&zeros).filter(|(_, zero)| **zero != 0.0) {
            readings.iter_mut().for_each(|y| *y += zero);
        }
        let mut moved = readings.split_off(1);
        let mut residuals = readings.swap_remove(0);
        let fixed = vec![0.0; if steps.len() < n { self.count } else { 0 }];
        for (column, (_, step)) in moved.iter_mut().zip(&steps) {
            let inverse = 1.0 / step;
            for (c, y) in column.iter_mut().zip(&residuals) {
                *c = (*c - y) * inverse;
            }
        }
        for (r, y) in residuals.iter_mut().zip(&self.swing.yaw_rad) {
            *r -= y;
        }
        let mut slices: Vec<&[f64]> = vec![&fixed; n];
        for (column, (j, _)) in moved.iter().zip(&steps) {
            slices[*j] = column;
        }
        rows.block(&residuals, &slices);
    }

    fn bounds(&self, index: usize) -> (f64, f64) {
        self.bounds[index]
    }
}

fn solve(swing: &Swing, structure: &Structure, start: &[f64], count: usize) -> Fit {
    solve_in(swing, structure, start, count, EVALUATIONS)
}

fn solve_in(
    swing: &Swing,
    structure: &Structure,
    start: &[f64],
    count: usize,
    max_evaluations: usize,
) -> Fit {
    let problem = SwingProblem::new(swing, structure, start, count);
    minimise(&problem, start, &Options { max_evaluations, tolerance: 0.01, damping: 1e-4 })
}

/// Fits from `start` over ever longer parts of the first `count` means.
fn lengthened(swing: &Swing, structure: &Structure, start: &[f64], count: usize) -> Fit {
    let mut p = start.to_vec();
    let mut cycles = FIRST_CYCLES;
    loop {
        let part = (cycles * swing.per_cycle()) as usize;
        let fit = solve(swing, structure, &p, part.min(count));
        if part >= count {
            return fit;
        }
        if fit.sum_of_squares.is_finite() {
            p = fit.parameters;
        }
        cycles *= LONGER;
    }
}

pub(super) fn finished(swing: &Swing, structure: &Structure, fit: Fit, count: usize) -> Fitted {
    let problem = SwingProblem::new(swing, structure, &fit.parameters, count);
    let mut residuals = vec![0.0; count];
    problem.readings(&fit.parameters, &mut residuals);
    for (r, y) in residuals.iter_mut().zip(&swing.yaw_rad) {
        *r -= y;
    }
    let lag: f64 = residuals.windows(2).map(|w| w[0] * w[1]).sum();
    let power: f64 = residuals.iter().map(|r| r * r).sum();
    Fitted {
        structure: structure.clone(),
        converged: fit.stop.is_minimum(),
        covariance: fit.covariance.ok(),
        sum_of_squares: fit.sum_of_squares,
        count,
        correlation: if power > 0.0 { lag / power } else { 0.0 },
        residuals,
        starts: problem.starts,
        parameters: fit.parameters,
    }
}

/// The plain model (with a free nought of the sensor if `zero_unknown`).
pub fn fit_plain(swing: &Swing, zero_unknown: bool, count: usize) -> Fitted {
    let structure = Structure { effects: Vec::new(), zero_unknown };
    let wn = swing.windows.first().map_or(swing.frequency_rad_s, |w| w.natural_frequency_rad_s);
    let zeta = swing.windows.first().map_or(0.01, |w| w.damping_ratio);
    let (b, r) = first_state(swing);
    let mut start = vec![wn, zeta, b, r];
    if zero_unknown {
        let middle = swing.yaw_rad.iter().sum::<f64>() / swing.yaw_rad.len() as f64;
        start[2] -= middle;
        start.push(middle);
    }
    let fit = lengthened(swing, &structure, &start, count);
    // The whole record's mean frequency, where the first cycles' leads to another count of cycles.
    let mut mean = start.clone();
    mean[0] = swing.windows.iter().map(|w| w.natural_frequency_rad_s).sum::<f64>()
        / swing.windows.len().max(1) as f64;
    mean[1] = swing.windows.iter().map(|w| w.damping_ratio).sum::<f64>()
        / swing.windows.len().max(1) as f64;
    let other = solve(swing, &structure, &mean, count);
    let fit = if other.sum_of_squares < fit.sum_of_squares { other } else { fit };
    finished(swing, &structure, fit, count)
}

/// Angle and rate at the first mean, from the first eighth of a cycle.
fn first_state(swing: &Swing) -> (f64, f64) {
    let n = ((swing.per_cycle() / 8.0) as usize).clamp(2, swing.yaw_rad.len());
    let y = &swing.yaw_rad[..n];
    (y[0], (y[n - 1] - y[0]) / ((n - 1) as f64 * swing.grid.step_s) * 0.5)
}

/// `inner` with `effect` added, never worse than `inner`: started from it with the effect at nought, over lengthening
/// horizons, and from small sizes of either sign, until a start explains the swing.
pub fn fit_added(swing: &Swing, inner: &Fitted, effect: Effect) -> Fitted {
    let structure = inner.structure.with(effect);
    let count = inner.count;
    let enough = (SURELY * swing.noise_rad).powi(2) * count as f64;
    let mut best: Option<Fit> = None;
    let starts = super::starts::of(swing, inner, effect);
    for (k, start) in starts.iter().enumerate() {
        let mut p = inner.parameters.clone();
        p.extend(start);
        let mut fits = vec![];
        if k == 0 {
            fits.push(solve(swing, &structure, &p, count));
            if fits[0].sum_of_squares > enough {
                fits.push(lengthened(swing, &structure, &p, count));
            }
        } else {
            // A start that has not come near the best by now is not going to win.
            let short = solve_in(swing, &structure, &p, count, SHORT);
            let reached = best.as_ref().map_or(f64::INFINITY, |b| b.sum_of_squares);
            if short.sum_of_squares < NEAR * reached && short.evaluations >= SHORT {
                fits.push(solve(swing, &structure, &short.parameters, count));
            }
            fits.push(short);
        }
        for fit in fits {
            if best.as_ref().is_none_or(|b| fit.sum_of_squares < b.sum_of_squares) {
                best = Some(fit);
            }
        }
        if best.as_ref().is_some_and(|b| b.sum_of_squares <= enough && b.stop.is_minimum()) {
            break;
        }
    }
    let fit = best.expect("a start for every effect");
    let nested = fit.sum_of_squares <= inner.sum_of_squares * (1.0 + 1e-9);
    let mut fitted = finished(swing, &structure, fit, count);
    fitted.converged &= nested;
    fitted
}

/// What one linear step would leave of `inner`'s sum of squares with `effect` added, and how many numbers it takes.
/// Exact near the minimum, which is where it decides; elsewhere it orders.
pub fn promise(swing: &Swing, inner: &Fitted, effect: Effect) -> (f64, usize) {
    let structure = inner.structure.with(effect);
    let n = inner.parameters.len();
    let mut best = (inner.sum_of_squares, 1);
    for start in super::starts::of(swing, inner, effect) {
        // From nought, where the model is that of `inner`; a frequency is tried where the residual has its lines.
        if start[0] != 0.0 {
            continue;
        }
        let mut p = inner.parameters.clone();
        p.extend(&start);
        let problem = SwingProblem::new(swing, &structure, &p, inner.count);
        let mut normal = Normal::new(p.len());
        problem.evaluate(&p, &mut normal);
        let (a, g) = (normal.matrix(), normal.gradient());
        let only_up = problem.bounds[n].0 == 0.0;
        let used: Vec<usize> = (0..p.len()).filter(|&i| i < n || a[(i, i)] > 0.0).collect();
        let solve = |used: &[usize]| {
            let mut part = DMatrix::from_fn(used.len(), used.len(), |i, j| a[(used[i], used[j])]);
            let diagonal: Vec<f64> = (0..used.len()).map(|i| part[(i, i)]).collect();
            for (i, d) in diagonal.iter().enumerate() {
                part[(i, i)] = d * (1.0 + 1e-10);
            }
            let g = nalgebra::DVector::from_iterator(used.len(), used.iter().map(|&i| g[i]));
            nalgebra::Cholesky::new(part).map(|c| {
                let step = c.solve(&g);
                (step.dot(&g), step)
            })
        };
        if let Some((gain, step)) = solve(&used) {
            let inward = !only_up || used.len() <= n || -step[n] > 0.0;
            let left = (inner.sum_of_squares - gain).max(0.0);
            if inward && left < best.0 {
                best = (left, used.len() - n);
            }
        }
    }
    best
}

/// `model` fitted again to the first `count` means, from its own values.
pub fn refit(swing: &Swing, model: &Fitted, count: usize) -> Fitted {
    let direct = solve(swing, &model.structure, &model.parameters, count);
    finished(swing, &model.structure, direct, count)
}

/// A model of `structure` fitted from `start`.
pub(super) fn from_start(swing: &Swing, structure: &Structure, start: &[f64]) -> Fitted {
    let count = swing.yaw_rad.len();
    finished(swing, structure, solve(swing, structure, start, count), count)
}

/// `model` with its effects in another order, its values kept and fitted once more.
pub fn reordered(swing: &Swing, model: &Fitted, effects: &[Effect]) -> Fitted {
    let structure = Structure { effects: effects.to_vec(), ..model.structure.clone() };
    let mut p = model.parameters[..PLAIN + usize::from(structure.zero_unknown)].to_vec();
    for effect in effects {
        p.extend(model.varied(*effect).expect("an effect of the model"));
    }
    finished(swing, &structure, solve(swing, &structure, &p, model.count), model.count)
}

/// `model` less `effect`, fitted from what is left of its values.
pub fn fit_removed(swing: &Swing, model: &Fitted, effect: Effect) -> Fitted {
    let structure = model.structure.without(effect);
    let mut p = model.parameters[..PLAIN + usize::from(structure.zero_unknown)].to_vec();
    for other in &structure.effects {
        p.extend(model.varied(*other).expect("an effect of the model"));
    }
    let direct = solve(swing, &structure, &p, model.count);
    let longer = lengthened(swing, &structure, &p, model.count);
    let fit = if longer.sum_of_squares < direct.sum_of_squares { longer } else { direct };
    finished(swing, &structure, fit, model.count)
}

/// Residual over noise on the means after the first `count`, the model having been fitted to those only.
pub fn held_out_over_noise(swing: &Swing, model: &Fitted) -> f64 {
    let y = model.readings(&swing.grid);
    let later = model.count..swing.yaw_rad.len();
    let n = later.len().max(1) as f64;
    let sum: f64 = later.map(|k| (y[k] - swing.yaw_rad[k]).powi(2)).sum();
    (sum / n).sqrt() / swing.noise_rad
}
