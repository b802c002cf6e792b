//! How smooth a measured law has to be: as smooth as predicts best.
//!
//! About a fit, the sum of squares of each piece is a quadratic of the shared parameters, its state
//! eliminated. So what any roughness would predict of a piece that was left out is a matter of linear
//! algebra, and many can be tried.

use crate::diagnosis::prediction::ONE_STANDARD_ERROR;
use crate::effects::{Effect, MeasuredLaw, Part, KNOTS};
use crate::fit::pieces::{Piece, Pieces};
use crate::fit::segments::{quadratics, PieceFit};
use crate::motion::simulate::Motion;
use crate::quantity::CHANCE;
use crate::solver::blocks::Quadratic;
use crate::solver::step_within;
use crate::statistics::{correlation, independent_share};
use crate::stop::Stop;
use nalgebra::{Cholesky, DMatrix, DVector};

/// A fit's neighbourhood.
pub(super) struct Nearby<'a> {
    pieces: Vec<Quadratic>,
    /// Means in each piece, and how much its roughness weighs.
    counts: Vec<f64>,
    stiff: Vec<f64>,
    /// The shared parameters where it was taken, and those of them that vary.
    common: Vec<f64>,
    free: Vec<usize>,
    bounds: Vec<(f64, f64)>,
    /// Of the law's parameters: the first's place in `common`.
    begin: usize,
    law: &'a MeasuredLaw,
    stop: Stop,
}

impl<'a> Nearby<'a> {
    /// `fit` holds `law` as its last effect, whose parameters begin at `begin`.
    pub(super) fn new(
        pieces: &Pieces,
        fit: &PieceFit,
        law: &'a MeasuredLaw,
        begin: usize,
    ) -> Option<Self> {
        // The penalty is added here.
        let parts = law.parts.iter().map(|(part, _)| (*part, 0.0)).collect();
        let mut structure = fit.structure.clone();
        let effect = Effect::Measured(law.with(parts, law.friction).into());
        *structure.effects.last_mut()? = effect.clone();
        let all: Vec<&Piece> = pieces.decays.iter().collect();
        let states = pieces.states(&fit.structure, &fit.common);
        let (quadratics, free, bounds) = quadratics(&all, &structure, &fit.common, &states)?;
        let stiff = |piece: &Piece| {
            // Of one size all.
            let size = effect.sizes(&piece.scale()).first().copied().unwrap_or(1.0);
            let weight = piece.reading_rad() / piece.noise_rad / size;
            piece.yaw_rad.len() as f64 * weight.powi(2)
        };
        Some(Self {
            stiff: pieces.decays.iter().map(stiff).collect(),
            counts: all.iter().map(|p| p.yaw_rad.len() as f64).collect(),
            pieces: quadratics,
            common: fit.common.clone(),
            free,
            bounds,
            begin,
            law,
            stop: all[0].stop.clone(),
        })
    }

    /// Over the free parameters, for what weighs one, the parts having these weights.
    fn penalty(&self, weights: &[f64]) -> DMatrix<f64> {
        let parts = self.law.parts.iter().zip(weights).map(|((part, _), w)| (*part, *w)).collect();
        let rows = self.law.with(parts, self.law.friction).penalty();
        let square = rows.transpose() * rows;
        let inside =
            |i: usize| self.free[i].checked_sub(self.begin).filter(|k| *k < square.ncols());
        DMatrix::from_fn(self.free.len(), self.free.len(), |i, j| match (inside(i), inside(j)) {
            (Some(a), Some(b)) => square[(a, b)],
            _ => 0.0,
        })
    }

    /// Matrix and step of the pieces but `left_out`.
    fn solved(
        &self,
        penalty: &DMatrix<f64>,
        left_out: Option<usize>,
        friction: bool,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let n = self.free.len();
        let (mut a, mut g, mut stiff) = (DMatrix::zeros(n, n), DVector::zeros(n), 0.0);
        for (i, piece) in self.pieces.iter().enumerate().filter(|(i, _)| Some(*i) != left_out) {
            a += &piece.matrix;
            g += &piece.gradient;
            stiff += self.stiff[i];
        }
        let here = DVector::from_iterator(n, self.free.iter().map(|&j| self.common[j]));
        g += penalty * &here * stiff;
        a += penalty * stiff;
        let mut damped = a.clone();
        for k in 0..n {
            damped[(k, k)] += 1e-9 * a[(k, k)].max(1e-30);
        }
        let step = step_within(&damped, &g, &|k| {
            let (low, high) = self.bounds[self.free[k]];
            let jump = self.begin + KNOTS * self.law.parts.len();
            let high = if !friction && self.free[k] == jump { 0.0 } else { high };
            (low - here[k], high - here[k])
        })?;
        Some((a, step))
    }

    /// Mean square over the noise of each piece but the first, whose amplitudes no other reaches, predicted
    /// from the others: its logarithm, the noise itself added.
    fn predicted(&self, weights: &[f64], friction: bool) -> Vec<f64> {
        let penalty = self.penalty(weights);
        let of = |i: usize| {
            if self.stop.is_requested() {
                return f64::INFINITY;
            }
            let Some((_, step)) = self.solved(&penalty, Some(i), friction) else {
                return f64::INFINITY;
            };
            let piece = &self.pieces[i];
            let squares = piece.squares
                + 2.0 * piece.gradient.dot(&step)
                + step.dot(&(&piece.matrix * &step));
            (squares.max(0.0) / self.counts[i] + 1.0).ln()
        };
        (1..self.pieces.len()).map(of).collect()
    }

