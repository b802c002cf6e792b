//! An encoder that gives its angle within a turn as a number, over SPI or whatever else. How its frame is
//! taken apart is the board's: one whose parity is wrong, or that says it has failed, is none.

use super::turns::{Turns, DEGREES_PER_COUNT};
use crate::sensor::{About, Reading, Sensor};
use yawrig_shared::wire::{self, Flags, SensorKind};

/// One of so many bits, read at this rate.
#[derive(Clone, Copy, Debug)]
pub struct Absolute {
    rate_hz: u16,
    delay_us: u16,
    turns: Turns,
}

impl Absolute {
    /// Of 8 to 22 bits; `delay_us` is that of its own filter.
    pub const fn new(bits: u32, rate_hz: u16, delay_us: u16) -> Self {
        assert!(bits >= 8 && bits <= 22, "bits of an encoder");
        Self { rate_hz, delay_us, turns: Turns::new(1 << bits) }
    }
}

impl Sensor for Absolute {
    type Raw = u32;

    fn about(&self) -> About {
        let Self { rate_hz, delay_us, .. } = *self;
        About {
            sensor: wire::Sensor { kind: SensorKind::Absolute, rate_hz, delay_us },
            degrees_per_count: Some(DEGREES_PER_COUNT),
            step_deg: self.turns.step_deg(),
            full_scale_counts: u16::MAX,
        }
    }

    #[inline]
    fn reading(&mut self, position: u32) -> Reading {
        self.turns.turn_to(position);
        Reading { fine: Some(self.turns.fine()), flags: Flags::default() }
    }
}
