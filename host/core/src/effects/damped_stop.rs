//! A soft stop at one end that takes energy out, - k (b - g) (1 + a r) beyond g: above where g is positive, below,
//! with the rate's sign turned, where it is negative.

use super::contact::{either_angle, loss, loss_size, may_be_zero, may_take_none_out, within};
use super::law::{any, not_negative, numbers, Card, Equation, Law, Parameter, Scale, Seen};
use super::terms::{Moment, State, Terms};
use crate::quantity::Quantity;

pub(super) struct DampedStop;

impl Law for DampedStop {
    fn id(&self) -> &'static str {
        "damped_stop"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 3] =
            [not_negative("k", "1/s2"), any("g", "rad"), not_negative("a", "s/rad")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness(), scale.amplitude_rad, loss_size(scale)]
    }

    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        either_angle(seen).into_iter().map(|g| vec![0.0, g, loss(seen)]).collect()
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_moment::<Self>(p);
    }

    fn is_flexible(&self) -> bool {
        true
    }

    /// A stop on one side that takes none out, or none.
    fn is_simpler_one(&self, users: &[Quantity], amplitude_rad: f64) -> bool {
        may_be_zero(users[0]) || may_take_none_out(users[0], users[2], amplitude_rad)
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment(
            "-k * sign(g) * max(sign(g) * (b - g), 0) * (1 + a * sign(g) * r)",
        ))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Stop on one side that takes energy out",
            formula: "- k (b - g) (1 + a r) beyond g; the sign of g is its side",
            cause: "a rubber or foam buffer, a strap that comes taut, on one side",
            fingerprint: "frequency and damping rise above one amplitude; the mid-line moves away from the stop there",
            confirm: "release from below g, or to the other side from less: it is gone",
            remove: "move the stop out, lead the strap with slack",
            release: "one from below the stop and one from far above",
        }
    }
}

impl Moment for DampedStop {
    #[inline]
    fn moment(p: &[f64], s: &State) -> f64 {
        let [k, g, a] = numbers(p);
        let side = 1.0_f64.copysign(g);
        -k * side * within(s.yaw_rad, side, g) * (1.0 + a * side * s.rate_rad_s)
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn it_pushes_harder_on_the_way_in_on_either_side() {
        for side in [1.0, -1.0] {
            let moment = |b, r| side * DampedStop::moment(&[2.0, side * 0.1, 0.5], &at(side * b, side * r));
            assert_eq!(moment(0.09, 0.4), 0.0);
            assert!((moment(0.15, 0.4) + 0.12).abs() < 1e-15);
            assert!((moment(0.15, -0.4) + 0.08).abs() < 1e-15);
        }
    }
}