    fn total(&self, errors: &[f64]) -> f64 {
        errors.iter().zip(&self.counts[1..]).map(|(e, n)| e * n).sum()
    }

    /// Whether the first errors are smaller than the second by `by` standard errors of their difference.
    fn is_better(&self, first: &[f64], second: &[f64], by: f64) -> bool {
        let counts = &self.counts[1..];
        let all: f64 = counts.iter().sum();
        let gains: Vec<f64> = second.iter().zip(first).map(|(a, b)| a - b).collect();
        let mean = self.total(&gains) / all;
        let squares = gains.iter().zip(counts).map(|(g, n)| (n * (g - mean)).powi(2));
        mean > by * squares.sum::<f64>().sqrt() / all
    }

    /// The law with the weights that predict best. What does not earn a standard error is left out: a curve,
    /// friction.
    pub(super) fn best(&self) -> MeasuredLaw {
        let mut weights: Vec<f64> = self.law.parts.iter().map(|(_, w)| *w).collect();
        let mut kept = vec![true; weights.len()];
        let mut friction = self.law.friction;
        // Each curve's weight twice, the others' kept.
        for _ in 0..2 {
            for k in 0..weights.len() {
                let tried = (-11..=2).map(|exponent| {
                    let mut weights = weights.clone();
                    weights[k] = 10f64.powi(exponent);
                    let errors = self.predicted(&weights, friction);
                    (weights, errors)
                });
                let tried: Vec<(Vec<f64>, Vec<f64>)> = tried.collect();
                let smoothest = tried.last().expect("several are tried");
                let least = |a: &&(Vec<f64>, Vec<f64>), b: &&(Vec<f64>, Vec<f64>)| {
                    self.total(&a.1).total_cmp(&self.total(&b.1))
                };
                let chosen = tried.iter().min_by(least).expect("several are tried");
                // One that differs from side to side bends to more.
                let even = matches!(self.law.parts[k].0, Part::Stiffness | Part::Damping);
                let by = if even { ONE_STANDARD_ERROR } else { CHANCE };
                kept[k] = self.is_better(&chosen.1, &smoothest.1, by);
                weights = if kept[k] { chosen.0.clone() } else { smoothest.0.clone() };
            }
            if self.law.friction {
                let [with, without] = [true, false].map(|f| self.predicted(&weights, f));
                friction = self.is_better(&with, &without, ONE_STANDARD_ERROR);
            }
        }
        let parts = self.law.parts.iter().zip(weights).zip(kept);
        let parts: Vec<(Part, f64)> =
            parts.filter(|(_, kept)| *kept).map(|((part, w), _)| (part.0, w)).collect();
        self.law.with(parts, friction)
    }

    /// Covariance of the shared parameters (zero for those that are fixed), noise alone.
    pub(super) fn covariance(&self) -> Option<DMatrix<f64>> {
        let weights: Vec<f64> = self.law.parts.iter().map(|(_, w)| *w).collect();
        let (a, _) = self.solved(&self.penalty(&weights), None, self.law.friction)?;
        let inverse = Cholesky::new(a)?.inverse();
        let n = self.common.len();
        let mut out = DMatrix::zeros(n, n);
        for (i, &a) in self.free.iter().enumerate() {
            for (j, &b) in self.free.iter().enumerate() {
                out[(a, b)] = inverse[(i, j)];
            }
        }
        Some(out)
    }
}

/// Each piece with its motion under a fit, and the sensor's zero.
fn simulated<'a>(
    pieces: &'a Pieces,
    fit: &'a PieceFit,
) -> impl Iterator<Item = (&'a Piece, Motion, f64)> {
    pieces.decays.iter().enumerate().map(|(k, piece)| {
        let (motion, zero) = fit.structure.motion(&fit.numbers(k), piece.around());
        (piece, motion, zero)
    })
}

/// The largest yaw angle about the rest and the largest yaw rate that the model reaches in `pieces`, rad and
/// rad/s.
pub(super) fn reached(pieces: &Pieces, fit: &PieceFit) -> (f64, f64) {
    let largest = |most: f64, x: &[f64]| x.iter().fold(most, |m, x| m.max(x.abs()));
    let further = |(yaw, rate): (f64, f64), (piece, motion, _): (&Piece, Motion, f64)| {
        let (b, r) = motion.of_angle().readings_and_rates(&piece.grid);
        (largest(yaw, &b), largest(rate, &r))
    };
    simulated(pieces, fit).fold((0.0, 0.0), further)
}

/// Residuals to each that counts as independent, by their lag-one correlation; at least 1.
pub(super) fn inflation(pieces: &Pieces, fit: &PieceFit) -> f64 {
    let residuals = |(piece, motion, zero): (&Piece, Motion, f64)| {
        let rows = piece.yaw_rad.iter().zip(motion.readings(&piece.grid));
        rows.map(|(y, model)| y - model - zero).collect()
    };
    let residuals: Vec<Vec<f64>> = simulated(pieces, fit).map(residuals).collect();
    1.0 / independent_share(correlation(&residuals))
}
