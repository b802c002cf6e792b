//! Blocks of data that share numbers, each with a state of its own, which is eliminated from the normal equations
//! block by block (a Schur complement; of multiple shooting: H. G. Bock, 1983): many blocks cost what one of their
//! length costs.

use super::{step_within, Normal};
use nalgebra::{DMatrix, DVector, Matrix2};

/// A block's residuals as sums, over the free shared numbers and, last, its state.
pub(crate) struct Block {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
}

/// A block's sum of squares as a quadratic of the free shared numbers, its state eliminated.
pub(crate) struct Quadratic {
    pub(crate) matrix: DMatrix<f64>,
    /// Half the slope.
    pub(crate) gradient: DVector<f64>,
    pub(crate) squares: f64,
}

/// `matrix` with a larger diagonal, inverted.
pub(crate) fn damped_inverse(mut matrix: Matrix2<f64>, damping: f64) -> Option<Matrix2<f64>> {
    matrix[(0, 0)] *= 1.0 + damping;
    matrix[(1, 1)] *= 1.0 + damping;
    matrix.try_inverse()
}

impl Block {
    /// `None` where the sums are not finite.
    pub(crate) fn new(normal: &Normal) -> Option<Self> {
        normal.is_finite().then(|| Self {
            matrix: normal.matrix(),
            gradient: normal.gradient(),
            squares: normal.sum_of_squares(),
        })
    }

    pub(crate) fn squares(&self) -> f64 {
        self.squares
    }

    /// How many shared numbers there are.
    fn shared(&self) -> usize {
        self.gradient.len() - 2
    }

    fn inverse_of_state(&self, damping: f64) -> Matrix2<f64> {
        let n = self.shared();
        let own = self.matrix.fixed_view::<2, 2>(n, n).into_owned();
        damped_inverse(own, damping).unwrap_or_else(Matrix2::zeros)
    }

    /// Matrix and gradient of the shared numbers with the state eliminated.
    fn reduced(&self, damping: f64) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.shared();
        let inverse = self.inverse_of_state(damping);
        let c = self.matrix.view((0, n), (n, 2)).into_owned();
        (
            self.matrix.view((0, 0), (n, n)) - &c * inverse * c.transpose(),
            self.gradient.rows(0, n) - &c * (inverse * self.gradient.rows(n, 2)),
        )
    }

    pub(crate) fn quadratic(&self) -> Quadratic {
        let (matrix, gradient) = self.reduced(0.0);
        let slope = self.gradient.rows(self.shared(), 2);
        let gained = (slope.transpose() * self.inverse_of_state(0.0) * slope)[(0, 0)];
        Quadratic { matrix, gradient, squares: self.squares - gained }
    }
}

/// A step of all blocks.
pub(crate) struct BlockStep {
    /// Of the free shared numbers.
    pub(crate) shared: DVector<f64>,
    pub(crate) states: Vec<[f64; 2]>,
    /// By how much the squares fall with it if all is linear.
    pub(crate) promised: f64,
}

/// The damped step that keeps the shared numbers' steps within these `bounds`; none where the damping is too small
/// for one.
pub(crate) fn step(
    blocks: &[Block],
    damping: f64,
    bounds: &dyn Fn(usize) -> (f64, f64),
) -> Option<BlockStep> {
    let n = blocks[0].shared();
    let (mut a, mut g, mut slope) = (DMatrix::zeros(n, n), DVector::zeros(n), DVector::zeros(n));
    for block in blocks {
        let (matrix, gradient) = block.reduced(damping);
        a += matrix;
        g += gradient;
        slope += block.gradient.rows(0, n);
    }
    for k in 0..n {
        let own = a[(k, k)];
        // A little of it keeps the matrix definite.
        a[(k, k)] += damping * own.max(1e-30) + 1e-12 * own;
    }
    let shared = step_within(&a, &g, bounds)?;
    let mut promised = 0.0;
    let state = |block: &Block| {
        let slope = block.gradient.rows(n, 2);
        let right = slope + block.matrix.view((0, n), (n, 2)).transpose() * &shared;
        let step = block.inverse_of_state(damping) * right;
        promised += step.dot(&slope);
        [-step[0], -step[1]]
    };
    let states = blocks.iter().map(state).collect();
    promised -= shared.dot(&slope);
    Some(BlockStep { shared, states, promised })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::Rows;

    /// Two blocks of three shared numbers: the step is that of all numbers at once, and each block's quadratic is
    /// the least over its state.
    #[test]
    fn eliminated_states_step_as_all_numbers_at_once_do() {
        let number = |k: usize, j: usize| ((17 * k + 5 * j * j + k * j) as f64 * 0.37).sin();
        let row = |k: usize| -> Vec<f64> { (0..5).map(|j| number(k, j)).collect() };
        let residual = |k: usize| (k as f64 * 1.3).cos();
        let (mut all, mut each) = (Normal::new(7), [Normal::new(5), Normal::new(5)]);
        for k in 0..40 {
            let (block, own) = (k / 20, row(k));
            each[block].row(residual(k), &own);
            let mut of_all = [own[0], own[1], own[2], 0.0, 0.0, 0.0, 0.0];
            of_all[3 + 2 * block..5 + 2 * block].copy_from_slice(&own[3..]);
            all.row(residual(k), &of_all);
        }
        let blocks = each.each_ref().map(|normal| Block::new(normal).unwrap());
        let found = step(&blocks, 0.0, &|_| (f64::NEG_INFINITY, f64::INFINITY)).unwrap();
        let expected = -all.matrix().cholesky().unwrap().solve(&all.gradient());
        let states = found.states.as_flattened();
        for (found, expected) in found.shared.iter().chain(states).zip(expected.iter()) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        assert!((found.promised + expected.dot(&all.gradient())).abs() < 1e-9);
        let left = |block: &Block| {
            let Quadratic { matrix, gradient, squares } = block.quadratic();
            squares
                + 2.0 * gradient.dot(&found.shared)
                + found.shared.dot(&(matrix * &found.shared))
        };
        let after: f64 = blocks.iter().map(left).sum();
        assert!((all.sum_of_squares() - found.promised - after).abs() < 1e-9);
    }
}
