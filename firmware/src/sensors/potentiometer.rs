//! A potentiometer whose converter's readings are summed up: 12 bits over 340 deg are steps of 0.083 deg, and
//! where noise of half a step blurs them the sum of sixteen is four times finer. Its mean time is half a
//! millisecond early, the same for all.

use crate::sensor::{About, Reading, Sensor, FINE_BITS};
use yawrig_shared::wire::{self, Flags, SensorKind};

/// Samples are the sum of so many conversions of so many bits.
#[derive(Clone, Copy, Debug, Default)]
pub struct Potentiometer<const CONVERSIONS: u32 = 16, const BITS: u32 = 12>;

impl<const CONVERSIONS: u32, const BITS: u32> Potentiometer<CONVERSIONS, BITS> {
    /// What it is.
    pub const SENSOR: wire::Sensor = wire::Sensor {
        kind: SensorKind::Potentiometer,
        rate_hz: 1000,
        delay_us: (500 * (CONVERSIONS - 1) / CONVERSIONS) as u16,
    };
    /// A conversion's bits.
    pub const MASK: u16 = {
        assert!(BITS >= 8 && BITS <= 16, "bits of a converter");
        ((1_u32 << BITS) - 1) as u16
    };
    /// The highest sum.
    pub const FULL_SCALE_COUNTS: u16 = {
        let highest = CONVERSIONS * Self::MASK as u32;
        assert!(highest <= u16::MAX as u32 && highest >= 4095, "a sum of 12 to 16 bits");
        highest as u16
    };
}

impl<const CONVERSIONS: u32, const BITS: u32> Sensor for Potentiometer<CONVERSIONS, BITS> {
    type Raw = u16;

    fn about(&self) -> About {
        About {
            sensor: Self::SENSOR,
            degrees_per_count: None,
            step_deg: 0.0,
            full_scale_counts: Self::FULL_SCALE_COUNTS,
        }
    }

    // As it is: a scale that were stretched to all of 16 bits would have steps, and be bent at each.
    #[inline]
    fn reading(&mut self, sum: u16) -> Reading {
        Reading { fine: Some(i32::from(sum) << FINE_BITS), flags: Flags::default() }
    }
}
