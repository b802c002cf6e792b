//! A model fitted to pieces of a free decay, each with an initial condition of its own.
//!
//! Single shooting over a long record has as many minima as the record has cycles; over a few cycles with a
//! free state it has one. Natural frequency, damping ratio, rest angle and effects are common to all pieces;
//! the states are eliminated from the normal equations piece by piece (the structure of multiple shooting: H.
//! G. Bock, 1983), so that a fit costs what single shooting costs. From short pieces one goes to longer ones,
//! and to the whole record.

use crate::at_once::AtOnce;
use crate::effects::{Effect, LANES};
use crate::fit::pieces::{damped, Own, Piece, Pieces};
use crate::fit::problem::{problem_of_one, JointProblem, Release};
use crate::fit::structure::Structure;
use crate::solver::{step_within, Normal, Rows};
use nalgebra::{DMatrix, DVector, Matrix2};

/// Gain of a step, as a share of the sum of squares, below which a fit that is only a start for the next has
/// settled.
pub(crate) const ROUGH: f64 = 1e-3;
/// The same of one whose numbers models are compared by.
pub(crate) const SETTLED: f64 = 1e-4;
/// The same of one to the whole, or of a law.
pub(crate) const FINE: f64 = 1e-5;
/// Steps of a fit to longer pieces; it is continued at the next level.
pub(crate) const STEPS: usize = 40;
/// Steps of a fit from one of several starts, the best of which is gone on with.
pub(crate) const FIRST_STEPS: usize = 6;

/// A model on pieces: what they have in common, and the state of each at its first instant.
#[derive(Clone, Debug)]
pub(crate) struct PieceFit {
    pub(crate) structure: Structure,
    /// wn, zeta, the rest angle where it is free, those of further releases, then each effect's numbers.
    pub(crate) common: Vec<f64>,
    /// Of each piece.
    pub(crate) own: Vec<Own>,
    pub(crate) states: Vec<[f64; 2]>,
    /// Sum of squares of each piece, rad2.
    pub(crate) squares: Vec<f64>,
    pub(crate) converged: bool,
}

impl PieceFit {
    pub(crate) fn sum(&self) -> f64 {
        self.squares.iter().sum()
    }

    /// Numbers in the order of [`crate::fit::fitting::Fitted`].
    pub(crate) fn numbers(&self, piece: usize) -> Vec<f64> {
        self.own[piece].numbers(&self.structure, &self.common, self.states[piece])
    }

    /// Where in `common` the numbers of `effect`, which is in the structure, begin.
    pub(crate) fn start_of(&self, effect: &Effect) -> usize {
        self.structure.place(effect).expect("an effect of the model") - 2 + self.more()
    }

    /// How many numbers belong to releases beyond the first.
    pub(crate) fn more(&self) -> usize {
        self.own[0].more
    }
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
    pieces: &'a [&'a Piece],
    /// Of the common numbers, those that are not fixed, and all bounds.
    free: Vec<usize>,
    bounds: Vec<(f64, f64)>,
}

