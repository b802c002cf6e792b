//! ARM CMSDK APB watchdog, as on the MPS2 board, for the image with a hang in it.
//!
//! It counts down twice: at the end of the first time it asks for an NMI, at the end of the second it resets
//! the machine.

use core::ptr::write_volatile;
use cortex_m_rt::exception;

const BASE: usize = 0x4000_8000;
const LOAD: usize = 0x000;
const CONTROL: usize = 0x008;
const LOCK: usize = 0xc00;
const UNLOCK: u32 = 0x1acc_e551;
const CONTROL_COUNT: u32 = 1 << 0;
const CONTROL_RESET: u32 = 1 << 1;
/// A second at 25 MHz.
const TICKS: u32 = 25_000_000;

/// Starts the board's watchdog, which nobody feeds: two seconds later it resets the board.
///
/// # Safety
/// The only use of this board's watchdog.
pub unsafe fn start() {
    let write = |offset: usize, value: u32| {
        // SAFETY: a register of this board's watchdog.
        unsafe { write_volatile((BASE + offset) as *mut u32, value) }
    };
    write(LOCK, UNLOCK);
    write(LOAD, TICKS);
    write(CONTROL, CONTROL_COUNT | CONTROL_RESET);
}

/// Half the time is over.
#[exception]
unsafe fn NonMaskableInt() {}
