//! Stiffness that falls in a straight line with amplitude, - k |b| b with k < 0, as micro-slip in joints has
//! it.

use super::law::{abs, enters, moment, not_positive, Card, Law, Parameter, Scale, Series};
use crate::record::Called;

pub(super) struct OddQuadraticStiffness;

impl Law for OddQuadraticStiffness {
    fn id(&self) -> &'static str {
        "odd_quadratic_stiffness"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [not_positive("k", "1/(rad s2)")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness() / scale.amplitude_rad]
    }

    enters!(moment);

    fn series(&self) -> Option<Series> {
        Some(Series::Term)
    }

    fn derivative(&self) -> Option<(&'static str, f64)> {
        Some(("Cn_betaabsbeta", -1.0))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Stiffness that falls in a straight line with amplitude",
            formula: "- k |b| b",
            cause: "micro-slip in joints and clamps, a spring with play in its ends",
            fingerprint: "frequency changes in proportion to amplitude; no even harmonics",
            confirm: "tighten the clamps: it becomes smaller",
            remove: "glue or preload the joints of the springs",
            release: "a smaller amplitude, where it differs from a cube",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum | Called::Roll => Card {
                cause: "micro-slip in joints, clamps and suspension",
                remove: "glue or preload the joints",
                ..card
            },
            _ => card,
        }
    }
}

moment!(OddQuadraticStiffness, [k], |b, _, _, _| -k * abs(b) * b);

#[cfg(test)]
mod tests {
    use super::super::terms::Moment;
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn pulls_back_to_either_side() {
        let moment = OddQuadraticStiffness::moment(&[2.0], &at(-0.1, 0.3));
        assert!((moment - 2.0 * 0.01).abs() < 1e-15);
    }
}
