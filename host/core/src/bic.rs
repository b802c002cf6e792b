//! The Bayesian information criterion (G. Schwarz, Ann. Statist. 6, 1978), and what of it counts as evidence.
//!
//! BIC = deviance + k ln n for k numbers fitted to n independent residuals; the deviance of white residuals
//! whose variance is fitted, too, is n ln(S/n) with their sum of squares S. A difference of BIC is larger the
//! more a further effect is worth its numbers. Every number that is fitted counts: an effect has as many as
//! it has parameters.

/// Difference of BIC above which an effect is believed: "very strong" in R. E. Kass, A. E. Raftery, J. Am.
/// Stat. Assoc. 90, 1995.
pub const MARGIN: f64 = 10.0;

/// What `numbers` fitted numbers cost against `independent` residuals.
pub(crate) fn cost(numbers: f64, independent: f64) -> f64 {
    numbers * independent.ln()
}

/// BIC of a fit by least squares, from the sum of squares of `independent` residuals.
pub(crate) fn of_squares(sum_of_squares: f64, independent: f64, numbers: usize) -> f64 {
    of_deviance(independent * (sum_of_squares / independent).ln(), independent, numbers)
}

/// BIC of a fit of this deviance (minus twice the logarithm of the likelihood).
pub(crate) fn of_deviance(deviance: f64, independent: f64, numbers: usize) -> f64 {
    deviance + cost(numbers as f64, independent)
}

/// Difference of BIC in favour of a larger model by `more` numbers, from both sums of squares.
///
/// ```
/// // Three hundred residuals, a number more, squares smaller by a fifth: worth it.
/// assert!(yawrig_core::bic::gain(1.25, 1.0, 300.0, 1.0) > yawrig_core::bic::MARGIN);
/// // Smaller by a hundredth: not.
/// assert!(yawrig_core::bic::gain(1.01, 1.0, 300.0, 1.0) < 0.0);
/// ```
pub fn gain(smaller_squares: f64, larger_squares: f64, independent: f64, more: f64) -> f64 {
    independent * (smaller_squares / larger_squares).ln() - cost(more, independent)
}

/// What a fit by least squares puts into a difference of BIC.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// Of the residuals, in their unit squared.
    pub sum_of_squares: f64,
    /// Residuals that count as independent.
    pub independent: f64,
    /// Fitted numbers of the model.
    pub numbers: usize,
}

impl Score {
    /// The difference of BIC in favour of this model, as every command prints it: on the independent
    /// residuals of the better of the two.
    pub fn gain_over(&self, other: &Self) -> f64 {
        let better = if self.sum_of_squares < other.sum_of_squares { self } else { other };
        let more = self.numbers as f64 - other.numbers as f64;
        gain(other.sum_of_squares, self.sum_of_squares, better.independent, more)
    }
}
