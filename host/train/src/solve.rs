//! Cholesky factor of a damped curvature: the step, the trace of the inverse, the determinant.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Mat, MatMut, Par};

pub(super) struct Factor {
    l: Mat<f64>,
    inverse: Mat<f64>,
    factor_scratch: MemBuffer,
    inverse_scratch: MemBuffer,
}

/// The matrix was not positive definite, or not finite.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct NotPositive;

impl Factor {
    pub fn new(n: usize) -> Self {
        Self {
            l: Mat::zeros(n, n),
            inverse: Mat::zeros(n, n),
            factor_scratch: MemBuffer::new(llt::factor::cholesky_in_place_scratch::<f64>(
                n,
                Par::Seq,
                Default::default(),
            )),
            inverse_scratch: MemBuffer::new(llt::inverse::inverse_scratch::<f64>(n, Par::Seq)),
        }
    }

    /// Factors `h + ridge I`; only the lower triangle of `h` is read.
    pub fn factor(&mut self, h: &Mat<f64>, ridge: f64) -> Result<(), NotPositive> {
        let n = h.nrows();
        for j in 0..n {
            self.l.col_as_slice_mut(j)[j..].copy_from_slice(&h.col_as_slice(j)[j..]);
            self.l[(j, j)] += ridge;
        }
        let stack = MemStack::new(&mut self.factor_scratch);
        let (regularise, params) = (Default::default(), Default::default());
        llt::factor::cholesky_in_place(self.l.as_mut(), regularise, Par::Seq, stack, params)
            .map_err(|_| NotPositive)?;
        let finite = (0..n).all(|j| self.l[(j, j)].is_finite() && self.l[(j, j)] > 0.0);
        finite.then_some(()).ok_or(NotPositive)
    }

    /// Solves for one right-hand side, in place.
    pub fn solve(&self, b: &mut [f64]) {
        let n = b.len();
        let b = MatMut::from_column_major_slice_mut(b, n, 1);
        llt::solve::solve_in_place(self.l.as_ref(), b, Par::Seq, MemStack::new(&mut []));
    }

    /// Trace of the inverse of what was factored: the squared Frobenius norm of the factor's inverse.
    pub fn inverse_trace(&mut self) -> f64 {
        invert_lower_triangular(self.inverse.as_mut(), self.l.as_ref(), Par::Seq);
        let n = self.l.nrows();
        (0..n).map(|j| self.inverse.col_as_slice(j)[j..].iter().map(|v| v * v).sum::<f64>()).sum()
    }

    /// The inverse of what was factored; its lower triangle.
    pub fn inverse(&mut self) -> &Mat<f64> {
        let stack = MemStack::new(&mut self.inverse_scratch);
        llt::inverse::inverse(self.inverse.as_mut(), self.l.as_ref(), Par::Seq, stack);
        &self.inverse
    }

    pub fn log_det(&self) -> f64 {
        2.0 * (0..self.l.nrows()).map(|j| self.l[(j, j)].ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 on the diagonal, 1 beside it; the upper triangle must not be read.
    fn example() -> Mat<f64> {
        Mat::from_fn(5, 5, |i, j| match i as isize - j as isize {
            0 => 3.0,
            1 => 1.0,
            d if d < 0 => f64::NAN,
            _ => 0.0,
        })
    }

    #[test]
    fn solves_and_inverts() {
        let mut factor = Factor::new(5);
        factor.factor(&example(), 1.0).unwrap();
        let mut x = vec![5.0, 6.0, 6.0, 6.0, 5.0];
        factor.solve(&mut x);
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-15), "{x:?}");
        // The tridiagonal 4, 1 of size n has determinants 4, 15, 56, 209, 780.
        assert!((factor.log_det() - 780f64.ln()).abs() < 1e-14);
        let trace = (2.0 * 209.0 + 2.0 * 4.0 * 56.0 + 15.0 * 15.0) / 780.0;
        assert!((factor.inverse_trace() - trace).abs() < 1e-15);
        let inverse = factor.inverse();
        assert!(((0..5).map(|j| inverse[(j, j)]).sum::<f64>() - trace).abs() < 1e-15);
        assert!((inverse[(1, 0)] + 56.0 / 780.0).abs() < 1e-15);
    }

    #[test]
    fn refuses_what_is_not_positive() {
        let mut factor = Factor::new(5);
        assert_eq!(factor.factor(&example(), -4.0), Err(NotPositive));
        assert_eq!(factor.factor(&example(), f64::NAN), Err(NotPositive));
        assert_eq!(factor.factor(&example(), f64::INFINITY), Err(NotPositive));
    }
}
