//! A rival fitted to a simulated release, tied to what the records so far say of its numbers.

use super::possible::{numbers, Possible, Rival};
use crate::error::{Error, Result};
use crate::fit::free_decay::FreeDecay;
use crate::fit::part::{lengthened, Release};
use crate::fit::problem::{problem_of_one, JointProblem, EVALUATIONS};
use crate::solver::{minimise, Options, Problem, Rows};
use nalgebra::{Cholesky, DMatrix};

/// What is minimised: residuals over the noise, and deviations of the tied numbers over their errors.
struct Tied<'a> {
    problem: JointProblem<'a>,
    /// The numbers that are known.
    known: &'a [f64],
    /// A row for each tied number: the inverse root of their covariance.
    ties: &'a [Vec<f64>],
}

/// The least sum of squares of `rival` on `decay`, a simulated `release`, found over ever longer parts of it.
pub(super) fn least_squares(decay: &FreeDecay, rival: &Rival, release: &Possible) -> Result<f64> {
    let fit = &rival.fit.fits[release.like];
    let known = numbers(rival, release);
    let covariance = fit.covariance.as_ref().ok_or(Error::NotFitted)?;
    let mut tied: Vec<usize> = if release.repeated { vec![0, 1] } else { Vec::new() };
    for (effect, at) in fit.structure.places() {
        let shared = |number: &usize| !effect.belongs_to_release(*number);
        tied.extend((0..effect.parameters().len()).filter(shared).map(|number| at + number));
    }
    // What is fixed has no variance and is not varied here either.
    tied.retain(|&at| covariance[(at, at)] > 0.0 && covariance[(at, at)].is_finite());
    let ties = ties(covariance, &tied, known.len()).ok_or(Error::NotFitted)?;
    let options =
        Options { max_evaluations: EVALUATIONS, tolerance: 0.01, accuracy: 0.0, damping: 1e-4 };
    let mut p = known.clone();
    Ok(lengthened(&[Release::whole(decay)], |part| {
        let problem = problem_of_one(part[0], &fit.structure, &p);
        let fit = minimise(&Tied { problem, known: &known, ties: &ties }, &p, &options);
        if fit.sum_of_squares.is_finite() {
            p = fit.parameters;
        }
        fit.sum_of_squares
    }))
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
        self.known.len()
    }

    fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
        self.problem.evaluate(p, rows);
        for tie in self.ties {
            let off: f64 =
                tie.iter().zip(p).zip(self.known).map(|((w, p), known)| w * (p - known)).sum();
            rows.row(off, tie);
        }
    }

    fn bounds(&self, index: usize) -> (f64, f64) {
        self.problem.bounds[index]
    }
}
