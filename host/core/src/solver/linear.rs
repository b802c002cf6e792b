//! Linear least squares with few unknowns.

use nalgebra::{SMatrix, SVector};

/// The coefficients c for which the sum of (y - row c)^2 over all `(row, y)` is least; `None` where the rows
/// do not determine them.
///
/// ```
/// use yawrig_core::solver::linear_fit;
///
/// let rows = [1.0, 2.0, 4.0].map(|x: f64| ([x, 1.0], 3.0 * x - 2.0));
/// let [slope, at_zero] = linear_fit(rows).unwrap();
/// assert!((slope - 3.0).abs() < 1e-12 && (at_zero + 2.0).abs() < 1e-12);
/// assert_eq!(linear_fit([([1.0, 1.0], 1.0)]), None);
/// ```
pub fn linear_fit<const N: usize>(
    rows: impl IntoIterator<Item = ([f64; N], f64)>,
) -> Option<[f64; N]> {
    let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    for (row, y) in rows {
        let row = SVector::from(row);
        normal += row * row.transpose();
        right += row * y;
    }
    Some(normal.cholesky()?.solve(&right).into())
}
