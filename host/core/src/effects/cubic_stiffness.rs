//! Hardening (k3 > 0) or softening, - k3 b^3.

use super::law::{any, enters, moment, Card, Law, Parameter, RollTerm, Scale, Series};
use crate::record::Called;

pub(super) struct CubicStiffness;

impl Law for CubicStiffness {
    fn id(&self) -> &'static str {
        "cubic_stiffness"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("k3", "1/(rad2 s2)")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness() / scale.amplitude_rad.powi(2)]
    }

    enters!(moment);

    fn series(&self) -> Option<Series> {
        Some(Series::Term)
    }

    fn roll_term(&self) -> Option<RollTerm> {
        Some(RollTerm::StiffnessCubed)
    }

    fn derivative(&self) -> Option<(&'static str, f64)> {
        Some(("Cn_beta3", -1.0))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Hardening or softening restoring moment",
            formula: "- k3 b^3",
            cause: "springs pulled out of line at large yaw, stops, a yaw moment that bends with sideslip",
            fingerprint: "natural frequency changes with the square of amplitude; no mid-line shift",
            confirm: "static moment against angle; with the wind off it is the springs'",
            remove: "longer springs, smaller amplitude",
            release: "a larger amplitude",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "weight, whose moment goes with the sine of the angle: k3 = -wn^2 / 6",
                confirm: "compare k3 with -wn^2 / 6: so much is weight",
                remove: "nothing where it is weight; at small amplitudes it does not show",
                ..card
            },
            Called::Roll => Card {
                cause: "a righting arm that bends with heel",
                confirm: "hydrostatics: the curve of righting arms at this displacement",
                remove: "nothing: it is the ship's; at small angles it does not show",
                ..card
            },
            Called::Displacement => Card {
                cause: "a spring beyond its straight range, a string or membrane that stretches",
                confirm: "static force against displacement",
                remove: "a longer spring, a smaller amplitude",
                ..card
            },
            _ => card,
        }
    }
}

moment!(CubicStiffness, [k3], |b, _, _, _| -b * b * (k3 * b));

#[cfg(test)]
mod tests {
    use super::super::terms::Moment;
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn is_the_cube_of_the_angle() {
        let (state, moment) = (at(-0.1, 0.3), 2.0 * 0.001);
        assert!((CubicStiffness::moment(&[2.0], &state) - moment).abs() < 1e-15);
    }
}
