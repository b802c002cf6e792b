//! Soft stops at both ends that take energy out, each with an angle and a stiffness of its own:
//! - ku (b - gu) (1 + a r) above gu, - kl (b + gl) (1 - a r) below -gl.

use super::contact::{
    both, both_angles, both_sizes, loss, loss_size, may_be_zero, may_take_none_out,
};
use super::law::{not_negative, numbers, Card, Equation, Law, Parameter, Scale, Seen};
use super::terms::{Moment, State, Terms};
use crate::quantity::Quantity;

pub(super) struct DampedStops;

impl Law for DampedStops {
    fn id(&self) -> &'static str {
        "damped_stops"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 5] = [
            not_negative("ku", "1/s2"),
            not_negative("gu", "rad"),
            not_negative("kl", "1/s2"),
            not_negative("gl", "rad"),
            not_negative("a", "s/rad"),
        ];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        [&both_sizes(scale)[..], &[loss_size(scale)]].concat()
    }

    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        let a = loss(seen);
        both_angles(seen).into_iter().map(|[gu, gl]| vec![0.0, gu, 0.0, gl, a]).collect()
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

    /// Stops that take none out, or one on one side.
    fn is_simpler_one(&self, users: &[Quantity], amplitude_rad: f64) -> bool {
        let [ku, kl, a] = [0, 2, 4].map(|k| users[k]);
        may_be_zero(ku) || may_be_zero(kl) || may_take_none_out(ku, a, amplitude_rad)
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment(
            "-ku * max(b - gu, 0) * (1 + a * r) - kl * min(b + gl, 0) * (1 - a * r)",
        ))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Stops at both ends that take energy out",
            formula: "- ku (b - gu) (1 + a r) above gu, - kl (b + gl) (1 - a r) below -gl",
            cause: "rubber or foam buffers, straps that come taut, on both sides",
            fingerprint: "frequency and damping rise above one amplitude, and once more above another where the sides differ",
            confirm: "release from below the nearer stop: both are gone",
            remove: "move the stops out, lead the straps with slack",
            release: "one from below both stops and one from far above",
        }
    }
}

impl Moment for DampedStops {
    #[inline]
    fn moment(p: &[f64], s: &State) -> f64 {
        both(s.yaw_rad, numbers(p), p[4] * s.rate_rad_s)
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn both_sides_push_harder_on_the_way_in() {
        let moment = |b, r| DampedStops::moment(&[2.0, 0.1, 3.0, 0.2, 0.5], &at(b, r));
        assert_eq!([moment(0.09, 0.4), moment(-0.19, 0.4)], [0.0, 0.0]);
        assert!((moment(0.15, 0.4) + 0.12).abs() < 1e-15);
        assert!((moment(-0.3, -0.4) - 0.36).abs() < 1e-15);
        assert!((moment(-0.3, 0.4) - 0.24).abs() < 1e-15);
    }
}
