//! When residuals are no more than noise, and how much noise there is.

use crate::statistics::{correlation, independent_share};

/// Residual over the noise beyond which it is more than noise, whose floor is known to some six per cent.
pub(crate) const ABOVE_NOISE: f64 = 1.1;

/// Sum of squares over the noise of so many residuals that is no more than noise: no further start is tried.
pub fn enough(count: usize) -> f64 {
    ABOVE_NOISE * ABOVE_NOISE * count as f64
}

/// Mean square of residuals over the noise, each counted as one of as many as are independent; noise at least.
pub(super) fn level(residuals: &[f64]) -> f64 {
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let share = independent_share(correlation(&[residuals.to_vec()]));
    (squares / residuals.len().max(1) as f64 / share).max(1.0)
}
