//! Steps within bounds.

use nalgebra::{Cholesky, DMatrix, DVector};

/// The step down a quadratic of this `matrix` and `gradient` (half its slope) that keeps within the `bounds`
/// of each part's step: what would pass a bound stays at it, and the others step as suits that. `None` where
/// the matrix is not positive definite.
pub(crate) fn step_within(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    bounds: &dyn Fn(usize) -> (f64, f64),
) -> Option<DVector<f64>> {
    let n = gradient.len();
    let at_bound = |k: usize| {
        let (low, high) = bounds(k);
        (low >= 0.0 && gradient[k] > 0.0 || high <= 0.0 && gradient[k] < 0.0).then_some(0.0)
    };
    let mut held: Vec<Option<f64>> = (0..n).map(at_bound).collect();
    loop {
        let open: Vec<usize> = (0..n).filter(|&k| held[k].is_none()).collect();
        let mut step = DVector::from_fn(n, |k, _| held[k].unwrap_or(0.0));
        let part = matrix.select_rows(&open).select_columns(&open);
        let right = (gradient + matrix * &step).select_rows(&open);
        let solved = Cholesky::new(part)?.solve(&right);
        open.iter().zip(solved.iter()).for_each(|(&k, x)| step[k] = -x);
        let mut passed = false;
        for &k in &open {
            let (low, high) = bounds(k);
            if step[k] < low || step[k] > high {
                held[k] = Some(step[k].clamp(low.min(0.0), high.max(0.0)));
                passed = true;
            }
        }
        if !passed {
            return Some(step);
        }
    }
}
