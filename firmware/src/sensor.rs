//! What a sensor of the yaw angle is to the device: something that makes counts of what the hardware has
//! read.
//!
//! A sensor does no input of its own. What came from its pins, its bus or a timer, by DMA, in an interrupt or
//! awaited, is given to it as [`Sensor::Raw`]; [`crate::input::Input`] makes the device's samples of its
//! readings, at whatever rate.

use yawrig_shared::wire::{self, Flags};

/// Readings are finer than the device's counts by this many bits: means and steps between them are not
/// rounded.
pub const FINE_BITS: u32 = 8;

/// What a sensor is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct About {
    pub sensor: wire::Sensor,
    /// Where it knows; else the host's settings say.
    pub degrees_per_count: Option<f32>,
    /// From one of its angles to the next, degrees, where there is less noise than that to blur it; else 0.
    pub step_deg: f32,
    /// The highest of its counts, at which it is at its end.
    pub full_scale_counts: u16,
}

/// What was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    /// In parts of a count ([`FINE_BITS`]); none: there is no angle to be read.
    pub fine: Option<i32>,
    /// What the sensor says is the matter.
    pub flags: Flags,
}

/// A sensor of the yaw angle.
pub trait Sensor {
    /// What the hardware has read.
    type Raw;

    /// What it is.
    fn about(&self) -> About;

    /// Counts of what was read.
    fn reading(&mut self, raw: Self::Raw) -> Reading;
}

/// Samples in a second.
const DEVICE_HZ: u16 = 1000;

/// How many readings make a sample and how many samples lie from one reading to the next: one of them is one.
/// `None` for rates other than 1, 2, 3 and 4 kHz, 500, 250, 200, 125 and 100 Hz.
pub const fn ratio(rate_hz: u16) -> Option<(u32, u32)> {
    match rate_hz {
        1000 | 2000 | 3000 | 4000 => Some((rate_hz as u32 / 1000, 1)),
        100 | 125 | 200 | 250 | 500 => Some((1, DEVICE_HZ as u32 / rate_hz as u32)),
        _ => None,
    }
}
