//! A rival fitted to a simulated release, tied to what the records so far say of its numbers.

use super::possible::{numbers, Possible, Rival};
use crate::error::{Error, Result};
use crate::fit::fitting::{FIRST_CYCLES, LONGER};
use crate::fit::free_decay::FreeDecay;
use crate::fit::problem::{problem_of_one, JointProblem, Release, EVALUATIONS};
use crate::solver::{minimise, Options, Problem, Rows};
use nalgebra::{Cholesky, DMatrix};

/// What is minimised: residuals over the noise, and deviations of the tied numbers over their errors.
pub(super) struct Tied<'a> {
    decay: &'a FreeDecay,
    problem: JointProblem<'a>,
    count: usize,
    start: Vec<f64>,
    /// A row for each tied number: the inverse root of their covariance.
    ties: Vec<Vec<f64>>,
    rival: &'a Rival<'a>,
    release: &'a Possible,
}

impl<'a> Tied<'a> {
    pub(super) fn new(
        decay: &'a FreeDecay,
        rival: &'a Rival<'a>,
        release: &'a Possible,
    ) -> Result<Self> {
        let fit = &rival.fit.fits[release.like];
        let start = numbers(rival, release);
        let covariance = fit.covariance.as_ref().ok_or(Error::NotFitted)?;
        let mut tied: Vec<usize> = if release.repeated { vec![0, 1] } else { Vec::new() };
        for effect in &fit.structure.effects {
            let at = fit.start_of(effect);
            let shared = |number: &usize| !effect.belongs_to_release(*number);
            tied.extend((0..effect.parameters().len()).filter(shared).map(|number| at + number));
        }
        // What is fixed has no variance and is not varied here either.
        tied.retain(|&at| covariance[(at, at)] > 0.0 && covariance[(at, at)].is_finite());
        let ties = ties(covariance, &tied, start.len()).ok_or(Error::NotFitted)?;
        let count = decay.yaw_rad.len();
        let problem = problem_of_one(Release { decay, count }, &fit.structure, &start);
        Ok(Self { decay, problem, count, start, ties, rival, release })
    }

    /// The least sum of squares, found over ever longer parts of the release.
    pub(super) fn least_squares(mut self) -> f64 {
        let (mut p, mut cycles) = (self.start.clone(), FIRST_CYCLES);
        loop {
            let part = ((cycles * self.decay.per_cycle()) as usize).min(self.count);
            let structure = &self.rival.fit.fits[self.release.like].structure;
            let release = Release { decay: self.decay, count: part };
            self.problem = problem_of_one(release, structure, &p);
            let options = Options {
                max_evaluations: EVALUATIONS,
                tolerance: 0.01,
                accuracy: 0.0,
                damping: 1e-4,
            };
            let fit = minimise(&self, &p, &options);
            if part == self.count {
                return fit.sum_of_squares;
            }
            if fit.sum_of_squares.is_finite() {
                p = fit.parameters;
            }
            cycles *= LONGER;
        }
    }
}

/// The inverse of the Cholesky root of the covariance of `tied`, as rows over `count` numbers.
fn ties(covariance: &DMatrix<f64>, tied: &[usize], count: usize) -> Option<Vec<Vec<f64>>> {
    let n = tied.len();
    let size: Vec<f64> = tied.iter().map(|&at| covariance[(at, at)].sqrt()).collect();
    let of = |i: usize, j: usize| covariance[(tied[i], tied[j])] / (size[i] * size[j]);
    // Numbers known only together have correlations of nearly one.
    let scaled = DMatrix::from_fn(n, n, |i, j| of(i, j) + if i == j { 1e-9 } else { 0.0 });
    let inverse = Cholesky::new(scaled)?.l().try_inverse()?;
    let row = |i: usize| {
        let mut row = vec![0.0; count];
        for j in 0..n {
            row[tied[j]] = inverse[(i, j)] / size[j];
        }
        row
    };
    Some((0..n).map(row).collect())
}

impl Problem for Tied<'_> {
    fn parameters(&self) -> usize {
        self.start.len()
    }

    fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
        self.problem.evaluate(p, rows);
        for tie in &self.ties {
            let off: f64 =
                tie.iter().zip(p).zip(&self.start).map(|((w, p), known)| w * (p - known)).sum();
            rows.row(off, tie);
        }
    }

    fn bounds(&self, index: usize) -> (f64, f64) {
        self.problem.bounds[index]
    }
}
