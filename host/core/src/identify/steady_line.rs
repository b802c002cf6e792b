//! A steady line in a reading: mains hum and its like.

/// A sine in the reading, of time from the record's own zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyLine {
    pub(crate) frequency_rad_s: f64,
    pub(crate) cosine_deg: f64,
    pub(crate) sine_deg: f64,
}

impl SteadyLine {
    pub(crate) fn amplitude_deg(&self) -> f64 {
        self.cosine_deg.hypot(self.sine_deg)
    }

    pub(crate) fn at(&self, time_s: f64) -> f64 {
        let (sin, cos) = (self.frequency_rad_s * time_s).sin_cos();
        self.cosine_deg * cos + self.sine_deg * sin
    }
}
