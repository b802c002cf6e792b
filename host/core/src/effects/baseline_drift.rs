//! A zero that drifts: reading = b + d t.

use super::law::{any, enters, reading, Acts, Card, Law, Parameter, Scale};

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
        vec![scale.reading_rad / scale.duration_s]
    }

    enters!(reading);

    fn belongs_to_release(&self, _: usize) -> bool {
        true
    }

    fn acts_on(&self) -> Acts {
        Acts::Time
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Zero drifting in time",
            formula: "reading = b + d t",
            cause: "sensor or amplifier warming up, a mount that creeps",
            fingerprint: "mid-line moves steadily in time",
            confirm: "record the model at rest for as long",
            remove: "let the electronics warm up",
            release: "a record of the model at rest",
        }
    }
}

reading!(BaselineDrift, [d], |_, t| d * t);

#[cfg(test)]
mod tests {
    use super::super::terms::Reading;
    use super::*;

    #[test]
    fn the_reading_departs_by_it() {
        assert!((BaselineDrift::change(&[2.0], -0.1, 3.0) - 2.0 * 3.0).abs() < 1e-15);
    }
}
