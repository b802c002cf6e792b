//! What made the processor start.

use yawrig_shared::wire::Cause;

// RCC_CSR, RM0390, 6.3.21.
const CSR_BROWN_OUT: u32 = 1 << 25;
const CSR_PIN: u32 = 1 << 26;
const CSR_POWER: u32 = 1 << 27;
const CSR_SOFTWARE: u32 = 1 << 28;
const CSR_WATCHDOGS: u32 = 0b11 << 29;

/// Which of the causes it was; the pin is pulled by all the others, too.
pub fn cause(csr: u32) -> Cause {
    match csr {
        _ if csr & (CSR_POWER | CSR_BROWN_OUT) != 0 => Cause::Power,
        _ if csr & CSR_WATCHDOGS != 0 => Cause::Watchdog,
        _ if csr & CSR_SOFTWARE != 0 => Cause::Software,
        _ if csr & CSR_PIN != 0 => Cause::Pin,
        _ => Cause::Unknown,
    }
}
