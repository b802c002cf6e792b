//! A model fitted to pieces of a free decay, each with an initial condition of its own.
//!
//! Single shooting over a long record has as many minima as the record has cycles; over a few cycles with a free
//! state it has one. Natural frequency, damping ratio, rest angle and effects are common to all pieces; the states are
//! eliminated from the normal equations piece by piece (the structure of multiple shooting: H. G. Bock, 1983), so that
//! a fit costs what single shooting costs. From short pieces one goes to longer ones, and to the whole record.

use crate::fit::free_decay::FreeDecay;
use crate::fit::problem::{problem_of_one, JointProblem, Release};
use crate::fit::structure::{motion, Structure};
use crate::motion::simulate::readings_of_all;
use crate::solver::{Normal, Rows};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix2, Vector2};
use rayon::prelude::*;
use std::ops::Range;

/// Gain of a step, as a share of the sum of squares, below which a fit is at its minimum.
const SETTLED: f64 = 1e-6;
/// The same where a fit is only a start for the next.
pub(crate) const ROUGH: f64 = 1e-3;
/// Steps of a fit to longer pieces; it is continued at the next level.
pub(crate) const STEPS: usize = 40;
/// Share of a cycle from which a piece's first state is estimated.
const BEGINNING: f64 = 0.15;
/// Step of the differences by which a state is fitted, as a share of the amplitude.
const DIFFERENCE: f64 = 1e-6;

/// Consecutive pieces of a free decay.
pub(crate) struct Pieces {
    pub decays: Vec<FreeDecay>,
}

impl Pieces {
    /// `count` pieces of the same length.
    pub(crate) fn of(decay: &FreeDecay, count: usize) -> Self {
        let n = decay.yaw_rad.len();
        let edge = |k: usize| k * n / count;
        Self::with(decay, (0..count).map(|k| edge(k)..edge(k + 1)).collect())
    }

    /// Pieces of about `cycles` each.
    pub(crate) fn of_cycles(decay: &FreeDecay, cycles: f64) -> Self {
        let all = decay.yaw_rad.len() as f64 / decay.per_cycle();
        Self::of(decay, ((all / cycles).floor() as usize).max(1))
    }

    fn with(decay: &FreeDecay, ranges: Vec<Range<usize>>) -> Self {
        let piece = |range: &Range<usize>| FreeDecay {
            grid: crate::motion::simulate::Grid {
                start_s: decay.grid.time_s(range.start),
                count: range.len(),
                ..decay.grid
            },
            yaw_rad: decay.yaw_rad[range.clone()].to_vec(),
            windows: Vec::new(),
            colour: decay.colour,
            ..decay.clone()
        };
        Self { decays: ranges.iter().map(piece).collect() }
    }

    pub(crate) fn count(&self) -> usize {
        self.decays.len()
    }
}

/// A model on pieces: what they have in common, and the state of each at its first instant.
#[derive(Clone, Debug)]
pub struct PieceFit {
    pub structure: Structure,
    /// wn, zeta, the rest angle where it is free, then each effect's numbers.
    pub common: Vec<f64>,
    pub states: Vec<[f64; 2]>,
    /// Sum of squares of each piece, rad2.
    pub squares: Vec<f64>,
    pub converged: bool,
}

impl PieceFit {
    pub fn sum(&self) -> f64 {
        self.squares.iter().sum()
    }

    /// Numbers in the order of [`crate::fit::fitting::Fitted`].
    pub fn numbers(&self, piece: usize) -> Vec<f64> {
        numbers(&self.common, self.states[piece])
    }

    /// Where in `common` the numbers of the structure's `k`th effect begin.
    pub fn start_of(&self, k: usize) -> usize {
        self.structure.starts()[k] - 2
    }
}

/// Numbers in the order of [`crate::fit::fitting::Fitted`].
pub(crate) fn numbers(common: &[f64], state: [f64; 2]) -> Vec<f64> {
    let mut p = common[..2].to_vec();
    p.extend(state);
    p.extend(&common[2..]);
    p
}

/// Angle and rate at the beginning of a piece from a cubic through its first means, `zero` taken off.
pub(crate) fn first_state(piece: &FreeDecay, zero: f64) -> [f64; 2] {
    let n = ((BEGINNING * piece.per_cycle()) as usize).clamp(4, 60).min(piece.yaw_rad.len());
    let h = 1.0 / n as f64;
    let a = DMatrix::from_fn(n, 4.min(n), |k, j| (k as f64 * h).powi(j as i32));
    let y = DVector::from_fn(n, |k, _| piece.yaw_rad[k] - zero);
    let fit = (a.transpose() * &a).cholesky().map(|c| c.solve(&(a.transpose() * y)));
    fit.map_or([piece.yaw_rad[0] - zero, 0.0], |c| [c[0], c[1] * h / piece.grid.step_s])
}

