//! A white random moment of intensity q: it has no definite course and is judged by likelihood, not
//! simulated.

use super::law::{not_negative, Acts, Card, Law, Parameter, Scale};
use crate::record::Called;
use super::terms::Terms;

pub(super) struct Buffeting;

impl Law for Buffeting {
    fn id(&self) -> &'static str {
        "buffeting"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [not_negative("q", "rad2/s3")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.natural_frequency_rad_s.powi(3) * scale.amplitude_rad * scale.amplitude_rad]
    }

    fn write(&self, _: &[f64], _: &mut Terms) {}

    fn acts_on(&self) -> Acts {
        Acts::Random
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Random moment",
            formula: "+ white random moment of intensity q",
            cause: "turbulence of the stream, the wake of something upstream",
            fingerprint: "phase and amplitude wander; residual grows in time, different on every repeat",
            confirm: "repeat the release: what is random does not repeat; with the wind off it goes",
            remove: "screens, another position in the stream; else average repeats",
            release: "a repeat under the same conditions",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a draught, a floor or stand that shakes",
                confirm: "repeat the release: what is random does not repeat; watch it at rest",
                remove: "a still room, a solid stand; else average repeats",
                ..card
            },
            Called::Roll => Card {
                cause: "waves and currents left in the water, wind",
                confirm: "repeat the release: what is random does not repeat; watch it at rest",
                remove: "let the water settle; else average repeats",
                ..card
            },
            Called::Displacement => Card {
                cause: "a floor or stand that shakes, a draught",
                confirm: "repeat the release: what is random does not repeat; watch it at rest",
                remove: "a solid stand; else average repeats",
                ..card
            },
            _ => card,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_no_course_to_follow() {
        let mut terms = Terms::default();
        Buffeting.write(&[0.3], &mut terms);
        assert_eq!(Buffeting.acts_on(), Acts::Random);
        assert_eq!(format!("{terms:?}"), format!("{:?}", Terms::default()));
    }
}
