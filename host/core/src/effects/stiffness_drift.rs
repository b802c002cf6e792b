//! Stiffness that drifts, wn^2 (1 + e t).

use super::law::{any, enters, moment, Acts, Card, Law, Parameter, Scale};
use crate::record::Called;

pub(super) struct StiffnessDrift;

impl Law for StiffnessDrift {
    fn id(&self) -> &'static str {
        "stiffness_drift"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("e", "1/s")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![1.0 / scale.duration_s]
    }

    enters!(moment);

    fn belongs_to_release(&self, _: usize) -> bool {
        true
    }

    fn acts_on(&self) -> Acts {
        Acts::Time
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Stiffness drifting in time",
            formula: "wn^2 (1 + e t)",
            cause: "wind speed drifting, springs warming or creeping",
            fingerprint: "natural frequency changes with time whatever the amplitude",
            confirm: "log the wind speed; release twice in a row: the second starts where the first ended",
            remove: "let the tunnel settle before releasing",
            release: "one of half the amplitude: a drift keeps its size, a hardening falls to a quarter",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a weight that slides, a suspension that creeps or warms",
                confirm: "release twice in a row: the second starts where the first ended",
                remove: "clamp the weights, let it settle before releasing",
                ..card
            },
            Called::Roll => Card {
                cause: "load or water that shifts",
                confirm: "release twice in a row: the second starts where the first ended",
                remove: "secure the load, empty or fill the tanks",
                ..card
            },
            Called::Displacement => Card {
                cause: "a spring that warms or creeps",
                confirm: "release twice in a row: the second starts where the first ended",
                remove: "let it settle before releasing",
                ..card
            },
            _ => card,
        }
    }
}

moment!(StiffnessDrift, [e], |_, _, t, spring| e * t * spring);

#[cfg(test)]
mod tests {
    use super::super::terms::{Moment, State};
    use super::super::law::testing::at;
    use super::*;

    #[test]
    fn grows_with_time() {
        let (state, moment) = (State { spring_moment_rad_s2: -4.9, time_s: 3.0, ..at(0.1, 0.0) }, 2.0 * 3.0 * -4.9);
        assert!((StiffnessDrift::moment(&[2.0], &state) - moment).abs() < 1e-15);
    }
}
