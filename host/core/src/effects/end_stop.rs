//! A soft stop at either end, - k (|b| - g) sign(b) beyond |b| > g.

use super::contact::ANGLES;
use super::law::{at_shares, not_negative, numbers, Card, Equation, Law, Parameter, Scale, Seen};
use super::terms::{Moment, State, Terms};

pub(super) struct EndStop;

impl Law for EndStop {
    fn id(&self) -> &'static str {
        "end_stop"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 2] = [not_negative("k", "1/s2"), not_negative("g", "rad")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness(), scale.amplitude_rad]
    }

    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        at_shares(&ANGLES, seen)
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_moment::<Self>(p);
    }

    fn is_flexible(&self) -> bool {
        true
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment("-k * (b - max(-g, min(g, b)))"))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "End stop",
            formula: "- k (|b| - g) sign(b) beyond |b| > g",
            cause: "a rubber buffer, a cable or spring that comes taut, coils that touch",
            fingerprint: "frequency rises above one amplitude and is constant below it",
            confirm: "release from below g: it is gone",
            remove: "move the stops out, lead the cable with slack",
            release: "one from below the stop and one from far above",
        }
    }
}

impl Moment for EndStop {
    #[inline]
    fn moment(p: &[f64], s: &State) -> f64 {
        let [k, g] = numbers(p);
        -k * (s.yaw_rad - s.yaw_rad.clamp(-g, g))
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn pushes_back_beyond_the_stop_only() {
        assert_eq!(EndStop::moment(&[2.0, 0.1], &at(0.09, 0.3)), 0.0);
        assert!((EndStop::moment(&[2.0, 0.1], &at(-0.15, 0.3)) - 0.1).abs() < 1e-15);
    }
}
