//! Counts of the converter, as the potentiometer gives them.

use yawrig_shared::wire::Settings;

/// Counts are kept about the middle of a 16-bit converter, where they fit an `i16`.
const MIDDLE: i32 = 32768;

/// Degrees a count, of either sign, that a potentiometer may have: by a change between any two of them what
/// is known of rest and noise stays what it was.
const SCALES_DEG: core::ops::RangeInclusive<f32> = 1e-6..=100.0;
/// Amplitudes that may be asked for, degrees.
const MIN_DEG: f32 = 1e-3;
const MAX_DEG: f32 = 1e6;

/// How counts become degrees.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    settings: Settings,
}

impl Sampler {
    pub const fn new(settings: Settings) -> Self {
        Self { settings }
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether settings make sense; none of the comparisons holds for what is no number.
    pub fn check(settings: &Settings) -> bool {
        SCALES_DEG.contains(&settings.degrees_per_count.abs())
            && settings.full_scale_counts > 0
            && settings.from_deg <= MAX_DEG
            && settings.to_deg >= MIN_DEG
            && settings.from_deg > settings.to_deg
            && settings.clock_u_ppm.is_none_or(|ppm| (0.0..=1e5).contains(&ppm))
    }

    /// A sample as the tracker keeps it.
    #[inline]
    pub fn centred(counts: u16) -> i16 {
        (i32::from(counts) - MIDDLE) as i16
    }

    /// Whether the converter is at one of its ends, where it cannot tell how far the model is.
    #[inline]
    pub fn saturated(&self, counts: u16) -> bool {
        counts == 0 || counts >= self.settings.full_scale_counts
    }

    /// A height on the tracker's scale as degrees on the potentiometer's.
    pub fn yaw_deg(&self, tracked_deg: f32) -> f32 {
        let shift = MIDDLE - i32::from(self.settings.zero_counts);
        tracked_deg + shift as f32 * self.settings.degrees_per_count
    }
}
