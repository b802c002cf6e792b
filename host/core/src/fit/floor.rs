//! The least that any model can leave of a reading: noise, or the step of a quantised sensor.

use crate::record::Record;

/// Readings for each value that is taken, from which on they come in steps.
const READINGS_PER_VALUE: usize = 4;
/// Noise in steps below which it does not blur them: means are then no better than single readings.
const BLURRED: f64 = 0.5;

/// The step of a quantised sensor, deg; none where readings hardly ever repeat.
pub(crate) fn step_deg(record: &Record) -> Option<f64> {
    let mut values = record.yaw_deg.clone();
    values.sort_unstable_by(f64::total_cmp);
    // What rounding makes of one value.
    let least = match record.measurand.is_of_angle() {
        true => 1e-6,
        false => 1e-9 * (values[values.len() - 1] - values[0]),
    };
    let mut gaps: Vec<f64> = Vec::new();
    let mut taken = 1;
    for pair in values.windows(2) {
        let gap = pair[1] - pair[0];
        if gap > least {
            taken += 1;
            gaps.push(gap);
        }
    }
    if gaps.is_empty() || values.len() < READINGS_PER_VALUE * taken {
        return None;
    }
    Some(crate::statistics::median(&mut gaps))
}

/// The rms that no model of the means goes below: a step's, where noise of a sample, in deg, does not blur the
/// steps.
pub(crate) fn of_steps(record: &Record, sample_noise_deg: f64) -> f64 {
    let step = step_deg(record).filter(|step| sample_noise_deg < BLURRED * step);
    step.map_or(0.0, |step| step / 12f64.sqrt())
}
