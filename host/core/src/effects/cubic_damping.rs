//! Damping with the square of the angle, - c b^2 r.

use super::law::{any, enters, moment, Card, Law, Parameter, RollTerm, Scale};
use crate::record::Called;

pub(super) struct CubicDamping;

impl Law for CubicDamping {
    fn id(&self) -> &'static str {
        "cubic_damping"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("c", "1/(rad2 s)")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.natural_frequency_rad_s / scale.amplitude_rad.powi(2)]
    }

    enters!(moment);

    fn takes_energy_out(&self) -> bool {
        true
    }

    fn roll_term(&self) -> Option<RollTerm> {
        Some(RollTerm::AngleSquared)
    }

    fn derivative(&self) -> Option<(&'static str, f64)> {
        Some(("Cn_betabetar", -1.0))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Damping with the square of the angle",
            formula: "- c b^2 r",
            cause: "yaw moment derivative that changes with sideslip, stall at large yaw",
            fingerprint: "damping ratio rises (c > 0) or falls with the square of amplitude",
            confirm: "compare releases with the wind on and off: with the wind off it goes",
            remove: "stay at small amplitudes",
            release: "a larger amplitude, where it differs from damping with the rate's square",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a bearing or damper that takes more at large angles",
                confirm: "release from twice the amplitude: the added damping is fourfold",
                ..card
            },
            Called::Roll => Card {
                cause: "bilge keels or a deck edge that meet the surface at large heel",
                confirm: "release from twice the amplitude: the added damping is fourfold",
                ..card
            },
            Called::Displacement => Card {
                cause: "a guide or damper that takes more far out",
                confirm: "release from twice the amplitude: the added damping is fourfold",
                ..card
            },
            _ => card,
        }
    }
}

moment!(CubicDamping, [c], |b, r, _, _| -b * b * (c * r));

#[cfg(test)]
mod tests {
    use super::super::terms::Moment;
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn is_the_rate_times_the_square_of_the_angle() {
        let (state, moment) = (at(0.1, -0.5), 2.0 * 0.01 * 0.5);
        assert!((CubicDamping::moment(&[2.0], &state) - moment).abs() < 1e-15);
    }
}
