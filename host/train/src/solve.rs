//! Cholesky factor of the curvature and what is asked of it: the step, the trace of the inverse,
//! the determinant.
//!
//! Of our own because nalgebra's goes column by column, without matrix products; here a few hundred
//! columns are halved and halved again, so that most of the work is products.

use super::matrix::{col, col_mut, Matrix};

/// Below this many columns a loop is quicker than a product.
const FEW: usize = 12;
/// Columns of a product beside the diagonal: what lies above it is worked out in vain.
const STRIP: usize = 48;

pub(super) struct Factor {
    l: Matrix,
    inverse_l: Matrix,
    inverse: Matrix,
}

/// The matrix was not positive definite, or not finite.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct NotPositive;

impl Factor {
    pub fn new(n: usize) -> Self {
        Self {
            l: Matrix::zeros(n, n),
            inverse_l: Matrix::zeros(n, n),
            inverse: Matrix::zeros(n, n),
        }
    }

    /// Factors `h + ridge I`; only the lower triangle of `h` is read.
    pub fn factor(&mut self, h: &Matrix, ridge: f64) -> Result<(), NotPositive> {
        let n = h.nrows();
        for j in 0..n {
            col_mut(&mut self.l, j)[j..].copy_from_slice(&col(h, j)[j..]);
            self.l[(j, j)] += ridge;
        }
        factor_columns(&mut self.l, 0, n)
    }

    /// Solves for one right-hand side, in place.
    pub fn solve(&self, b: &mut [f64]) {
        let n = b.len();
        for j in 0..n {
            let (head, tail) = b.split_at_mut(j + 1);
            let column = &col(&self.l, j)[j..];
            head[j] /= column[0];
            tail.iter_mut().zip(&column[1..]).for_each(|(b, l)| *b -= head[j] * l);
        }
        for j in (0..n).rev() {
            let column = &col(&self.l, j)[j..];
            let known: f64 = b[j + 1..].iter().zip(&column[1..]).map(|(b, l)| b * l).sum();
            b[j] = (b[j] - known) / column[0];
        }
    }

    /// Trace of the inverse of what was factored: the squared Frobenius norm of the factor's inverse.
    pub fn inverse_trace(&mut self) -> f64 {
        self.invert_factor();
        let n = self.l.nrows();
        (0..n).map(|j| col(&self.inverse_l, j)[j..].iter().map(|v| v * v).sum::<f64>()).sum()
    }

    /// The inverse of what was factored; its lower triangle.
    pub fn inverse(&mut self) -> &Matrix {
        self.invert_factor();
        let n = self.l.nrows();
        for (left, width) in strips(0, n) {
            for (top, height) in strips(left, n) {
                // Above its diagonal the factor's inverse is zero.
                let below = n - top;
                let a = self.inverse_l.view((top, top), (below, height)).transpose();
                let b = self.inverse_l.view((top, left), (below, width));
                self.inverse.view_mut((top, left), (height, width)).gemm(1.0, &a, &b, 0.0);
            }
        }
        &self.inverse
    }

    fn invert_factor(&mut self) {
        let n = self.l.nrows();
        self.inverse_l.fill(0.0);
        self.inverse_l.fill_diagonal(1.0);
        for strip in strips(0, n) {
            solve_rows(&self.l, &mut self.inverse_l, strip, (strip.0, n));
        }
    }

    pub fn log_det(&self) -> f64 {
        2.0 * (0..self.l.nrows()).map(|j| self.l[(j, j)].ln()).sum::<f64>()
    }
}

/// First column and width of each strip.
fn strips(from: usize, to: usize) -> impl Iterator<Item = (usize, usize)> {
    (from..to).step_by(STRIP).map(move |start| (start, STRIP.min(to - start)))
}

/// Factors the columns `from..to`, from which those before have been subtracted.
fn factor_columns(l: &mut Matrix, from: usize, to: usize) -> Result<(), NotPositive> {
    let n = l.nrows();
    if to - from > FEW {
        let middle = from + (to - from) / 2;
        factor_columns(l, from, middle)?;
        let (done, mut rest) = l.columns_range_pair_mut(from..middle, middle..to);
        for (start, width) in strips(middle, to) {
            let a = done.rows(start, n - start);
            let b = done.rows(start, width).transpose();
            let mut into = rest.view_mut((start, start - middle), (n - start, width));
            into.gemm(-1.0, &a, &b, 1.0);
        }
        return factor_columns(l, middle, to);
    }
    for j in from..to {
        let (before, rest) = l.as_mut_slice().split_at_mut(j * n);
        let column = &mut rest[j..n];
        for p in from..j {
            let earlier = &before[p * n..][j..n];
            let share = earlier[0];
            column.iter_mut().zip(earlier).for_each(|(c, e)| *c -= share * e);
        }
        let pivot = column[0];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(NotPositive);
        }
        let root = pivot.sqrt();
        column[0] = root;
        column[1..].iter_mut().for_each(|c| *c /= root);
    }
    Ok(())
}

/// Solves `l x = b` in place for the rows `from..to` of the strip's columns, from which those before
/// have been subtracted.
fn solve_rows(l: &Matrix, b: &mut Matrix, strip: (usize, usize), (from, to): (usize, usize)) {
    if to - from > FEW {
        let middle = from + (to - from) / 2;
        solve_rows(l, b, strip, (from, middle));
        let mut columns = b.columns_mut(strip.0, strip.1);
        let (done, mut rest) = columns.rows_range_pair_mut(from..middle, middle..to);
        rest.gemm(-1.0, &l.view((middle, from), (to - middle, middle - from)), &done, 1.0);
        solve_rows(l, b, strip, (middle, to));
        return;
    }
    for j in strip.0..strip.0 + strip.1 {
        let b = &mut col_mut(b, j)[from..to];
        for i in 0..b.len() {
            let (head, tail) = b.split_at_mut(i + 1);
            let column = &col(l, from + i)[from + i..to];
            head[i] /= column[0];
            tail.iter_mut().zip(&column[1..]).for_each(|(b, l)| *b -= head[i] * l);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 on the diagonal, 1 beside it; the upper triangle must not be read.
    fn example() -> Matrix {
        Matrix::from_fn(5, 5, |i, j| match i as isize - j as isize {
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

    /// Beyond one strip and one halving, against nalgebra's own.
    #[test]
    fn agrees_with_the_plain_factor() {
        for n in [1, FEW, FEW + 1, STRIP, 2 * STRIP + 7, 266] {
            let root = Matrix::from_fn(n + 3, n, |i, j| ((i * 31 + j * 17) as f64).sin());
            let h = root.tr_mul(&root) + Matrix::identity(n, n) * 0.1;
            let plain = nalgebra::Cholesky::new(h.clone()).unwrap();
            let mut factor = Factor::new(n);
            factor.factor(&h, 0.0).unwrap();
            let apart = |a: f64, b: f64| assert!((a - b).abs() < 1e-10 * (1.0 + b.abs()), "{n}");
            let log_det = plain.l_dirty().diagonal().map(|d| 2.0 * d.ln()).sum();
            apart(factor.log_det(), log_det);
            let inverse = plain.inverse();
            apart(factor.inverse_trace(), inverse.trace());
            let own = factor.inverse();
            for j in 0..n {
                (j..n).for_each(|i| apart(own[(i, j)], inverse[(i, j)]));
            }
            let mut x: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            let expected = plain.solve(&nalgebra::DVector::from_column_slice(&x));
            factor.solve(&mut x);
            x.iter().zip(&expected).for_each(|(a, b)| apart(*a, *b));
        }
    }
}
