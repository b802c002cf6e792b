//! By how much the numbers of a fit may be off because no model is the rig: the law discrepancy, and a moment
//! in time ([`random`]).
//!
//! Beside its effects the true equation of motion has a smooth moment that no effect of the model is,
//!
//! b'' = ... - wn^2 A sum_i delta_i f_i((b - rest) / A, r / (wn A)),   delta_i ~ N(0, tau^2 / order_i^2),
//!
//! A being the largest amplitude. Shapes f_i of the restoring moment have a flat tangent at rest, so that wn
//! stays that of small motions; of the dissipation one is the jump of dry friction, the others have a flat
//! tangent, too. Their size tau, one for stiffness and one for damping, is what makes the residual likeliest
//! (its evidence, the numbers of the model and the strengths integrated out: M. C. Kennedy, A. O'Hagan, J. R.
//! Stat. Soc. B 63, 2001), residuals counted by the correlation of what is then left of them. Least squares
//! knows nothing of it: a strength delta puts an error (J'J)^-1 J'Phi delta into its numbers, Phi being the
//! readings' derivatives by the strengths. Each combination of strengths that the residual tells from the
//! others, whatever the shapes they are written in, counts as an error as large as the residual shows it, of
//! a sign that is not known; the noise adds what is left of the residual. Where the residual is noise there
//! is no discrepancy, and nothing is added; where a random moment is the likelier cause there is no law.
//!
//! With the strengths' whole prior in place of what is seen of them, uncertainties come out several times too
//! wide: shapes that an effect of the model imitates are seen by nothing.

mod random;
mod shapes;
mod sums;
mod swing;

use self::random::Shaken;
pub(crate) use self::shapes::{add_shape, responses, SHAPES};
pub use self::sums::enough;
use self::sums::{Likeliest, Sums};
pub(crate) use self::sums::{Observed, ABOVE_NOISE};
pub(crate) use self::swing::Swing;
use crate::statistics::{correlation, independent_share};
use nalgebra::{DMatrix, DVector};

/// What is not in the model, as far as the residual shows how large it is.
#[derive(Clone, Debug)]
pub(crate) struct Discrepancy {
    /// Strengths of the shapes, shares of the spring's moment at the largest amplitude: a column for each
    /// combination of shapes that the residual tells from the others.
    pub(crate) strengths: DMatrix<f64>,
    /// Derivatives of the fitted numbers by the strengths: a row for each number of the fit, a column for
    /// each shape.
    pub(crate) shift: DMatrix<f64>,
    /// Covariance that a random moment beside the model puts into the fitted numbers.
    pub(crate) random: DMatrix<f64>,
    /// Variance of what is left of the residuals over the noise, each counted as one of so many independent.
    pub(crate) left: f64,
}

impl Discrepancy {
    /// The covariance that it adds to the fitted numbers.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        self.of_law() + &self.random
    }

    /// What of it the smooth moment adds.
    pub(crate) fn of_law(&self) -> DMatrix<f64> {
        let moved = &self.shift * &self.strengths;
        &moved * moved.transpose()
    }

    /// That of one of several releases, whose numbers have these `places` among all.
    pub(crate) fn of_release(&self, places: &[usize]) -> Self {
        let random = self.random.select_rows(places).select_columns(places);
        Self { shift: self.shift.select_rows(places), random, ..self.clone() }
    }

    /// Whether there is a smooth moment.
    pub(crate) fn has_law(&self) -> bool {
        self.strengths.iter().any(|v| *v != 0.0)
    }
}

/// What a model of so many `numbers`, fitted to `releases`, lacks; `may_be_noise`: all that is left. `None`
/// where it lacks nothing that shows: too few residuals as well, or numbers that they do not determine.
pub(crate) fn of(releases: &[Observed], numbers: usize, may_be_noise: bool) -> Option<Discrepancy> {
    let sums = Sums::new(releases, numbers)?;
    // Gain of evidence (in ln) above which a discrepancy is believed: half of the difference of BIC that
    // effects need. Where the residual is more than noise something is missing, and the likeliest is taken.
    let needed = if may_be_noise { 0.5 * crate::bic::MARGIN } else { 0.0 };
    // While the correlation of the residuals is not known yet a fifth of them count.
    let first = sums.likeliest(0.2, needed)?;
    let share = independent_share(correlation(&sums.left(releases, &first)));
    let law = sums.likeliest(share, needed)?;
    let none = sums.evidence(DVector::zeros(SHAPES), share)?.1;
    let tried = random::tried(releases, numbers);
    let shaken = |law: &Likeliest| Shaken::of(&tried, &law.deviations, needed);
    let evidence = |s: &Option<Shaken>| s.as_ref().map_or(f64::NEG_INFINITY, |s| s.evidence);
    let (beside_law, alone) = (shaken(&law), shaken(&none));
    let is_law = evidence(&beside_law) >= evidence(&alone);
    let (shaken, best) = if is_law { (beside_law, law) } else { (alone, none) };
    let random = shaken
        .and_then(|shaken| shaken.covariance(releases, &sums.root))
        .unwrap_or_else(|| DMatrix::zeros(numbers, numbers));
    let strengths = sums.apart(&best);
    let found = Discrepancy { strengths, shift: sums.shift, random, left: best.noise / share };
    Some(found).filter(|found| found.has_law() || found.random.iter().any(|v| *v != 0.0))
}

#[cfg(test)]
mod tests;
