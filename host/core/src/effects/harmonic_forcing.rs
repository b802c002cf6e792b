//! A periodic moment, + f cos(w t + phi), with w away from the natural frequency.

use super::law::{any, not_negative, numbers, Card, Equation, Law, LineParameters, Parameter, Scale, Seen};
use crate::record::Called;
use super::terms::Terms;

pub(super) struct HarmonicForcing;

/// Forcing nearer to the natural frequency than this share cannot be distinguished from the free decay.
const NEAREST_LINE: f64 = 0.1;

impl Law for HarmonicForcing {
    fn id(&self) -> &'static str {
        "harmonic_forcing"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 3] =
            [not_negative("f", "rad/s2"), not_negative("w", "rad/s"), any("phi", "rad")];
        &PARAMETERS
    }

    fn line(&self) -> Option<LineParameters> {
        Some(LineParameters { size: 0, frequency: 1, phase: 2, damping: None, nearest: NEAREST_LINE, slowest: 0.05 })
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        let moment = scale.stiffness() * scale.amplitude_rad;
        vec![moment, moment, 1.0 / scale.duration_s]
    }

    /// A line that lasts shows best in the second half, where the free decay has died down.
    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        let half = &seen.residuals_rad[seen.residuals_rad.len() / 2..];
        let lines = seen.lines(&[half, seen.residuals_rad], NEAREST_LINE, NEAREST_LINE);
        lines.into_iter().map(|w| vec![0.0, 0.0, w]).collect()
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        let [cosine, sine, frequency_rad_s] = numbers(p);
        terms.force([cosine, sine], frequency_rad_s);
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::moment("f * cos(w * t + phi)"))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Periodic moment",
            formula: "+ f cos(w t + phi)",
            cause: "vortex shedding, the tunnel fan, a motor nearby",
            fingerprint: "a line in the residual's spectrum that does not decay",
            confirm: "watch the model at rest; change the wind speed: shedding moves with it, a fan line with its speed",
            remove: "isolate the rig, move away from that wind speed, break up the shedding",
            release: "a longer record, in which a line sharpens and a decaying mode does not",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a machine nearby, a floor or stand that shakes, mains hum in the sensor",
                confirm: "watch it at rest: the line is there",
                remove: "another stand or place, a shielded sensor",
                ..card
            },
            Called::Roll => Card {
                cause: "waves of one period, a machine on board",
                confirm: "watch it at rest: the line is there",
                remove: "let the water settle, stop the machine",
                ..card
            },
            Called::Displacement => Card {
                cause: "a machine nearby, a floor or stand that shakes, mains hum in the sensor",
                confirm: "watch it at rest: the line is there",
                remove: "another stand or place, a shielded sensor",
                ..card
            },
            _ => card,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::effects::Effect;

    #[test]
    fn size_and_phase_are_those_of_cosine_and_sine_part() {
        let [p, q, w] = Effect::HarmonicForcing.varied(&[0.3, 5.0, 0.7])[..] else { panic!() };
        let t = 0.4_f64;
        let sum = p * (w * t).cos() + q * (w * t).sin();
        assert!((sum - 0.3 * (5.0 * t + 0.7).cos()).abs() < 1e-12);
    }
}
