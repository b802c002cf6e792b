//! Dry friction, - c sign(r), which holds the model at r = 0 while the other moments are below c.

use super::law::{numbers, not_negative, Card, Equation, Law, Parameter, RollTerm, Scale};
use crate::record::Called;
use super::terms::Terms;

pub(super) struct CoulombFriction;

impl Law for CoulombFriction {
    fn id(&self) -> &'static str {
        "coulomb_friction"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [not_negative("c", "rad/s2")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness() * scale.amplitude_rad]
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        let [c] = numbers(p);
        terms.rub(c);
    }

    fn sticks(&self) -> bool {
        true
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment("-c * sign(r)"))
    }

    fn roll_term(&self) -> Option<RollTerm> {
        Some(RollTerm::Friction)
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Dry friction",
            formula: "- c sign(r); sticks at r = 0 while the other moment is below c",
            cause: "bearing seals, a rubbing cable, the potentiometer's wiper",
            fingerprint: "damping rises as 1/amplitude; peaks fall along a straight line; stops off centre",
            confirm: "release with the wind off: it stays the same; it is the same on every spring",
            remove: "free or replace the bearing, lead the cable along the axis, use a contactless sensor",
            release: "a smaller amplitude, where friction dominates",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a bearing or knife edge that rubs, the sensor's wiper or cable",
                confirm: "add weight: what rubs under load grows with it",
                remove: "a knife edge, a flexure or a free bearing, a contactless sensor",
                ..card
            },
            Called::Roll => Card {
                cause: "a guide or tether that rubs, the bearing of a roll gauge",
                confirm: "let it roll free of guide and gauge, with a gyroscope on board",
                remove: "free the guide, measure with a gyroscope on board",
                ..card
            },
            Called::Displacement => Card {
                cause: "a guide or slide that rubs, the sensor's wiper",
                confirm: "press on the guide: it grows with the force",
                remove: "a flexure or an air guide, a contactless sensor",
                ..card
            },
            _ => card,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn it_is_left_to_the_integration() {
        let mut terms = Terms::default();
        CoulombFriction.write(&[0.3], &mut terms);
        assert_eq!(terms.dry_friction_rad_s2, 0.3);
        assert_eq!(terms.smooth_moment(&at(0.1, 0.2), 0.0), 0.0);
    }
}
