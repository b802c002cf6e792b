//! The response computed from the derivatives against the record: thesis (Ramli 2008), Figs 4.21 and 4.22.

use crate::record::Record;
use crate::solver::linear_fit;
use yawrig_shared::modal::Modal;

/// Mean squared difference in deg2 between the record from `from_s` to `to_s` and the free response of
/// `modal`.
///
/// Initial condition and the sensor's offset are fitted, since they are the release's and not the model's;
/// the frequency and the damping are not. About the square of the sensor's noise where the derivatives are
/// right. `None` for fewer than four samples.
pub fn mean_squared_error_deg2(
    record: &Record,
    from_s: f64,
    to_s: f64,
    modal: &Modal,
) -> Option<f64> {
    let (decay, frequency) = (modal.decay_rate_per_s(), modal.damped_frequency_rad_s());
    let first = record.time_s.partition_point(|t| *t < from_s);
    let last = record.time_s.partition_point(|t| *t <= to_s);
    let (time_s, yaw_deg) = (record.time_s.get(first..last)?, record.yaw_deg.get(first..last)?);
    if time_s.len() < 4 {
        return None;
    }
    let basis = |t: &f64| {
        let (sin, cos) = (frequency * (t - from_s)).sin_cos();
        let e = (-decay * (t - from_s)).exp();
        [e * cos, e * sin, 1.0]
    };
    let rows = || time_s.iter().zip(yaw_deg).map(|(t, y)| (basis(t), *y));
    let [a, b, zero] = linear_fit(rows())?;
    let squares: f64 = rows().map(|([c, s, _], y)| (y - (a * c + b * s + zero)).powi(2)).sum();
    let mean = squares / time_s.len() as f64;
    mean.is_finite().then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yawrig_rig::{End, Motion, Samples, Sensor, Start};

    #[test]
    fn right_values_leave_the_noise_and_wrong_ones_leave_more() {
        let truth = Modal { natural_frequency_rad_s: 12.3, damping_ratio: 0.006 };
        let start = Start { amplitude_deg: 10.0, hold_s: 0.0, end: End::After(20.0) };
        let sensor = Sensor { offset_deg: 4.0, adc_step_deg: 0.0, ..Sensor::default() };
        let (time_s, yaw_deg) = Samples::new(Motion::new(&truth), &start, &sensor, 3)
            .map(|sample| (sample.time_s, sample.yaw_deg))
            .unzip();
        let record = Record::new("k4.csv", time_s, yaw_deg);
        let mse = |modal: &Modal| mean_squared_error_deg2(&record, 1.0, 18.0, modal).unwrap();
        let right = mse(&truth);
        assert!((right / 0.0025 - 1.0).abs() < 4.0 * (2.0f64 / 17_000.0).sqrt(), "{right}");
        let slow = mse(&Modal { natural_frequency_rad_s: 12.25, ..truth });
        let weak = mse(&Modal { damping_ratio: 0.004, ..truth });
        assert!(slow > 20.0 * right && weak > 20.0 * right, "{slow} {weak}");
        assert_eq!(mean_squared_error_deg2(&record, 30.0, 40.0, &truth), None);
    }
}