impl<'a> Fit<'a> {
    fn new(pieces: &'a [&'a Piece], structure: &Structure, common: &[f64]) -> Self {
        let mut bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); common.len()];
        let mut is_free = vec![false; common.len()];
        let problem = |piece: &&'a Piece| {
            let start = piece.own.numbers(structure, common, [0.0, 0.0]);
            let problem = problem_of_one(Release::whole(piece), structure, &start);
            let part = &problem.parts[0];
            for (j, bound) in part.bounds.iter().enumerate() {
                let Some(at) = piece.own.place(j, structure) else { continue };
                let is_free_here = part.free.contains(&j);
                // Of pieces in several winds a number is held by those alone in which it does something.
                if is_free_here || !is_free[at] {
                    bounds[at] = *bound;
                }
                is_free[at] |= is_free_here;
            }
            problem
        };
        let problems = pieces.iter().map(problem).collect();
        let free = (0..common.len()).filter(|&j| is_free[j]).collect();
        Self { problems, pieces, free, bounds }
    }

    fn is_stopped(&self) -> bool {
        self.problems[0].parts[0].release.decay.stop.is_requested()
    }

    fn sums(&self, common: &[f64], states: &[[f64; 2]]) -> Option<Vec<Sums>> {
        let sums = self
            .problems
            .iter()
            .zip(self.pieces)
            .zip(states)
            .map_at_once(|((problem, piece), state)| {
                if self.is_stopped() {
                    return None;
                }
                let part = &problem.parts[0];
                let numbers = piece.own.numbers(&part.structure, common, *state);
                let (residuals, columns) = part.linearised(&numbers);
                // State last.
                let place = |&j: &usize| match piece.own.place(j, &part.structure) {
                    None => self.free.len() + j - 2,
                    place => self.free.iter().position(|&i| Some(i) == place).unwrap_or(0),
                };
                let places: Vec<usize> = part.free.iter().map(place).collect();
                let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
                let mut normal = Normal::new(self.free.len() + 2);
                normal.part(&residuals, &places, &columns);
                Some(Sums {
                    matrix: normal.matrix(),
                    gradient: normal.gradient(),
                    squares: normal.sum_of_squares(),
                    misfit: residuals[..part.release.count].iter().map(|r| r * r).sum(),
                })
            })
            .collect::<Option<Vec<Sums>>>()?;
        let finite = |s: &Sums| {
            s.squares.is_finite() && s.matrix.iter().chain(&s.gradient).all(|x| x.is_finite())
        };
        sums.iter().all(finite).then_some(sums)
    }

    /// Whether derivatives cost so much more than residuals that these are asked first whether a step gains,
    /// and whether it is the last.
    fn is_wide(&self) -> bool {
        self.free.len() > 2 * LANES
    }

    /// Each piece's squares alone, and of them the misfit; no numbers where the model has no course there,
    /// or stopped.
    fn squares(&self, common: &[f64], states: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let each = self.problems.iter().zip(self.pieces).zip(states);
        let squares = each.map_at_once(|((problem, piece), state)| {
            if self.is_stopped() {
                return [f64::NAN; 2];
            }
            let part = &problem.parts[0];
            let numbers = piece.own.numbers(&part.structure, common, *state);
            let (residuals, _) = part.linearised_by(&numbers, &[]);
            let sum = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
            [sum(&residuals), sum(&residuals[..part.release.count])]
        });
        squares.collect()
    }

    /// Matrix and gradient of the common numbers with the states eliminated, and what gives the states'
    /// steps.
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

    /// The step from common numbers and states at which the sums are those; none where the damping is too
    /// small for one.
    fn step(
        &self,
        here: &[Sums],
        common: &[f64],
        states: &[[f64; 2]],
        damping: f64,
    ) -> Option<Step> {
        let n = self.free.len();
        let (mut damped, g) = self.reduced(here, damping);
        for k in 0..n {
            let own = damped[(k, k)];
            // A little of it keeps the matrix definite.
            damped[(k, k)] += damping * own.max(1e-30) + 1e-12 * own;
        }
        let moved = step_within(&damped, &g, &|k| {
            let (low, high) = self.bounds[self.free[k]];
            (low - common[self.free[k]], high - common[self.free[k]])
        })?;
        let mut to = common.to_vec();
        for (k, by) in moved.iter().enumerate() {
            to[self.free[k]] += by;
        }
        let mut predicted = 0.0;
        let state = |(s, x): (&Sums, &[f64; 2])| {
            let c = s.matrix.view((0, n), (n, 2));
            let right = s.gradient.rows(n, 2) + c.transpose() * &moved;
            let d = inverse_of_state(s, n, damping) * &right;
            predicted += d.dot(&s.gradient.rows(n, 2));
            [x[0] - d[0], x[1] - d[1]]
        };
        let states = here.iter().zip(states).map(state).collect();
        let slopes = here.iter().map(|s| s.gradient.rows(0, n));
        predicted -= moved.dot(&slopes.fold(DVector::zeros(n), |sum: DVector<f64>, s| sum + s));
        Some(Step { common: to, states, predicted })
    }
}

/// A step of a fit, and by how much the squares fall with it if all is linear.
struct Step {
    common: Vec<f64>,
    states: Vec<[f64; 2]>,
    predicted: f64,
}

fn inverse_of_state(s: &Sums, n: usize, damping: f64) -> Matrix2<f64> {
    let own = s.matrix.fixed_view::<2, 2>(n, n).into_owned();
    damped(own, damping).try_inverse().unwrap_or_else(Matrix2::zeros)
}

