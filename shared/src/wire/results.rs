//! What the device says of a release.

use crate::flags::Flags;
use crate::numbers::Numbers;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The network's estimate from three cycles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WindowResult {
    pub release: u32,
    /// Number in the release, from 0.
    pub window: u16,
    pub start_sample: u32,
    /// First sample at or after the end of the third cycle.
    pub end_sample: u32,
    /// Samples the device had seen when it sent this, less one.
    pub sent_sample: u32,
    pub amplitude_deg: f32,
    /// Mid-line on the potentiometer's scale: the constant offset.
    pub midline_deg: f32,
    pub natural_frequency_rad_s: f32,
    pub damping_ratio: f32,
    pub numbers: Numbers<f32>,
    pub flags: Flags,
}

/// A value and its standard uncertainty (k = 1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Measured {
    pub value: f32,
    pub u: f32,
}

/// The same of a value that an `f32` does not hold to its uncertainty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Precise {
    pub value: f64,
    pub u: f32,
}

/// A damped oscillation with an offset, fitted to a release's whole record from the network's estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refined {
    pub release: u32,
    /// The record: where it begins, and how many samples.
    pub from_sample: u32,
    pub samples: u32,
    /// Standard uncertainties hold for noise of any colour, and with the clock's in that of the natural
    /// frequency. Meaningless with [`Flags::NOT_REFINED`].
    pub natural_frequency_rad_s: Precise,
    pub damping_ratio: Measured,
    /// Rms of the noise of single samples.
    pub noise_rms_deg: f32,
    /// Rms of the residual over that of the noise, on means of a fiftieth of a cycle.
    pub residual_over_noise: f32,
    pub derivatives: Option<Derivatives>,
    /// Those of the release that concern it, and its own: [`Flags::MISFIT`], [`Flags::WIDENED`],
    /// [`Flags::WINDOWS_DIFFER`], [`Flags::NOT_REFINED`].
    pub flags: Flags,
}

/// A release's mean over its windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReleaseResult {
    pub release: u32,
    /// Where it was let go, or where the device first saw it move.
    pub release_sample: u32,
    pub finished_sample: u32,
    pub windows: u16,
    /// Weighted by the square of the amplitude; meaningless where `windows` is zero.
    pub natural_frequency_rad_s: Measured,
    pub damping_ratio: Measured,
    /// Weighted as the network says.
    pub numbers: Numbers<Measured>,
    pub derivatives: Option<Derivatives>,
    pub flags: Flags,
}

/// Which of a release's values counts as measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counting {
    /// The fit to its record.
    Refined,
    /// The network's, as a mean over the windows.
    Windows,
}

/// Which of a release's values counts, if one does: the refined one where it is to be relied on. Message,
/// JSON, page and exit code all ask this.
pub fn counting(result: Option<&ReleaseResult>, refined: Option<&Refined>) -> Option<Counting> {
    if refined.is_some_and(|refined| !refined.flags.of_record().unusable()) {
        return Some(Counting::Refined);
    }
    let by_windows = result.is_some_and(|result| result.windows > 0 && !result.flags.unusable());
    by_windows.then_some(Counting::Windows)
}

/// Yaw derivatives about this axis, per radian, with the standard uncertainties that natural frequencies,
/// damping ratios and the clock give them: those of density, speed, inertia and the model's measures come on
/// top.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Derivatives {
    pub cn_beta: Measured,
    pub cn_r: Measured,
    pub reduced_frequency: f32,
    /// The wind-off release they are held against.
    pub reference_release: u32,
}
