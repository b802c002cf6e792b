//! Damping with the square of the rate, - d |r| r.

use super::law::{abs, enters, moment, not_negative, Card, Law, Parameter, RollTerm, Scale};
use crate::record::Called;

pub(super) struct QuadraticDamping;

impl Law for QuadraticDamping {
    fn id(&self) -> &'static str {
        "quadratic_damping"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [not_negative("d", "1/rad")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![1.0 / scale.amplitude_rad]
    }

    enters!(moment);

    fn roll_term(&self) -> Option<RollTerm> {
        Some(RollTerm::Quadratic)
    }

    fn derivative(&self) -> Option<(&'static str, f64)> {
        Some(("Cn_rabsr", -1.0))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Damping with the square of the rate",
            formula: "- d |r| r",
            cause: "separated flow, still-air drag of the model's sides",
            fingerprint: "damping ratio rises in proportion to amplitude; frequency does not change",
            confirm: "release from twice the amplitude: the added damping doubles",
            remove: "shield parts of the rig that are not the model; the model's own drag remains",
            release: "a larger amplitude, where it differs from damping with the square of the angle",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "drag of bob and rod in the air",
                remove: "a smaller or smoother bob of the same weight, a smaller amplitude",
                ..card
            },
            Called::Roll => Card {
                cause: "eddies at bilges, bilge keels and appendages",
                remove: "nothing: it is the ship's; without appendages there is less of it",
                ..card
            },
            Called::Displacement => Card {
                cause: "drag of the body in air or liquid",
                remove: "a smaller or smoother body, a smaller amplitude",
                ..card
            },
            _ => card,
        }
    }
}

moment!(QuadraticDamping, [d], |_, r, _, _| -d * abs(r) * r);

#[cfg(test)]
mod tests {
    use super::super::terms::Moment;
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn takes_out_what_the_square_of_the_rate_says() {
        let (state, moment) = (at(0.1, -0.5), 2.0 * 0.5 * 0.5);
        assert!((QuadraticDamping::moment(&[2.0], &state) - moment).abs() < 1e-15);
    }
}
