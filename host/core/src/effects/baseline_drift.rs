//! A zero that drifts: reading = b + d t.

use super::law::{numbers, any, Card, Law, Parameter, Scale};
use super::terms::{Reading, Terms};

pub(super) struct BaselineDrift;

impl Law for BaselineDrift {
    fn id(&self) -> &'static str {
        "baseline_drift"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("d", "rad/s")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.amplitude_rad / scale.duration_s]
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_reading::<Self>(p);
    }

    fn belongs_to_release(&self, _: usize) -> bool {
        true
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Zero drifting in time",
            formula: "reading = b + d t",
            cause: "sensor or amplifier warming up, a creeping spring mount",
            fingerprint: "mid-line moves steadily in time",
            confirm: "record the model at rest for as long",
            remove: "let the electronics warm up",
            release: "a record of the model at rest",
        }
    }
}

impl Reading for BaselineDrift {
    #[inline]
    fn change(p: &[f64], _yaw_rad: f64, time_s: f64) -> f64 {
        let [d] = numbers(p);
        d * time_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reading_departs_by_it() {
        assert!((BaselineDrift::change(&[2.0], -0.1, 3.0) - 2.0 * 3.0).abs() < 1e-15);
    }
}
