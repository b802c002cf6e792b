//! A restoring moment stiffer to one side, - k2 b^2.

use super::law::{any, enters, moment, Card, Law, Parameter, Scale};
use crate::record::Called;

pub(super) struct QuadraticStiffness;

impl Law for QuadraticStiffness {
    fn id(&self) -> &'static str {
        "quadratic_stiffness"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("k2", "1/(rad s2)")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness() / scale.amplitude_rad]
    }

    enters!(moment);

    fn derivative(&self) -> Option<(&'static str, f64)> {
        Some(("Cn_beta2", -1.0))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Restoring moment stiffer to one side",
            formula: "- k2 b^2",
            cause: "springs of unlike stiffness or preload, an asymmetric model",
            fingerprint: "mid-line moves with the square of amplitude; a second harmonic",
            confirm: "release to the other side: the mid-line moves the same way",
            remove: "match the springs and their preload",
            release: "one to the other side, and one with another spring: a curved sensor scale keeps its size",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a cable, spring or magnet that pulls to one side",
                remove: "lead the cable along the axis, take away what pulls",
                release: "one to the other side, and one with more weight: a curved sensor scale keeps its size",
                ..card
            },
            Called::Roll => Card {
                cause: "a list, a hull or load that is not symmetric",
                remove: "trim it upright",
                release: "one to the other side, and one with ballast moved: a curved sensor scale keeps its size",
                ..card
            },
            Called::Displacement => Card {
                cause: "a spring that is stiffer one way than the other",
                remove: "springs to both sides, alike and preloaded",
                ..card
            },
            _ => card,
        }
    }
}

moment!(QuadraticStiffness, [k2], |b, _, _, _| -b * b * k2);

#[cfg(test)]
mod tests {
    use super::super::terms::Moment;
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn pulls_to_one_side() {
        let (state, moment) = (at(-0.1, 0.3), -2.0 * 0.01);
        assert!((QuadraticStiffness::moment(&[2.0], &state) - moment).abs() < 1e-15);
    }
}
