//! What is known of a fit's numbers from elsewhere.

use crate::fit::fitted::Fitted;
use crate::fit::structure::WN;
use nalgebra::{DMatrix, DVector};

/// What is left of the variance of a number that is `k` of its standard uncertainties from zero: not brought back by
/// rounding.
pub(super) fn from_zero(value: f64, k: f64) -> f64 {
    (1.0 - 1e-9) * (value / k).powi(2)
}

/// Makes the number that has this `row` of derivatives known to a variance, if it is not, and conditions all others on
/// that.
pub(super) fn know(covariance: &mut DMatrix<f64>, row: &DVector<f64>, known: f64) {
    let with_it = &*covariance * row;
    let variance = row.dot(&with_it);
    if known > 0.0 && variance > known {
        *covariance -= &with_it * with_it.transpose() * ((variance - known) / variance.powi(2));
    }
}

impl Fitted {
    /// With standard uncertainties of numbers that were not fitted but were known before, in the order of
    /// [`Self::parameters`]; what they have in common is not known.
    pub fn knowing(mut self, u: &[f64]) -> Self {
        let inflation = self.inflation;
        if let Some(covariance) = &mut self.covariance {
            for (j, u) in u.iter().enumerate().filter(|(j, _)| *j < self.parameters.len()) {
                if covariance[(j, j)] == 0.0 {
                    covariance[(j, j)] = u * u / inflation;
                    if j == WN {
                        // What was known has its own clock in it.
                        self.around.rate_u = 0.0;
                    }
                }
            }
        }
        self
    }

    /// With the number `name` at least `k` of its standard uncertainties from zero, and all others conditioned on
    /// that.
    pub(crate) fn known_from_zero(mut self, name: &str, k: f64) -> Self {
        let number = self.published().find(|p| p.name == name);
        let (Some(number), Some(covariance)) = (number, &mut self.covariance) else { return self };
        let by_clock = number.value * number.seconds * self.around.rate_u;
        let known = (from_zero(number.value, k) - by_clock.powi(2)) / self.inflation;
        know(covariance, &DVector::from_vec(number.row), known);
        self
    }
}
