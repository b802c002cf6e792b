//! A table: where its knots are, and what is known of it.

/// Where the knots of a table are: readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knots {
    /// The first one.
    pub first_deg: f64,
    /// From one to the next.
    pub step_deg: f64,
    /// How many, three or more.
    pub count: usize,
}

impl Knots {
    /// The knot below a reading, and how far it lies from there to the next one; beyond the ends, the end.
    pub(super) fn place(&self, deg: f64) -> (usize, f64) {
        let at = ((deg - self.first_deg) / self.step_deg).clamp(0.0, (self.count - 1) as f64);
        let knot = (at as usize).min(self.count - 2);
        (knot, at - knot as f64)
    }

    /// What has these values at the knots, and is straight between them.
    pub(super) fn between(&self, values: &[f64], deg: f64) -> f64 {
        let (knot, beyond) = self.place(deg);
        values[knot] * (1.0 - beyond) + values[knot + 1] * beyond
    }

    /// The reading of a knot.
    pub fn deg(&self, knot: usize) -> f64 {
        self.first_deg + self.step_deg * knot as f64
    }
}

/// A table, and what is known of it.
#[derive(Clone, Debug)]
pub struct Learned {
    /// What is to be added to a reading, at each knot; corrected readings rise with readings.
    pub corrections_deg: Vec<f64>,
    /// The readings that were seen: beyond them corrections stay what they are at the end.
    pub seen_deg: [f64; 2],
    /// Rms of what the table takes out of the residual.
    pub removed_rms_deg: f64,
    /// Whether that is more than so many knots take out of noise.
    pub beyond_noise: bool,
    /// Rms of a sample's residual that is left.
    pub left_rms_deg: f64,
    /// What the table takes out of a damping ratio, relative: what the sensor's error had made of it.
    pub damping_error: f64,
    /// What is left in damping ratios by noise and by a stiffness law, relative, as a standard uncertainty.
    pub damping_u: f64,
    /// The largest relative change of a frequency from the largest amplitude to none, by a stiffness law.
    pub frequency_change: f64,
}
