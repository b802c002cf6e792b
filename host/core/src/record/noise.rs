//! The sample noise of a record, from the record alone.

use super::Record;

impl Record {
    /// Standard deviation of white sample noise in degrees, from third differences: a sinusoid
    /// of a few hertz has next to none at 1 kHz, and their median does not feel outliers.
    /// At a few tens of samples a cycle it is an upper bound.
    pub fn noise_rms_deg(&self) -> f64 {
        let mut thirds: Vec<f64> = self
            .yaw_deg
            .windows(4)
            .map(|y| (y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0]).abs())
            .collect();
        if thirds.is_empty() {
            return 0.0;
        }
        let middle = thirds.len() / 2;
        let median = *thirds.select_nth_unstable_by(middle, f64::total_cmp).1;
        // 0.6745 sigma is a normal's median deviation; 1 + 9 + 9 + 1 squares add up.
        median / (0.674_49 * 20.0_f64.sqrt())
    }
}
