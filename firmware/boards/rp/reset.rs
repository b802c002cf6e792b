//! What made the processor start.

use yawrig_shared::wire::Cause;

/// The watchdog's REASON (RP2040 datasheet, 4.7.6; RP2350's, 12.9.7).
const REASON_TIMER: u32 = 1 << 0;
const REASON_FORCE: u32 = 1 << 1;

/// Which of the causes it was. The watchdog's is the later one: it leaves the chip's own cause as it was.
pub fn cause(had_power_on: bool, had_run_low: bool, watchdog_reason: u32) -> Cause {
    match () {
        () if watchdog_reason & REASON_TIMER != 0 => Cause::Watchdog,
        () if watchdog_reason & REASON_FORCE != 0 => Cause::Software,
        () if had_power_on => Cause::Power,
        () if had_run_low => Cause::Pin,
        () => Cause::Unknown,
    }
}
