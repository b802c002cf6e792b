//! Numbers of records in their units, to be read.

use yawrig_core::record::Measurand;

/// Digits of a number whose size is not known before.
const DIGITS: i32 = 4;

/// `number`: of an angle with so many decimals, of a displacement, which may be of any size, with four
/// digits.
pub fn sized(measurand: &Measurand, number: f64, decimals: usize) -> String {
    if measurand.is_of_angle() || number == 0.0 || !number.is_finite() {
        return format!("{number:.decimals$}");
    }
    let exponent = number.abs().log10().floor() as i32;
    match exponent {
        -5..=6 => format!("{number:.*}", (DIGITS - 1 - exponent).max(0) as usize),
        _ => format!("{number:.*e}", DIGITS as usize - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yawrig_core::record::Derivative;

    #[test]
    fn displacements_have_four_digits_and_angles_their_decimals() {
        let beam = Measurand::linear(Derivative::None, "m");
        let shown = |x| sized(&beam, x, 2);
        assert_eq!([0.001_234_5, 312.34, 2.5e-9].map(shown), ["0.001234", "312.3", "2.500e-9"]);
        assert_eq!(sized(&Measurand::default(), 0.001_234_5, 2), "0.00");
    }
}
