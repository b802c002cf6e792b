//! Elasto-plastic part of the spring, - h z with z' = r - |r| z / y (Bouc-Wen with n = 1: Y. K. Wen, J. Eng.
//! Mech. Div. 102, 1976): a spring of stiffness h that yields at y.

use super::law::{at_shares, not_negative, numbers, within, Card, Equation, Law, Parameter, Scale, Seen};
use crate::record::Called;
use super::memory::Memory;
use super::terms::Terms;
use crate::quantity::Quantity;
use std::borrow::Cow;

pub(super) struct Hysteresis;

/// Where a fit begins: yield angles, as shares of the amplitude.
const YIELDS: [f64; 3] = [0.3, 0.1, 1.0];
/// A spring that yields at less is dry friction, rad.
const MIN_YIELD_RAD: f64 = 1e-5;

/// Yield angle, as a share of the amplitude, below which it yields at once.
const DRY_YIELD: f64 = 0.05;

impl Law for Hysteresis {
    fn id(&self) -> &'static str {
        "hysteresis"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 2] =
            [not_negative("h", "1/s2"), within("y", "rad", MIN_YIELD_RAD, f64::INFINITY)];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness(), scale.amplitude_rad]
    }

    /// Dry friction whose turning points are round.
    fn is_simpler_one(&self, users: &[Quantity], amplitude_rad: f64) -> bool {
        users[1].value < DRY_YIELD * amplitude_rad
    }

    fn equation(&self) -> Option<Equation<'_>> {
        let states = vec![["z", "r - sign(r) * r * z / y"].map(Cow::Borrowed)];
        Some(Equation::Remembered { moment: "-h * z".into(), states })
    }

    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        at_shares(&YIELDS, seen)
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_memory::<Self>(p);
    }

    fn is_flexible(&self) -> bool {
        true
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Hysteresis of the spring",
            formula: "- h z, z' = r - |r| z / y",
            cause: "springs or wires strained beyond their limit, rubber, joints that slip a little",
            fingerprint: "damping and frequency change with amplitude and not with rate; loops in moment over angle",
            confirm: "a stiffer spring at the same amplitude: the energy lost in a cycle stays",
            remove: "springs that stay elastic, glued or preloaded joints",
            release: "another spring at the same amplitude, which changes the rate and not the angle",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "rubber, wire or tape in the suspension, joints that slip a little",
                confirm: "another length at the same amplitude: the energy lost in a cycle stays",
                remove: "a knife edge or an elastic flexure, glued joints",
                release: "another length at the same amplitude, which changes the rate and not the angle",
                ..card
            },
            Called::Roll => Card {
                cause: "tethers or fenders that give, liquid that lags behind",
                confirm: "take tethers away, empty the tanks",
                remove: "take tethers away, empty or fill the tanks",
                release: "another stability at the same amplitude, which changes the rate and not the angle",
                ..card
            },
            _ => card,
        }
    }
}

impl Memory for Hysteresis {
    #[inline]
    fn moved(p: &[f64], state: f64, by_rad: f64) -> f64 {
        let [_, y] = numbers(p);
        let limit = y.copysign(by_rad);
        limit + (state - limit) * (-by_rad.abs() / y).exp()
    }

    #[inline]
    fn moment(p: &[f64], state: f64) -> f64 {
        -p[0] * state
    }

    #[inline]
    fn slope(p: &[f64], state: f64, rate_rad_s: f64) -> f64 {
        rate_rad_s - rate_rad_s.abs() * state / p[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against small steps of the differential equation, out and back.
    #[test]
    fn the_state_between_turns_is_the_equations() {
        let p = [50.0, 0.02];
        let (mut z, mut by_steps) = (0.0, 0.0);
        for leg in [0.1, -0.18, 0.15, -0.01] {
            z = Hysteresis::moved(&p, z, leg);
            let db = leg / 200_000.0;
            for _ in 0..200_000 {
                by_steps += Hysteresis::slope(&p, by_steps, db);
            }
            assert!((z - by_steps).abs() < 1e-6, "{leg}: {z} {by_steps}");
        }
        assert_eq!(Hysteresis::moment(&p, 0.01), -0.5);
    }

    /// Much less than the yield angle is a spring, much more is dry friction.
    #[test]
    fn its_limits_are_a_spring_and_friction() {
        let p = [50.0, 0.02];
        assert!((Hysteresis::moved(&p, 0.0, 1e-6) - 1e-6).abs() < 1e-10);
        assert!((Hysteresis::moved(&p, 0.02, -1.0) + 0.02).abs() < 1e-12);
    }
}
