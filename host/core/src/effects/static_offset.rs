//! A constant moment, + m.

use super::law::{numbers, any, Card, Equation, Law, Parameter, Scale};
use crate::record::Called;
use super::terms::Terms;

pub(super) struct StaticOffset;

impl Law for StaticOffset {
    fn id(&self) -> &'static str {
        "static_offset"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("m", "rad/s2")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness() * scale.amplitude_rad]
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        let [m] = numbers(p);
        terms.constant_moment_rad_s2 += m;
    }

    fn moves_rest(&self) -> bool {
        true
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment("m"))
    }

    fn derivative(&self) -> Option<(&'static str, f64)> {
        Some(("Cn_0", 1.0))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Constant moment",
            formula: "+ m",
            cause: "crooked flow, a bent spring, a model that is not symmetric; or a sensor that was not zeroed",
            fingerprint: "the model swings about another angle than the sensor's zero, the same at every amplitude",
            confirm: "reading at rest with the wind off and on: a sensor not zeroed shows it in both, on every spring",
            remove: "zero the sensor with the wind off, align the springs",
            release: "wind off, and another spring: a moment's offset falls with stiffness, the sensor's stays",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a cable that pulls, a pendulum out of balance; or a sensor that was not zeroed",
                confirm: "reading at rest with the cable off: a sensor not zeroed shows it still",
                remove: "zero the sensor at rest, lead the cable along the axis",
                release: "one with more weight: a moment's offset falls, the sensor's stays",
                ..card
            },
            Called::Roll => Card {
                cause: "a list; or a sensor that was not zeroed",
                confirm: "the draughts on both sides at rest: a sensor not zeroed shows it with none",
                remove: "zero the sensor at rest, trim it upright",
                release: "one with ballast moved across: a list changes, the sensor's offset stays",
                ..card
            },
            Called::Displacement => Card {
                cause: "a constant force; or a sensor that was not zeroed",
                confirm: "reading at rest without the force: a sensor not zeroed shows it still",
                remove: "zero the sensor at rest",
                release: "another spring: a force's offset falls with stiffness, the sensor's stays",
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
        StaticOffset.write(&[0.3], &mut terms);
        assert_eq!(terms.constant_moment_rad_s2, 0.3);
        assert_eq!(terms.smooth_moment(&at(0.1, 0.2), 0.0), 0.0);
    }
}
