//! The AS5600, a magnetic encoder of 12 bits on an I2C bus.
//!
//! Status and angle are read in one transfer, so what is said of the magnet is of this very angle, and the
//! same three bytes may come from a driver that waits, one that is awaited, or DMA. (The crate `as5600` asks
//! for the two by themselves and takes a missing magnet for an error of its own.) Section and figure numbers
//! are those of the data sheet, v1-06.

use super::turns::{Turns, DEGREES_PER_COUNT};
use crate::sensor::{About, Reading, Sensor};
use embedded_hal::i2c::I2c;
use yawrig_shared::wire::{self, Flags, SensorKind};

/// On the bus.
pub const ADDRESS: u8 = 0x36;
/// What is written before the three bytes are read: STATUS, and RAW ANGLE behind it, which is not cut to a
/// part of the turn.
pub const ASKED: [u8; 1] = [0x0b];
const CONFIGURATION: u8 = 0x07;
/// STATUS, figure 21.
const MAGNET_TOO_STRONG: u8 = 1 << 3;
const MAGNET_TOO_WEAK: u8 = 1 << 4;
const MAGNET_DETECTED: u8 = 1 << 5;

/// The sensor's own filter, figure 29: noise against delay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Filter {
    /// 0.015 deg rms, 2.2 ms; as it comes.
    #[default]
    Means16,
    /// 0.021 deg rms, 1.1 ms.
    Means8,
    /// 0.030 deg rms, 0.55 ms.
    Means4,
    /// 0.043 deg rms, 0.286 ms.
    Means2,
}

impl Filter {
    const fn delay_us(self) -> u16 {
        match self {
            Self::Means16 => 2200,
            Self::Means8 => 1100,
            Self::Means4 => 550,
            Self::Means2 => 286,
        }
    }
}

/// One that is read at this rate.
#[derive(Clone, Copy, Debug)]
pub struct As5600 {
    rate_hz: u16,
    filter: Filter,
    turns: Turns,
}

impl As5600 {
    /// A transfer takes 0.57 ms on a bus of 100 kHz, 0.15 ms on one of 400 kHz.
    pub const fn new(rate_hz: u16, filter: Filter) -> Self {
        Self { rate_hz, filter, turns: Turns::new(4096) }
    }

    /// Sets the filter; as it comes, the sensor has the slowest.
    ///
    /// # Errors
    /// Those of the bus.
    pub fn set_up<I: I2c>(&self, bus: &mut I) -> Result<(), I::Error> {
        let mut high = [0];
        bus.write_read(ADDRESS, &[CONFIGURATION], &mut high)?;
        // Watchdog and fast filter off, which would change the filter in mid-swing; the two highest bits as
        // they are.
        bus.write(ADDRESS, &[CONFIGURATION, high[0] & 0xc0 | self.filter as u8])
    }

    /// Reads it, waiting for the bus; none where that does not answer.
    pub fn read<I: I2c>(&self, bus: &mut I) -> Option<[u8; 3]> {
        let mut raw = [0; 3];
        bus.write_read(ADDRESS, &ASKED, &mut raw).ok().map(|()| raw)
    }
}

impl Sensor for As5600 {
    type Raw = [u8; 3];

    fn about(&self) -> About {
        About {
            sensor: wire::Sensor {
                kind: SensorKind::As5600,
                rate_hz: self.rate_hz,
                // And the 150 us for which an angle stands.
                delay_us: self.filter.delay_us() + 150,
            },
            degrees_per_count: Some(DEGREES_PER_COUNT),
            step_deg: self.turns.step_deg(),
            full_scale_counts: u16::MAX,
        }
    }

    #[inline]
    fn reading(&mut self, [status, high, low]: [u8; 3]) -> Reading {
        let mut flags = Flags::default();
        if status & (MAGNET_TOO_STRONG | MAGNET_TOO_WEAK) != 0 {
            flags.set(Flags::MAGNET);
        }
        if status & MAGNET_DETECTED == 0 {
            flags.set(Flags::MAGNET);
            return Reading { fine: None, flags };
        }
        self.turns.turn_to(u32::from(u16::from_be_bytes([high & 0x0f, low])));
        Reading { fine: Some(self.turns.fine()), flags }
    }
}