/// The state of `piece` that fits best under given common numbers, and its sum of squares (rad2).
pub(crate) fn fit_state(
    piece: &FreeDecay,
    structure: &Structure,
    common: &[f64],
    start: [f64; 2],
) -> ([f64; 2], f64) {
    let starts = structure.starts();
    let steps = [DIFFERENCE * piece.amplitude_rad, DIFFERENCE * piece.amplitude_rad * common[0]];
    let mut readings = vec![vec![0.0; piece.grid.count]; 3];
    let mut at = |x: [f64; 2]| {
        let moved = [x, [x[0] + steps[0], x[1]], [x[0], x[1] + steps[1]]];
        let mut zero = 0.0;
        let motions = moved.map(|x| {
            let (m, z) = motion(structure, &starts, &numbers(common, x), piece.wind_speed_m_s);
            zero = z;
            m
        });
        readings_of_all(&motions, &piece.grid, &mut readings);
        let (mut h, mut g, mut s) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        for (k, y) in piece.yaw_rad.iter().enumerate() {
            let e = readings[0][k] + zero - y;
            let d = Vector2::new(
                (readings[1][k] - readings[0][k]) / steps[0],
                (readings[2][k] - readings[0][k]) / steps[1],
            );
            s += e * e;
            g += d * e;
            h += d * d.transpose();
        }
        (h, g, s)
    };
    let mut best = start;
    let (mut h, mut g, mut s) = at(best);
    let mut damping = 1e-6;
    for _ in 0..25 {
        if !s.is_finite() {
            return (best, f64::INFINITY);
        }
        let damped = Matrix2::new(
            h[(0, 0)] * (1.0 + damping),
            h[(0, 1)],
            h[(1, 0)],
            h[(1, 1)] * (1.0 + damping),
        );
        let Some(step) = damped.try_inverse().map(|i| i * g) else { break };
        let trial = [best[0] - step[0], best[1] - step[1]];
        let there = at(trial);
        if there.2 < s {
            let gain = s - there.2;
            (best, h, g, s) = (trial, there.0, there.1, there.2);
            damping *= 0.1;
            if gain < SETTLED * s {
                break;
            }
        } else {
            if step.dot(&g) < SETTLED * s {
                break;
            }
            damping = (damping * 10.0).max(1e-4);
        }
    }
    (best, s)
}

/// A piece's residuals over the noise as sums, over common numbers and state.
struct Sums {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
    /// Of `squares`, what the record misses; the rest keeps a law smooth.
    misfit: f64,
}

/// A fit to some of the pieces.
struct Fit<'a> {
    problems: Vec<JointProblem<'a>>,
    /// Of the common numbers, those that are not fixed, and all bounds.
    free: Vec<usize>,
    bounds: Vec<(f64, f64)>,
}

fn common_place(j: usize) -> Option<usize> {
    match j {
        0 | 1 => Some(j),
        2 | 3 => None,
        _ => Some(j - 2),
    }
}

