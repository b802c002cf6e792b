//! Free play: the spring acts on b beyond a dead zone of +-g only.

use super::law::{numbers, not_negative, Card, Equation, Law, Parameter, Scale};
use crate::record::Called;
use super::terms::Terms;

pub(super) struct FreePlay;

impl Law for FreePlay {
    fn id(&self) -> &'static str {
        "free_play"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [not_negative("g", "rad")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.amplitude_rad]
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        let [g] = numbers(p);
        terms.loosen(g);
    }

    /// The dead zone's edge is no strength.
    fn is_proportional(&self) -> bool {
        false
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::DeadZone("g"))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Free play",
            formula: "the spring acts on b beyond a dead zone of +-g",
            cause: "slack spring hooks, a loose joint between model and shaft",
            fingerprint: "natural frequency falls as amplitude falls towards g",
            confirm: "rock the model by hand about its rest; preload the springs and release again",
            remove: "preload the springs, shim the joint",
            release: "a smaller amplitude, down to a few g",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a bearing with play, a loose joint between pendulum and shaft",
                confirm: "rock it by hand about its rest",
                remove: "a bearing without play, a tight joint",
                ..card
            },
            Called::Roll => Card {
                cause: "cargo or a gauge's joint that moves before it pushes",
                confirm: "rock it by hand about its rest, look at what moves",
                remove: "secure the load, a tight joint",
                ..card
            },
            _ => card,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn it_is_left_to_the_integration() {
        let mut terms = Terms::default();
        FreePlay.write(&[0.3], &mut terms);
        assert_eq!(terms.dead_zone_rad, 0.3);
        assert_eq!(terms.smooth_moment(&at(0.1, 0.2), 0.0), 0.0);
    }
}
