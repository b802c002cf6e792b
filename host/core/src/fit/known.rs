//! What is known of a fit's numbers from elsewhere.

use crate::fit::fitted::Fitted;
use crate::fit::structure::WN;
use nalgebra::DVector;

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

    /// Given that the number `name` is known to be so many of its standard uncertainties (`k`) from zero, if it
    /// is not: what else is less known for not knowing it is known better, too.
    pub(crate) fn known_from_zero(mut self, name: &str, k: f64) -> Self {
        let number = self.published().find(|p| p.name == name);
        let (Some(number), Some(covariance)) = (number, &mut self.covariance) else { return self };
        let by_clock = number.value * number.seconds * self.around.rate_u;
        // Not brought back by rounding.
        let known = (1.0 - 1e-9) * (number.value / k).powi(2) - by_clock.powi(2);
        let known = known / self.inflation;
        let row = DVector::from_vec(number.row);
        let with_it = &*covariance * &row;
        let variance = row.dot(&with_it);
        if known > 0.0 && variance > known {
            *covariance -= &with_it * with_it.transpose() * ((variance - known) / variance.powi(2));
        }
        self
    }
}