impl<'a> Fit<'a> {
    fn new(pieces: &'a [&'a FreeDecay], structure: &Structure, common: &[f64]) -> Self {
        let start = numbers(common, [0.0, 0.0]);
        let problems: Vec<JointProblem> = pieces
            .iter()
            .map(|decay| problem_of_one(Release::whole(decay), structure, &start))
            .collect();
        let part = &problems[0].parts[0];
        let bounds = (0..start.len()).filter(|j| !(2..4).contains(j)).map(|j| part.bounds[j]);
        let bounds: Vec<(f64, f64)> = bounds.collect();
        let free = part.free.iter().filter_map(|&j| common_place(j)).collect();
        Self { problems, free, bounds }
    }

    fn is_stopped(&self) -> bool {
        self.problems[0].parts[0].release.decay.stop.is_requested()
    }

    fn sums(&self, common: &[f64], states: &[[f64; 2]]) -> Option<Vec<Sums>> {
        if self.is_stopped() {
            return None;
        }
        let sums: Vec<Sums> = self
            .problems
            .par_iter()
            .zip(states)
            .map(|(problem, state)| {
                let part = &problem.parts[0];
                let (residuals, columns) = part.linearised(&numbers(common, *state));
                // State last.
                let order = |j: usize| match j {
                    2 => self.free.len(),
                    3 => self.free.len() + 1,
                    _ => self.free.iter().position(|&i| Some(i) == common_place(j)).unwrap_or(0),
                };
                let mut which: Vec<(usize, &[f64])> = part
                    .free
                    .iter()
                    .zip(&columns)
                    .map(|(&j, c)| (order(j), c.as_slice()))
                    .collect();
                which.sort_by_key(|w| w.0);
                let mut normal = Normal::new(self.free.len() + 2);
                let places: Vec<usize> = which.iter().map(|w| w.0).collect();
                let columns: Vec<&[f64]> = which.iter().map(|w| w.1).collect();
                normal.part(&residuals, &places, &columns);
                Sums {
                    matrix: normal.matrix(),
                    gradient: normal.gradient(),
                    squares: normal.sum_of_squares(),
                    misfit: residuals[..part.release.count].iter().map(|r| r * r).sum(),
                }
            })
            .collect();
        let finite = |s: &Sums| {
            s.squares.is_finite() && s.matrix.iter().chain(&s.gradient).all(|x| x.is_finite())
        };
        sums.iter().all(finite).then_some(sums)
    }

    /// Matrix and gradient of the common numbers with the states eliminated, and what gives the states' steps.
    fn reduced(&self, sums: &[Sums], damping: f64) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.free.len();
        let mut a = DMatrix::zeros(n, n);
        let mut g = DVector::zeros(n);
        for s in sums {
            let inverse = inverse_of_state(s, n, damping);
            let c = s.matrix.view((0, n), (n, 2)).into_owned();
            a += s.matrix.view((0, 0), (n, n)) - &c * inverse * c.transpose();
            g += s.gradient.rows(0, n) - &c * (inverse * s.gradient.rows(n, 2));
        }
        (a, g)
    }
}

fn inverse_of_state(s: &Sums, n: usize, damping: f64) -> Matrix2<f64> {
    let mut m = Matrix2::new(
        s.matrix[(n, n)],
        s.matrix[(n, n + 1)],
        s.matrix[(n + 1, n)],
        s.matrix[(n + 1, n + 1)],
    );
    m[(0, 0)] *= 1.0 + damping;
    m[(1, 1)] *= 1.0 + damping;
    m.try_inverse().unwrap_or_else(Matrix2::zeros)
}

/// The damped step down a quadratic of this `matrix` and `gradient` that keeps within `bounds` of each part: what would
/// pass a bound stays at it, and the others step as suits that.
pub(crate) fn step_within(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
    bounds: &dyn Fn(usize) -> (f64, f64),
) -> Option<DVector<f64>> {
    let n = gradient.len();
    let at_bound = |k: usize| {
        let (low, high) = bounds(k);
        (low >= 0.0 && gradient[k] > 0.0 || high <= 0.0 && gradient[k] < 0.0).then_some(0.0)
    };
    let mut held: Vec<Option<f64>> = (0..n).map(at_bound).collect();
    loop {
        let open: Vec<usize> = (0..n).filter(|&k| held[k].is_none()).collect();
        let mut step = DVector::from_fn(n, |k, _| held[k].unwrap_or(0.0));
        let mut m = matrix.select_rows(&open).select_columns(&open);
        for (i, &k) in open.iter().enumerate() {
            m[(i, i)] += damping * matrix[(k, k)].max(1e-30) + 1e-12 * matrix[(k, k)];
        }
        let right = (gradient + matrix * &step).select_rows(&open);
        let part = Cholesky::new(m)?.solve(&right);
        open.iter().zip(part.iter()).for_each(|(&k, x)| step[k] = -x);
        let mut passed = false;
        for &k in &open {
            let (low, high) = bounds(k);
            if step[k] < low || step[k] > high {
                held[k] = Some(step[k].clamp(low.min(0.0), high.max(0.0)));
                passed = true;
            }
        }
        if !passed {
            return Some(step);
        }
    }
}

