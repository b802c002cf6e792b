//! A value with its standard uncertainty.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A value and its standard uncertainty u (k = 1), both in the unit the field's name states.
///
/// ```
/// use yawrig_core::quantity::Quantity;
///
/// let cn_beta = Quantity::new(0.53214, 0.0017);
/// assert_eq!(cn_beta.to_string(), "0.5321 ± 0.0017");
/// assert!(cn_beta.holds(0.535, 2.0) && !cn_beta.holds(0.54, 2.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// Best estimate.
    pub value: f64,
    /// Standard uncertainty (k = 1); infinite or not a number where nothing is known.
    pub u: f64,
}

/// Standard uncertainties that chance explains.
pub(crate) const CHANCE: f64 = 3.0;

impl Quantity {
    /// `value` with its standard uncertainty, of the same unit.
    pub fn new(value: f64, u: f64) -> Self {
        Self { value, u }
    }

    /// A value taken as known.
    pub fn exact(value: f64) -> Self {
        Self { value, u: 0.0 }
    }

    /// Whether the data say something about it. By chance an estimate comes as near to zero as a millionth of
    /// its uncertainty once in a million times: one that does was not moved from where it began. Exactly zero
    /// is a bound.
    pub fn is_determined(&self) -> bool {
        self.value == 0.0 || !self.u.is_finite() || self.u < 1e6 * self.value.abs()
    }

    /// Whether its uncertainty is: there is one, and it is finite.
    pub(crate) fn is_known(&self) -> bool {
        self.u > 0.0 && self.u.is_finite()
    }

    /// In another unit: `scaled` multiplies by what it is of that.
    pub(crate) fn by(self, scaled: impl Fn(f64) -> f64) -> Self {
        Self { value: scaled(self.value), u: scaled(self.u) }
    }

    /// As a record says it whose clock's rate has the standard uncertainty `rate_u`, a share of it: of a unit in
    /// which a second has the power `seconds`.
    pub(crate) fn on_clock(self, rate_u: f64, seconds: f64) -> Self {
        Self { u: self.u.hypot(self.value * seconds * rate_u), ..self }
    }

    /// Whether `truth` lies within `k` standard uncertainties.
    pub fn holds(&self, truth: f64, k: f64) -> bool {
        (truth - self.value).abs() <= k * self.u
    }
}

/// A range from its lowest to its highest value, in steps of a hundredth to a tenth of its width; none where it
/// is one value.
///
/// ```
/// use yawrig_core::quantity::range_in_words;
///
/// assert_eq!(range_in_words([0.00734, 0.02581]).as_deref(), Some("0.007 to 0.026"));
/// assert_eq!(range_in_words([9.434, 9.741]).as_deref(), Some("9.43 to 9.74"));
/// assert_eq!(range_in_words([0.0251, 0.0251]), None);
/// ```
pub fn range_in_words([low, high]: [f64; 2]) -> Option<String> {
    let digits = (2.0 - (high - low).log10()).floor().clamp(0.0, 12.0) as usize;
    (low < high).then(|| format!("{low:.digits$} to {high:.digits$}"))
}

/// Mean weighted by 1/u^2 of those whose uncertainty is known, of one value that value to the bit; `None`
/// where nothing is known.
pub(crate) fn weighted_mean(values: impl IntoIterator<Item = Quantity>) -> Option<Quantity> {
    let mut known = values.into_iter().filter(Quantity::is_known);
    let first = known.next()?;
    let (mut weights, mut off) = (1.0 / (first.u * first.u), 0.0);
    let mut u = first.u;
    for q in known {
        let w = 1.0 / (q.u * q.u);
        weights += w;
        off += w * (q.value - first.value);
        u = weights.sqrt().recip();
    }
    Some(Quantity::new(first.value + off / weights, u))
}

/// Squared distances from `mean` over the uncertainties, of those whose uncertainty is known.
pub(crate) fn chi_squared(values: impl IntoIterator<Item = Quantity>, mean: f64) -> f64 {
    let known = values.into_iter().filter(Quantity::is_known);
    known.map(|q| ((q.value - mean) / q.u).powi(2)).sum()
}

/// The value to the second significant digit of its uncertainty, then the uncertainty: `0.5321 ± 0.0017`; one
/// that is not a number, as of a parameter at its bound, is unknown; a value that the data say nothing about
/// is not determined.
impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let decimals = if self.is_known() {
            // Of the uncertainty as it is shown: 0.0000996 is 0.00010.
            let shown: f64 = format!("{:.1e}", self.u).parse().unwrap_or(self.u);
            (1 - shown.log10().floor() as i32).clamp(0, 12) as usize
        } else {
            f.precision().unwrap_or(6)
        };
        let text = if !self.is_determined() {
            format!("not determined (u {:.0e})", self.u)
        } else if self.u.is_nan() {
            format!("{:.decimals$} (uncertainty unknown)", self.value)
        } else {
            format!("{:.decimals$} ± {:.decimals$}", self.value, self.u)
        };
        // Not by `pad`, which takes a precision for the most characters to show.
        write!(f, "{text:>width$}", width = f.width().unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shown_to_two_digits_of_the_uncertainty() {
        assert_eq!(Quantity::new(0.532_143, 0.001_71).to_string(), "0.5321 ± 0.0017");
        assert_eq!(Quantity::new(-0.089_807, 0.000_099_6).to_string(), "-0.08981 ± 0.00010");
        assert_eq!(format!("{:>16}", Quantity::new(0.5, 0.25)), "     0.50 ± 0.25");
        assert_eq!(Quantity::new(-12.0, 3.0).to_string(), "-12.0 ± 3.0");
        assert_eq!(format!("{:.2}", Quantity::exact(1.0)), "1.00 ± 0.00");
        assert_eq!(format!("{:.2}", Quantity::new(1.0, f64::NAN)), "1.00 (uncertainty unknown)");
    }

    #[test]
    fn a_value_far_within_its_uncertainty_is_not_determined() {
        assert_eq!(Quantity::new(12.3, 366_186_469.0).to_string(), "not determined (u 4e8)");
        assert_eq!(Quantity::new(0.0, 0.02).to_string(), "0.000 ± 0.020");
        assert_eq!(Quantity::new(1e-4, 0.02).to_string(), "0.000 ± 0.020");
    }

    #[test]
    fn json_is_value_and_u() {
        let json = serde_json::to_string(&Quantity::new(1.5, 0.25)).unwrap();
        assert_eq!(json, r#"{"value":1.5,"u":0.25}"#);
    }
}
