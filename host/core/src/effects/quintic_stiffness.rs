//! Hardening (k5 > 0) or softening that sets in late, - k5 b^5.

use super::law::{any, enters, moment, Card, Law, Parameter, RollTerm, Scale, Series};
use crate::record::Called;

pub(super) struct QuinticStiffness;

impl Law for QuinticStiffness {
    fn id(&self) -> &'static str {
        "quintic_stiffness"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("k5", "1/(rad4 s2)")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness() / scale.amplitude_rad.powi(4)]
    }

    enters!(moment);

    fn series(&self) -> Option<Series> {
        Some(Series::HigherTerm)
    }

    fn roll_term(&self) -> Option<RollTerm> {
        Some(RollTerm::StiffnessFifth)
    }

    fn derivative(&self) -> Option<(&'static str, f64)> {
        Some(("Cn_beta5", -1.0))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Restoring moment that hardens or softens late",
            formula: "- k5 b^5",
            cause: "springs pulled far out of line, soft stops, a yaw moment that stalls; beside cubic stiffness, its next term",
            fingerprint: "natural frequency changes with the fourth power of amplitude; no mid-line shift",
            confirm: "static moment against angle: straight at first, then steeper than the cube",
            remove: "longer springs, smaller amplitude",
            release: "a larger amplitude, where it differs from the cube",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "weight's next term beside cubic stiffness, a soft stop",
                remove: "move the stop out; at small amplitudes it does not show",
                ..card
            },
            Called::Roll => Card {
                cause: "the righting arm's next term beside cubic stiffness, the deck edge under water",
                confirm: "hydrostatics: the curve of righting arms at this displacement",
                remove: "nothing: it is the ship's; at small angles it does not show",
                ..card
            },
            Called::Displacement => Card {
                cause: "a spring far beyond its straight range, a soft stop",
                confirm: "static force against displacement: straight at first, then steeper than the cube",
                remove: "a longer spring, a smaller amplitude",
                ..card
            },
            _ => card,
        }
    }
}

moment!(QuinticStiffness, [k5], |b, _, _, _| -k5 * (b * b) * (b * b) * b);

#[cfg(test)]
mod tests {
    use super::super::terms::Moment;
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn is_the_fifth_power_of_the_angle() {
        assert!((QuinticStiffness::moment(&[2.0], &at(-0.1, 0.3)) - 2.0e-5).abs() < 1e-18);
    }
}
