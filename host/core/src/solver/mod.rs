//! Nonlinear least squares for any model: Levenberg-Marquardt on streamed normal equations.
//!
//! A `Problem` hands over its residuals and Jacobian a row or a block at a time; only J'J, J'r and
//! r'r are kept, so a record of any length costs memory for its parameters alone.
//! Reference: K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems"
//! (2004), with the column scaling of J. J. Moré (1978).

pub(crate) mod blocks;
#[cfg(test)]
pub(crate) mod check;
pub mod descent;
mod levenberg;
mod linear;
mod normal;
mod within;

pub(crate) use descent::Ended;
pub(crate) use levenberg::{minimise, Options};
pub use linear::linear_fit;
pub(crate) use normal::Normal;
pub(crate) use within::step_within;

use nalgebra::DMatrix;

/// Where a problem puts its residuals and the rows of its Jacobian, in any grouping.
pub(crate) trait Rows {
    /// One residual r and its derivatives dr/dp, as many as there are parameters.
    fn row(&mut self, residual: f64, derivatives: &[f64]);
    /// Several at once, the Jacobian by columns: `columns[j][k]` is d `residuals[k]` / d p_j.
    fn block(&mut self, residuals: &[f64], columns: &[&[f64]]) {
        let every: Vec<usize> = (0..columns.len()).collect();
        self.part(residuals, &every, columns);
    }
    /// As [`Rows::block`] where only the parameters `which` touch these residuals: `columns[i]`
    /// is of parameter `which[i]`, and what is not named is zero.
    fn part(&mut self, residuals: &[f64], which: &[usize], columns: &[&[f64]]);
}

/// A sum of squared residuals r(p) to be made small.
pub(crate) trait Problem {
    /// How many parameters p holds.
    fn parameters(&self) -> usize;
    /// Streams every residual and its derivatives at `p` into `rows`. A residual that is not finite says
    /// that the model cannot be evaluated there, and the step is taken back.
    fn evaluate(&self, p: &[f64], rows: &mut dyn Rows);
    /// Takes the end `to` of a step that is straight along a bent valley whose shape is known: to first order it stays.
    fn bend(&self, _from: &[f64], _to: &mut [f64]) {}
    /// Smallest and largest value parameter `index` may take.
    fn bounds(&self, _index: usize) -> (f64, f64) {
        (f64::NEG_INFINITY, f64::INFINITY)
    }
}

/// What a fit found.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) parameters: Vec<f64>,
    /// r'r at the parameters, in the residual's unit squared.
    pub(crate) sum_of_squares: f64,
    /// How many residuals there were.
    pub(crate) residuals: usize,
    pub(crate) stop: Ended,
    /// How often the model was evaluated.
    pub(crate) evaluations: usize,
    /// Parameters that ended on a bound and are taken for known in `covariance` (their rows are zero).
    pub(crate) at_bound: Vec<bool>,
    /// J'J at the parameters.
    pub(crate) normal_matrix: DMatrix<f64>,
    /// s^2 (J'J)^-1 with s^2 = r'r / (residuals - free parameters): right for white residuals only. None
    /// without a minimum, without residuals to spare, or where they do not determine the parameters.
    pub(crate) covariance: Option<DMatrix<f64>>,
}

/// `covariance` with a variance for numbers that are pressed against a bound: what it would be off it. A
/// friction of zero is known no better than one that is there.
pub(crate) fn off_bounds(
    covariance: &DMatrix<f64>,
    normal_matrix: &DMatrix<f64>,
    variance: f64,
    is_pressed: impl Fn(usize) -> bool,
) -> DMatrix<f64> {
    let mut out = covariance.clone();
    for j in (0..covariance.nrows()).filter(|&j| is_pressed(j)) {
        let column = normal_matrix.column(j);
        let left = normal_matrix[(j, j)] - column.dot(&(covariance * column)) / variance;
        out[(j, j)] = if left > 0.0 { variance / left } else { f64::INFINITY };
    }
    out
}

impl Fit {
    /// s^2, the variance of one residual.
    pub(crate) fn variance(&self) -> f64 {
        let free = self.at_bound.iter().filter(|&&b| !b).count();
        self.sum_of_squares / self.residuals.saturating_sub(free).max(1) as f64
    }
}
