//! How the converter's clock becomes the rate of conversions, and time their number.

use yawrig_firmware::conversions::{period, CONVERSIONS_HZ};

/// What the converter's divider holds so that a conversion begins each so many cycles: one less. `None`
/// where that leaves a remainder, is less than the 96 cycles a conversion takes, or does not fit the
/// divider's 16 bits.
pub fn divider(clock_hz: u32) -> Option<u16> {
    period(clock_hz).filter(|period| *period >= 95)?.try_into().ok()
}

/// Readings there are so many microseconds after the first: timer and converter have one crystal.
pub const fn readings(microseconds: u64) -> u32 {
    (microseconds * CONVERSIONS_HZ as u64 / 1_000_000) as u32 + 1
}

/// Within this the first reading comes, by far: a conversion takes 2 us.
pub const FIRST_READING_US: u64 = 1000;
