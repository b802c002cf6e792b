//! J'J, J'r and r'r, summed as the rows come.

use super::Rows;
use nalgebra::{DMatrix, DVector};

/// Sums over all rows streamed so far.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    parameters: usize,
    /// Upper triangle of J'J, row by row.
    upper: Vec<f64>,
    gradient: Vec<f64>,
    sum_of_squares: f64,
    residuals: usize,
}

impl Normal {
    pub(crate) fn new(parameters: usize) -> Self {
        Self {
            parameters,
            upper: vec![0.0; parameters * (parameters + 1) / 2],
            gradient: vec![0.0; parameters],
            sum_of_squares: 0.0,
            residuals: 0,
        }
    }
    pub(crate) fn clear(&mut self) {
        self.upper.fill(0.0);
        self.gradient.fill(0.0);
        self.sum_of_squares = 0.0;
        self.residuals = 0;
    }
    pub(crate) fn sum_of_squares(&self) -> f64 {
        self.sum_of_squares
    }
    pub(crate) fn residuals(&self) -> usize {
        self.residuals
    }
    /// J'J.
    pub(crate) fn matrix(&self) -> DMatrix<f64> {
        let n = self.parameters;
        let mut m = DMatrix::zeros(n, n);
        let mut at = 0;
        for i in 0..n {
            for j in i..n {
                m[(i, j)] = self.upper[at];
                m[(j, i)] = self.upper[at];
                at += 1;
            }
        }
        m
    }
    /// J'r.
    pub(crate) fn gradient(&self) -> DVector<f64> {
        DVector::from_column_slice(&self.gradient)
    }
    pub(crate) fn is_finite(&self) -> bool {
        self.sum_of_squares.is_finite()
            && self.gradient.iter().chain(&self.upper).all(|x| x.is_finite())
    }
}

/// Inner product in eight independent sums, which the compiler can keep in vector registers.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for i in 0..8 {
            lanes[i] += x[i] * y[i];
        }
    }
    lanes.iter().sum::<f64>() + tail
}

impl Rows for Normal {
    fn row(&mut self, residual: f64, derivatives: &[f64]) {
        debug_assert_eq!(derivatives.len(), self.parameters);
        self.residuals += 1;
        self.sum_of_squares += residual * residual;
        let mut at = 0;
        for (i, &d) in derivatives.iter().enumerate() {
            self.gradient[i] += d * residual;
            for &e in &derivatives[i..] {
                self.upper[at] += d * e;
                at += 1;
            }
        }
    }

    fn part(&mut self, residuals: &[f64], which: &[usize], columns: &[&[f64]]) {
        debug_assert_eq!(which.len(), columns.len());
        self.residuals += residuals.len();
        self.sum_of_squares += dot(residuals, residuals);
        for (a, (&i, column)) in which.iter().zip(columns).enumerate() {
            self.gradient[i] += dot(column, residuals);
            for (&j, other) in which[a..].iter().zip(&columns[a..]) {
                let (i, j) = (i.min(j), i.max(j));
                // Row i of the upper triangle begins, at its diagonal, after i rows of falling length.
                let row = i * (2 * self.parameters - i + 1) / 2;
                self.upper[row + j - i] += dot(column, other);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_blocks_give_the_same_sums() {
        let n = 37;
        let x: Vec<f64> = (0..n).map(|k| (k as f64 * 0.37).sin()).collect();
        let y: Vec<f64> = (0..n).map(|k| (k as f64 * 0.11).cos()).collect();
        let r: Vec<f64> = (0..n).map(|k| k as f64 * 0.01 - 0.2).collect();
        let (mut by_row, mut by_block) = (Normal::new(4), Normal::new(4));
        for k in 0..n {
            let (z, u) = if k < 20 { (0.0, r[k] - x[k]) } else { (x[k] * y[k], 0.0) };
            by_row.row(r[k], &[x[k], z, y[k], u]);
        }
        let z: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x * y).collect();
        let u: Vec<f64> = r.iter().zip(&x).map(|(r, x)| r - x).collect();
        by_block.part(&r[..20], &[0, 2, 3], &[&x[..20], &y[..20], &u[..20]]);
        by_block.block(&r[20..], &[&x[20..], &z[20..], &y[20..], &[0.0; 17]]);
        assert!((by_row.matrix() - by_block.matrix()).amax() < 1e-12);
        assert!((by_row.gradient() - by_block.gradient()).amax() < 1e-12);
        assert_eq!(by_row.residuals(), by_block.residuals());
    }
}
