//! Damping with a power of the yaw rate, - c |r|^n sign(r).

use super::law::{not_negative, numbers, within, Card, Equation, Law, Parameter, Scale, Seen};
use crate::record::Called;
use super::terms::{Moment, State, Terms};
use crate::quantity::Quantity;

pub(super) struct PowerDamping;

/// Exponents at which a fit begins.
const EXPONENTS: [f64; 3] = [1.5, 0.5, 2.5];

/// Uncertainties within which an exponent is a whole number.
const WHOLE: f64 = 2.0;

impl Law for PowerDamping {
    fn id(&self) -> &'static str {
        "power_damping"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 2] =
            [not_negative("c", "(rad/s2)/(rad/s)^n"), within("n", "1", 0.0, 3.0)];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        let rate = scale.natural_frequency_rad_s * scale.amplitude_rad;
        vec![scale.stiffness() * scale.amplitude_rad / rate.powf(EXPONENTS[0]), 1.0]
    }

    fn starts(&self, _: &Seen) -> Vec<Vec<f64>> {
        EXPONENTS.map(|n| vec![0.0, n]).to_vec()
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_moment::<Self>(p);
    }

    fn is_flexible(&self) -> bool {
        true
    }

    fn wind_power(&self, users: &[f64]) -> Option<(usize, f64)> {
        Some((0, users.get(1).map_or(f64::NAN, |n| 2.0 - n)))
    }

    /// Dry friction, viscous or quadratic damping.
    fn is_simpler_one(&self, users: &[Quantity], _: f64) -> bool {
        let n = users[1];
        let near = |whole: f64| (n.value - whole).abs() <= WHOLE * n.u;
        !n.u.is_finite() || [0.0, 1.0, 2.0].into_iter().any(near)
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment("-c * abs(r)^n * sign(r)"))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Damping with a power of the rate",
            formula: "- c |r|^n sign(r), 0 < n < 3",
            cause: "drag between laminar and turbulent, grease, felt, several losses that look like one",
            fingerprint: "damping goes with amplitude^(n - 1); frequency stays",
            confirm: "a release of another size: n stays",
            remove: "depends on which loss it is: try with the wind off, and with the bearing freed",
            release: "a much smaller and a much larger amplitude, where the powers differ",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                remove: "depends on which loss it is: try another bearing, and a smaller bob",
                ..card
            },
            Called::Roll => Card {
                remove: "depends on which loss it is: try it without bilge keels and appendages",
                ..card
            },
            Called::Displacement => Card {
                remove: "depends on which loss it is: try another guide, and a smaller body",
                ..card
            },
            _ => card,
        }
    }
}

impl Moment for PowerDamping {
    #[inline]
    fn moment(p: &[f64], s: &State) -> f64 {
        let [c, n] = numbers(p);
        -c * s.rate_rad_s.abs().powf(n) * s.rate_rad_s.signum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn is_against_the_rate_with_its_power() {
        let moment = PowerDamping::moment(&[2.0, 1.5], &at(0.1, -0.25));
        assert!((moment - 2.0 * 0.125).abs() < 1e-15);
        assert_eq!(PowerDamping::moment(&[2.0, 1.5], &at(0.1, 0.0)), 0.0);
    }
}