/// Fits `structure` to `pieces` from given common numbers and states; `settled` is the relative gain at which it ends.
pub(crate) fn fit_pieces(
    pieces: &[&FreeDecay],
    structure: &Structure,
    common: &[f64],
    states: &[[f64; 2]],
    settled: f64,
    most: usize,
) -> PieceFit {
    let fit = Fit::new(pieces, structure, common);
    let noise = pieces[0].noise_rad.powi(2);
    let mut common: Vec<f64> =
        common.iter().zip(&fit.bounds).map(|(x, (low, high))| x.max(*low).min(*high)).collect();
    let mut states = states.to_vec();
    let mut out = PieceFit {
        structure: structure.clone(),
        common: common.clone(),
        states: states.clone(),
        squares: vec![f64::INFINITY; pieces.len()],
        converged: false,
    };
    let Some(mut here) = fit.sums(&common, &states) else { return out };
    let total = |sums: &[Sums]| sums.iter().map(|s| s.squares).sum::<f64>();
    let n = fit.free.len();
    let (mut damping, mut growth) = (1e-4, 2.0);
    let mut converged = false;
    'steps: for _ in 0..most {
        let squares = total(&here);
        loop {
            let (a, g) = fit.reduced(&here, damping);
            let Some(moved) = step_within(&a, &g, damping, &|k| {
                let (low, high) = fit.bounds[fit.free[k]];
                (low - common[fit.free[k]], high - common[fit.free[k]])
            }) else {
                damping = (damping * 10.0).max(1e-6);
                if damping > 1e8 {
                    break 'steps;
                }
                continue;
            };
            let mut trial = common.clone();
            for (k, by) in moved.iter().enumerate() {
                trial[fit.free[k]] += by;
            }
            let mut predicted = 0.0;
            let there: Vec<[f64; 2]> = here
                .iter()
                .zip(&states)
                .map(|(s, x)| {
                    let c = s.matrix.view((0, n), (n, 2));
                    let right = s.gradient.rows(n, 2) + c.transpose() * &moved;
                    let d = inverse_of_state(s, n, damping) * &right;
                    predicted += d.dot(&s.gradient.rows(n, 2));
                    [x[0] - d[0], x[1] - d[1]]
                })
                .collect();
            predicted -= moved.dot(
                &here
                    .iter()
                    .fold(DVector::zeros(n), |sum: DVector<f64>, s| sum + s.gradient.rows(0, n)),
            );
            let next = fit.sums(&trial, &there);
            let gained = next.as_ref().map_or(f64::NEG_INFINITY, |s| squares - total(s));
            if gained > 0.0 {
                here = next.expect("gained");
                (common, states) = (trial, there);
                damping = (damping * if gained > 0.5 * predicted { 0.1 } else { 0.5 }).max(1e-12);
                growth = 2.0;
                if gained < settled * squares {
                    converged = true;
                    break 'steps;
                }
                break;
            }
            if predicted.abs() < settled * squares || fit.is_stopped() {
                converged = !fit.is_stopped();
                break 'steps;
            }
            damping = (damping * growth).max(1e-6);
            growth *= 2.0;
            if damping > 1e10 {
                converged = true;
                break 'steps;
            }
        }
    }
    out.squares = here.iter().map(|s| s.misfit * noise).collect();
    (out.common, out.states, out.converged) = (common, states, converged);
    out
}

/// A piece's sum of squares over the noise as a quadratic of the free shared parameters, its state eliminated.
pub(crate) struct Quadratic {
    pub matrix: DMatrix<f64>,
    /// Half the slope.
    pub gradient: DVector<f64>,
    pub squares: f64,
}

/// The quadratics of all pieces at `common`; which of the shared parameters are free; and the bounds of all.
pub(crate) type Quadratics = (Vec<Quadratic>, Vec<usize>, Vec<(f64, f64)>);

/// `None` where the model has no course there.
pub(crate) fn quadratics(
    pieces: &[&FreeDecay],
    structure: &Structure,
    common: &[f64],
    states: &[[f64; 2]],
) -> Option<Quadratics> {
    let fit = Fit::new(pieces, structure, common);
    let n = fit.free.len();
    let each = |s: &Sums| {
        let (matrix, gradient) = fit.reduced(std::slice::from_ref(s), 0.0);
        let of_state = s.gradient.rows(n, 2);
        let gained = (of_state.transpose() * inverse_of_state(s, n, 0.0) * of_state)[(0, 0)];
        Quadratic { matrix, gradient, squares: s.squares - gained }
    };
    let all = fit.sums(common, states)?.iter().map(each).collect();
    Some((all, fit.free, fit.bounds))
}

/// Fits to `pieces` from common numbers alone: the states from the record's own beginnings.
pub(crate) fn fit_from(
    pieces: &Pieces,
    structure: &Structure,
    common: &[f64],
    settled: f64,
) -> PieceFit {
    let zero = if structure.zero_unknown { common[2] } else { 0.0 };
    let states: Vec<[f64; 2]> = pieces
        .decays
        .par_iter()
        .map(|piece| fit_state(piece, structure, common, first_state(piece, zero)).0)
        .collect();
    let all: Vec<&FreeDecay> = pieces.decays.iter().collect();
    fit_pieces(&all, structure, common, &states, settled, STEPS)
}
