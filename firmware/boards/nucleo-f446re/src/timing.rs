//! How a timer's clock becomes the sampling rate.

/// Samples a second.
pub const RATE_HZ: u32 = 1000;

/// What a timer divides its clock by: `prescaler` and `period` as its registers hold them, one less each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Division {
    pub prescaler: u16,
    pub period: u32,
}

/// Divides `clock_hz` into exactly `rate_hz`, by way of microseconds; `None` where that leaves a remainder:
/// natural frequencies would be wrong by it.
pub const fn divide(clock_hz: u32, rate_hz: u32) -> Option<Division> {
    const TICKS_HZ: u32 = 1_000_000;
    if rate_hz == 0 || !clock_hz.is_multiple_of(TICKS_HZ) || !TICKS_HZ.is_multiple_of(rate_hz) {
        return None;
    }
    let (prescaler, period) = (clock_hz / TICKS_HZ, TICKS_HZ / rate_hz);
    if prescaler == 0 || prescaler > 1 << 16 {
        return None;
    }
    Some(Division { prescaler: (prescaler - 1) as u16, period: period - 1 })
}
