//! How a timer's clock becomes the rate of conversions.

use yawrig_firmware::ring::CONVERSIONS;

/// Samples a second, of sixteen conversions each.
pub const RATE_HZ: u32 = 1000;
pub const CONVERSIONS_HZ: u32 = RATE_HZ * CONVERSIONS;

/// The period that a timer without a prescaler counts at `clock_hz`, as its register holds it: one less. `None` where
/// that leaves a remainder: natural frequencies would be wrong by it.
pub const fn period(clock_hz: u32, rate_hz: u32) -> Option<u32> {
    if rate_hz == 0 || clock_hz < rate_hz || !clock_hz.is_multiple_of(rate_hz) {
        return None;
    }
    Some(clock_hz / rate_hz - 1)
}
