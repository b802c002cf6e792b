//! How the converter's clock becomes the rate of conversions, and time their number.

use yawrig_firmware::ring::CONVERSIONS;

/// Samples a second, of sixteen conversions each.
pub const RATE_HZ: u32 = 1000;
pub const CONVERSIONS_HZ: u32 = RATE_HZ * CONVERSIONS;

/// What the converter's divider holds so that a conversion begins each so many cycles: one less. `None` where that leaves
/// a remainder, or does not fit its 16 bits: natural frequencies would be wrong by it.
pub const fn divider(clock_hz: u32, rate_hz: u32) -> Option<u16> {
    // A conversion takes 96 cycles.
    if rate_hz == 0 || !clock_hz.is_multiple_of(rate_hz) || clock_hz / rate_hz < 96 {
        return None;
    }
    let cycles = clock_hz / rate_hz - 1;
    if cycles > u16::MAX as u32 {
        return None;
    }
    Some(cycles as u16)
}

/// Readings there are so many microseconds after the first: timer and converter have one crystal.
pub const fn readings(microseconds: u64) -> u32 {
    (microseconds * CONVERSIONS_HZ as u64 / 1_000_000) as u32 + 1
}
