//! A soft stop at one end, - k (b - g) beyond g: above where g is positive, below where it is negative.

use super::contact::{either_angle, within};
use super::law::{any, not_negative, numbers, Card, Equation, Law, Parameter, Scale, Seen};
use super::terms::{Moment, State, Terms};

pub(super) struct OneSidedStop;

impl Law for OneSidedStop {
    fn id(&self) -> &'static str {
        "one_sided_stop"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 2] = [not_negative("k", "1/s2"), any("g", "rad")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness(), scale.amplitude_rad]
    }

    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        either_angle(seen).into_iter().map(|g| vec![0.0, g]).collect()
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_moment::<Self>(p);
    }

    fn is_flexible(&self) -> bool {
        true
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment("-k * sign(g) * max(sign(g) * (b - g), 0)"))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Stop on one side",
            formula: "- k (b - g) beyond g; the sign of g is its side",
            cause: "a cable or strap that comes taut, a buffer or a coil that touches on one side",
            fingerprint: "frequency rises above one amplitude; the mid-line moves away from the stop there",
            confirm: "release from below g, or to the other side from less: it is gone",
            remove: "move the stop out, lead the cable with slack",
            release: "one from below the stop and one from far above",
        }
    }
}

impl Moment for OneSidedStop {
    #[inline]
    fn moment(p: &[f64], s: &State) -> f64 {
        let [k, g] = numbers(p);
        let side = 1.0_f64.copysign(g);
        -k * side * within(s.yaw_rad, side, g)
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn pushes_back_beyond_the_stop_on_its_side_only() {
        let moment = |g: f64, yaw_rad: f64| OneSidedStop::moment(&[2.0, g], &at(yaw_rad, 0.3));
        for side in [1.0, -1.0] {
            assert_eq!(moment(side * 0.1, side * 0.09), 0.0);
            assert_eq!(moment(side * 0.1, side * -0.15), 0.0);
            assert!((moment(side * 0.1, side * 0.15) + side * 0.1).abs() < 1e-15);
        }
    }
}
