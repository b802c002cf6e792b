//! A model fitted to pieces of a free decay, each with an initial condition of its own.
//!
//! Single shooting over a long record has as many minima as the record has cycles; over a few cycles with a
//! free state it has one. Natural frequency, damping ratio, rest angle and effects are common to all pieces;
//! the states are eliminated piece by piece ([`crate::solver::blocks`]), so that a fit costs what single shooting
//! costs. From short pieces one goes to longer ones, and to the whole record.

use crate::effects::{Effect, LANES};
use crate::fit::layout::Layout;
use crate::fit::part::{Part, Release};
use crate::fit::pieces::{Piece, Pieces};
use crate::fit::problem::JointProblem;
use crate::fit::structure::{Structure, YAW};
use crate::par_map::ParMap;
use crate::solver::blocks::{self, Block, Quadratic};
use crate::solver::descent::{descend, Attempt, Damping, Descent, Ended};
use crate::solver::{Normal, Rows};

/// When a fit to pieces ends.
#[derive(Clone, Copy)]
pub(crate) struct Until {
    /// Gain of a step, as a share of the sum of squares, below which it is the last.
    pub(crate) settled: f64,
    pub(crate) steps: usize,
}

/// Of one that is only a start for the next; it is continued on longer pieces.
pub(crate) const ROUGH: Until = Until { settled: 1e-3, steps: 40 };
/// Of one from one of several starts, the best of which is gone on with.
pub(crate) const FIRST: Until = Until { steps: FIRST_STEPS, ..ROUGH };
pub(crate) const FIRST_STEPS: usize = 6;
/// Of one whose numbers models are compared by.
pub(crate) const SETTLED: Until = Until { settled: 1e-4, ..ROUGH };
/// Of one to the whole, or of a law.
pub(crate) const FINE: Until = Until { settled: 1e-5, ..ROUGH };
/// A model on pieces: what they have in common, and the state of each at its first instant.
#[derive(Clone, Debug)]
pub(crate) struct PieceFit {
    pub(crate) structure: Structure,
    pub(crate) layout: Layout,
    /// All numbers but the states: natural frequencies and damping ratios, zeros, then each effect's.
    pub(crate) common: Vec<f64>,
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
        self.layout.numbers(piece, &self.common, self.states[piece])
    }

    /// Where in `common` the numbers of `effect`, which is in the structure, begin.
    pub(crate) fn start_of(&self, effect: &Effect) -> usize {
        let number = self.structure.place(effect).expect("an effect of the model");
        self.layout.shared_of(0, number).expect("no state")
    }

    /// The numbers of all effects, one after the other.
    pub(crate) fn of_effects(&self) -> &[f64] {
        let count: usize = self.structure.effects.iter().map(|e| e.parameters().len()).sum();
        &self.common[self.common.len() - count..]
    }
}

/// A fit to some of the pieces, on its way.
struct Fit<'a> {
    problem: JointProblem<'a>,
    /// Of the common numbers, those that are not fixed.
    free: Vec<usize>,
    /// Of each number by which a piece is fitted: its place among the free ones, the state's behind them.
    columns: Vec<Vec<usize>>,
    here: Place,
    trial: Place,
    /// The steps are those that it may still take.
    until: Until,
}

/// Numbers of a fit, and what the pieces are there.
#[derive(Default)]
struct Place {
    common: Vec<f64>,
    states: Vec<[f64; 2]>,
    /// Once they have been asked for.
    blocks: Option<Vec<Block>>,
    /// What of each piece's squares over the noise the record misses; the rest keeps a law smooth.
    misfit: Vec<f64>,
}

