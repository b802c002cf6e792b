//! A sensor whose scale is curved: reading = b + s b^2.

use super::law::{any, enters, reading, Acts, Card, Law, Parameter, Scale};
use crate::record::Called;

pub(super) struct SensorNonlinearity;

impl Law for SensorNonlinearity {
    fn id(&self) -> &'static str {
        "sensor_nonlinearity"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 1] = [any("s", "1/rad")];
        &PARAMETERS
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![1.0 / scale.reading_rad]
    }

    enters!(reading);

    fn acts_on(&self) -> Acts {
        Acts::Sensor
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "Curved sensor scale",
            formula: "reading = b + s b^2",
            cause: "potentiometer or linkage off its straight range",
            fingerprint: "second harmonic and mid-line shift with the square of amplitude, frequency unchanged",
            confirm: "calibrate the sensor against a protractor",
            remove: "calibrate, or use the middle of its range",
            release: "one on another spring: the sensor's coefficient stays, a moment's changes",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                release: "one with the sensor turned a little: its coefficient changes, a moment's stays",
                ..card
            },
            Called::Roll => Card {
                release: "one with another sensor: its coefficient changes, a moment's stays",
                ..card
            },
            _ => card,
        }
    }
}

reading!(SensorNonlinearity, [s], |b, _| s * b * b);

#[cfg(test)]
mod tests {
    use super::super::terms::Reading;
    use super::*;

    #[test]
    fn the_reading_departs_by_it() {
        assert!((SensorNonlinearity::change(&[2.0], -0.1, 3.0) - 2.0 * 0.01).abs() < 1e-15);
    }
}
