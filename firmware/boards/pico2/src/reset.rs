//! What made the processor start.

use yawrig_shared::wire::Cause;

/// POWMAN's CHIP_RESET (RP2350 datasheet, 6.4), the watchdog's REASON (12.9.7).
const HAD_POWER_ON: u32 = 1 << 16;
const HAD_BROWN_OUT: u32 = 1 << 17;
const HAD_RUN_LOW: u32 = 1 << 18;
const REASON_TIMER: u32 = 1 << 0;
const REASON_FORCE: u32 = 1 << 1;

/// Which of the causes it was. The watchdog's is the later one: it leaves the chip's own cause as it was.
pub fn cause(chip_reset: u32, watchdog_reason: u32) -> Cause {
    match () {
        () if watchdog_reason & REASON_TIMER != 0 => Cause::Watchdog,
        () if watchdog_reason & REASON_FORCE != 0 => Cause::Software,
        () if chip_reset & (HAD_POWER_ON | HAD_BROWN_OUT) != 0 => Cause::Power,
        () if chip_reset & HAD_RUN_LOW != 0 => Cause::Pin,
        () => Cause::Unknown,
    }
}
