//! Weight about an axis that is not vertical, + g (b - sin b); g = wn^2 for a pendulum and nothing else.

use super::law::{any, enters, moment, sin, Card, Law, Parameter, Scale, Series};
use crate::record::Called;

pub(super) struct PendulumGravity;

impl Law for PendulumGravity {
    fn id(&self) -> &'static str {
        "pendulum_gravity"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("g", "1/s2")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![6.0 * scale.stiffness() / scale.amplitude_rad.powi(2).min(1.0)]
    }

    enters!(moment);

    fn is_of_angle(&self) -> bool {
        true
    }

    fn series(&self) -> Option<Series> {
        Some(Series::Whole)
    }

    /// Below, a sine is a cube.
    fn distinct_from_rad(&self) -> f64 {
        0.4
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Pendulum",
            formula: "+ g (b - sin b)",
            cause: "an axis that is not vertical, so that weight swings as on a pendulum",
            fingerprint: "frequency falls with amplitude as a pendulum's does; no even harmonics",
            confirm: "level the axis, or turn the rig: it changes with the axis's tilt",
            remove: "make the axis vertical, or balance the model about it",
            release: "a larger amplitude, where a sine differs from a cube",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "its weight, whose moment goes with the sine of the angle",
                confirm: "compare g with wn^2: of a pendulum and nothing else they are equal",
                remove: "nothing: it is what a pendulum does; at small amplitudes it does not show",
                ..card
            },
            Called::Roll => Card {
                cause: "a righting arm that goes with the sine of heel, as a round hull's",
                confirm: "hydrostatics: the curve of righting arms at this displacement",
                remove: "nothing: it is the ship's; at small angles it does not show",
                ..card
            },
            Called::Displacement => Card {
                cause: "weight on an arm that turns with the displacement",
                confirm: "load the arm: it changes with the load",
                remove: "balance the arm, or make it longer",
                ..card
            },
            _ => card,
        }
    }
}

moment!(PendulumGravity, [g], |b, _, _, _| g * (b - sin(b)));

#[cfg(test)]
mod tests {
    use super::super::terms::Moment;
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn takes_the_weights_moment_from_the_angle_to_its_sine() {
        let moment = PendulumGravity::moment(&[2.0], &at(0.5, 0.3));
        assert!((moment - 2.0 * (0.5 - 0.5f64.sin())).abs() < 1e-15);
    }
}