impl<'a> Fit<'a> {
    fn new(
        pieces: &[&'a Piece],
        structure: &Structure,
        (common, states): (&[f64], &[[f64; 2]]),
        until: Until,
    ) -> Self {
        let layout = Piece::layout(pieces, structure);
        let starts: Vec<Vec<f64>> =
            (0..pieces.len()).map(|k| layout.numbers(k, common, [0.0, 0.0])).collect();
        let blocks: Vec<Release> = pieces.iter().map(|piece| Release::whole(piece)).collect();
        let structures = vec![structure.clone(); pieces.len()];
        let problem = JointProblem::laid_out(&blocks, structures, layout, &starts);
        let shared = |part: &Part, j: usize| problem.layout.shared(part.places[j]);
        let of_part = |part: &Part| part.free.iter().filter_map(|&j| shared(part, j)).collect();
        let mut free: Vec<usize> =
            problem.parts.iter().flat_map(|p| -> Vec<_> { of_part(p) }).collect();
        free.sort_unstable();
        free.dedup();
        let column = |part: &Part, j: usize| match shared(part, j) {
            Some(at) => free.partition_point(|&other| other < at),
            None => free.len() + j - YAW,
        };
        let of_part = |part: &Part| part.free.iter().map(|&j| column(part, j)).collect();
        let columns = problem.parts.iter().map(of_part).collect();
        let inside = |(j, x): (usize, &f64)| {
            let (low, high) = problem.bounds[problem.layout.of_shared(j)];
            x.max(low).min(high)
        };
        let common = common.iter().enumerate().map(inside).collect();
        let misfit = vec![f64::INFINITY; pieces.len()];
        let here = Place { common, states: states.to_vec(), blocks: None, misfit };
        Self { problem, free, columns, here, trial: Place::default(), until }
    }

    fn bounds(&self, common: usize) -> (f64, f64) {
        self.problem.bounds[self.problem.layout.of_shared(common)]
    }

    fn is_stopped(&self) -> bool {
        self.problem.parts[0].release.decay.stop.is_requested()
    }

    /// The pieces' sums and misfit there; `None` where the model has no course, or is stopped.
    fn sums(&self, at: &Place) -> Option<(Vec<Block>, Vec<f64>)> {
        let all = &self.problem.layout.all(&at.common, &at.states);
        let of_part = |(part, which): (&Part, &Vec<usize>)| {
            if self.is_stopped() {
                return None;
            }
            let (residuals, columns) = part.linearised(all);
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let mut normal = Normal::new(self.free.len() + 2);
            normal.part(&residuals, which, &columns);
            Some((Block::new(&normal)?, sum(&residuals[..part.release.count])))
        };
        self.problem.parts.iter().zip(&self.columns).par_map(of_part).collect()
    }

    /// Each piece's squares alone, and of them the misfit; no numbers where the model has no course, or stopped.
    fn squares(&self, at: &Place) -> (Vec<f64>, Vec<f64>) {
        let all = &self.problem.layout.all(&at.common, &at.states);
        let of_part = |part: &Part| {
            if self.is_stopped() {
                return (f64::NAN, f64::NAN);
            }
            let (residuals, _) = part.linearised_by(all, &[]);
            (sum(&residuals), sum(&residuals[..part.release.count]))
        };
        self.problem.parts.iter().par_map(of_part).unzip()
    }

    fn total(&self) -> f64 {
        self.here.blocks.iter().flatten().map(Block::squares).sum()
    }

    /// The gain of a step with which it ends.
    fn enough(&self) -> f64 {
        self.until.settled * self.total()
    }

    /// Downhill from where it is; whether it got to a minimum.
    fn descend(&mut self) -> bool {
        let Some((blocks, misfit)) = self.sums(&self.here) else { return false };
        (self.here.blocks, self.here.misfit) = (Some(blocks), misfit);
        let damping = Damping::new(1e-4, [1e-12, 1e10]).raised_to(1e-6);
        descend(self, damping).is_minimum() && !self.is_stopped()
    }
}

fn sum(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

impl Descent for Fit<'_> {
    fn arrived(&mut self) -> Option<Ended> {
        let used_up = self.until.steps == 0;
        self.until.steps = self.until.steps.saturating_sub(1);
        used_up.then_some(Ended::MaxEvaluations)
    }

    fn step(&mut self, damping: f64) -> Attempt {
        if self.is_stopped() {
            return Attempt::Ended(Ended::Interrupted);
        }
        let Place { common, states, blocks, .. } = &self.here;
        let within = |k: usize| {
            let (low, high) = self.bounds(self.free[k]);
            (low - common[self.free[k]], high - common[self.free[k]])
        };
        let blocks = blocks.as_ref().expect("where it has been");
        let Some(step) = blocks::step(blocks, damping, &within) else { return Attempt::Impossible };
        let mut to = common.clone();
        self.free.iter().zip(&step.shared).for_each(|(&j, by)| to[j] += by);
        let state = |(x, by): (&[f64; 2], &[f64; 2])| [x[0] + by[0], x[1] + by[1]];
        let states = states.iter().zip(&step.states).map(state).collect();
        self.trial = Place { common: to, states, ..Place::default() };
        Attempt::Promises(step.promised)
    }

    fn gain(&mut self) -> Option<f64> {
        // Where derivatives cost so much more than residuals, these are asked first whether a step gains, and
        // whether it is the last.
        if self.free.len() > 2 * LANES {
            let (squares, misfit) = self.squares(&self.trial);
            let ahead = self.total() - squares.iter().sum::<f64>();
            self.trial.misfit = misfit;
            if ahead.is_nan() || ahead < self.enough() {
                return Some(ahead);
            }
        }
        let (blocks, misfit) = self.sums(&self.trial)?;
        let gained = self.total() - blocks.iter().map(Block::squares).sum::<f64>();
        (self.trial.blocks, self.trial.misfit) = (Some(blocks), misfit);
        Some(gained)
    }

    fn is_last(&self, promised: f64, gained: Option<f64>) -> bool {
        let gained = gained.filter(|gained| *gained > 0.0);
        gained.unwrap_or(promised.abs()) < self.enough()
    }

    fn take(&mut self) {
        std::mem::swap(&mut self.here, &mut self.trial);
    }

    fn relaxation(&self, kept: f64) -> f64 {
        if kept > 0.5 {
            0.1
        } else {
            0.5
        }
    }
}

/// Fits `structure` to `pieces` from given common numbers and states.
pub(crate) fn fit_pieces(
    pieces: &[&Piece],
    structure: &Structure,
    common: &[f64],
    states: &[[f64; 2]],
    until: Until,
) -> PieceFit {
    let mut fit = Fit::new(pieces, structure, (common, states), until);
    let converged = fit.descend();
    let Place { common, states, misfit, .. } = fit.here;
    let squares = misfit.iter().zip(pieces).map(|(m, piece)| m * piece.noise_rad.powi(2));
    PieceFit {
        structure: structure.clone(),
        layout: fit.problem.layout,
        squares: squares.collect(),
        common,
        states,
        converged,
    }
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
    let fit = Fit::new(pieces, structure, (common, states), FINE);
    let all = fit.sums(&fit.here)?.0.iter().map(Block::quadratic).collect();
    let bounds = (0..common.len()).map(|j| fit.bounds(j)).collect();
    Some((all, fit.free, bounds))
}

/// Fits to `pieces` from common numbers alone: the states from the record's own beginnings.
pub(crate) fn fit_from(
    pieces: &Pieces,
    structure: &Structure,
    common: &[f64],
    until: Until,
) -> PieceFit {
    let all: Vec<&Piece> = pieces.decays.iter().collect();
    fit_pieces(&all, structure, common, &pieces.states(structure, common), until)
}
