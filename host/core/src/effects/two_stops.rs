//! Soft stops at both ends, each with an angle and a stiffness of its own: - ku (b - gu) above gu,
//! - kl (b + gl) below -gl.

use super::contact::{both, both_angles, both_sizes, may_be_equal, may_be_zero};
use super::law::{not_negative, numbers, Card, Equation, Law, Parameter, Scale, Seen};
use super::terms::{Moment, State, Terms};
use crate::quantity::Quantity;

pub(super) struct TwoStops;

impl Law for TwoStops {
    fn id(&self) -> &'static str {
        "two_stops"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 4] = [
            not_negative("ku", "1/s2"),
            not_negative("gu", "rad"),
            not_negative("kl", "1/s2"),
            not_negative("gl", "rad"),
        ];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        both_sizes(scale).to_vec()
    }

    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        both_angles(seen).into_iter().map(|[gu, gl]| vec![0.0, gu, 0.0, gl]).collect()
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_moment::<Self>(p);
    }

    /// Its strengths are two.
    fn wind_power(&self, _: &[f64]) -> Option<(usize, f64)> {
        None
    }

    fn is_flexible(&self) -> bool {
        true
    }

    /// An end stop, or a stop on one side.
    fn is_simpler_one(&self, users: &[Quantity], _: f64) -> bool {
        let [ku, gu, kl, gl] = [0, 1, 2, 3].map(|k| users[k]);
        may_be_zero(ku) || may_be_zero(kl) || may_be_equal(ku, kl) && may_be_equal(gu, gl)
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment("-ku * max(b - gu, 0) - kl * min(b + gl, 0)"))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Stops at both ends, unlike",
            formula: "- ku (b - gu) above gu, - kl (b + gl) below -gl",
            cause: "buffers, cables or coils that touch on both sides, not at one angle or not alike",
            fingerprint: "frequency rises above one amplitude and once more above another; the mid-line moves between them",
            confirm: "release from below the nearer stop: both are gone; from between them: one is",
            remove: "move the stops out, lead the cables with slack",
            release: "one from between the two angles, one from below both and one from far above",
        }
    }
}

impl Moment for TwoStops {
    #[inline]
    fn moment(p: &[f64], s: &State) -> f64 {
        both(s.yaw_rad, numbers(p), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn each_side_has_its_own() {
        let moment = |yaw_rad| TwoStops::moment(&[2.0, 0.1, 3.0, 0.2], &at(yaw_rad, 0.3));
        assert_eq!([moment(0.09), moment(-0.19)], [0.0, 0.0]);
        assert!((moment(0.15) + 0.1).abs() < 1e-15 && (moment(-0.3) - 0.3).abs() < 1e-15);
    }

    #[test]
    fn a_stop_that_may_be_none_or_both_alike_has_another_name() {
        let q = Quantity::new;
        let named = |ku, gu, kl, gl| !TwoStops.is_simpler_one(&[ku, gu, kl, gl], 0.2);
        let (k, g) = (q(40.0, 1.0), q(0.1, 1e-3));
        assert!(named(k, g, q(60.0, 1.0), g) && named(k, g, k, q(0.12, 1e-3)));
        assert!(!named(k, g, k, q(0.101, 1e-3)) && !named(k, g, q(1.0, 0.6), g));
        assert!(!named(k, g, q(60.0, f64::NAN), g));
    }
}