/// Fits `structure` to `pieces` from given common numbers and states; `settled` is the relative gain at which
/// it ends.
pub(crate) fn fit_pieces(
    pieces: &[&Piece],
    structure: &Structure,
    common: &[f64],
    states: &[[f64; 2]],
    settled: f64,
    most: usize,
) -> PieceFit {
    let fit = Fit::new(pieces, structure, common);
    let inside = |(x, (low, high)): (&f64, &(f64, f64))| x.max(*low).min(*high);
    let mut out = PieceFit {
        structure: structure.clone(),
        common: common.iter().zip(&fit.bounds).map(inside).collect(),
        own: pieces.iter().map(|piece| piece.own).collect(),
        states: states.to_vec(),
        squares: vec![f64::INFINITY; pieces.len()],
        converged: false,
    };
    let Some(mut here) = fit.sums(&out.common, &out.states) else { return out };
    let mut misfit: Vec<f64> = here.iter().map(|s| s.misfit).collect();
    let total = |sums: &[Sums]| sums.iter().map(|s| s.squares).sum::<f64>();
    let (mut damping, mut growth) = (1e-4, 2.0);
    'steps: for _ in 0..most {
        let squares = total(&here);
        loop {
            let Some(Step { common: trial, states: there, predicted }) =
                fit.step(&here, &out.common, &out.states, damping)
            else {
                damping = (damping * 10.0).max(1e-6);
                if damping > 1e8 {
                    break 'steps;
                }
                continue;
            };
            let left = if fit.is_wide() { fit.squares(&trial, &there) } else { Vec::new() };
            let ahead = match fit.is_wide() {
                true => squares - left.iter().map(|s| s[0]).sum::<f64>(),
                false => f64::INFINITY,
            };
            if ahead > 0.0 && ahead < settled * squares {
                misfit = left.iter().map(|s| s[1]).collect();
                (out.common, out.states, out.converged) = (trial, there, true);
                break 'steps;
            }
            let next = (ahead > 0.0).then(|| fit.sums(&trial, &there)).flatten();
            let gained = next.as_ref().map_or(f64::NEG_INFINITY, |s| squares - total(s));
            if gained > 0.0 {
                here = next.expect("gained");
                misfit = here.iter().map(|s| s.misfit).collect();
                (out.common, out.states) = (trial, there);
                damping = (damping * if gained > 0.5 * predicted { 0.1 } else { 0.5 }).max(1e-12);
                growth = 2.0;
                if gained < settled * squares {
                    out.converged = true;
                    break 'steps;
                }
                break;
            }
            if predicted.abs() < settled * squares || fit.is_stopped() {
                out.converged = !fit.is_stopped();
                break 'steps;
            }
            damping = (damping * growth).max(1e-6);
            growth *= 2.0;
            if damping > 1e10 {
                out.converged = true;
                break 'steps;
            }
        }
    }
    let squares = misfit.iter().zip(pieces).map(|(m, piece)| m * piece.noise_rad.powi(2));
    out.squares = squares.collect();
    out
}

/// A piece's sum of squares over the noise as a quadratic of the free shared parameters, its state
/// eliminated.
pub(crate) struct Quadratic {
    pub(crate) matrix: DMatrix<f64>,
    /// Half the slope.
    pub(crate) gradient: DVector<f64>,
    pub(crate) squares: f64,
}

/// The quadratics of all pieces at `common`; which of the shared parameters are free; and the bounds of all.
pub(crate) type Quadratics = (Vec<Quadratic>, Vec<usize>, Vec<(f64, f64)>);

/// `None` where the model has no course there.
pub(crate) fn quadratics(
    pieces: &[&Piece],
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
    begun(pieces, structure, common, settled, STEPS)
}

/// As [`fit_from`], the first steps, which tell what is worth going on with.
pub(crate) fn fit_towards(pieces: &Pieces, structure: &Structure, common: &[f64]) -> PieceFit {
    begun(pieces, structure, common, ROUGH, FIRST_STEPS)
}

fn begun(
    pieces: &Pieces,
    structure: &Structure,
    common: &[f64],
    settled: f64,
    steps: usize,
) -> PieceFit {
    let all: Vec<&Piece> = pieces.decays.iter().collect();
    fit_pieces(&all, structure, common, &pieces.states(structure, common), settled, steps)
}
