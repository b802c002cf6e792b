//! ARM CMSDK APB watchdog, as on the MPS2 board: a main loop that hangs for eight seconds is reset.
//!
//! It counts down twice: at the end of the first time it asks for an NMI, at the end of the second it resets the
//! machine. So long because the emulator's clock goes on while a busy host lets it wait.

use core::ptr::write_volatile;
use cortex_m_rt::exception;

const BASE: usize = 0x4000_8000;
const LOAD: usize = 0x000;
const CONTROL: usize = 0x008;
const INTCLR: usize = 0x00c;
const LOCK: usize = 0xc00;
const UNLOCK: u32 = 0x1acc_e551;
const CONTROL_COUNT: u32 = 1 << 0;
const CONTROL_RESET: u32 = 1 << 1;
/// 4 s at 25 MHz.
const TICKS: u32 = 100_000_000;

/// The board's watchdog, running.
pub struct Watchdog(());

impl Watchdog {
    /// Starts it.
    ///
    /// # Safety
    /// Called once.
    pub unsafe fn start() -> Self {
        let mut watchdog = Self(());
        watchdog.write(LOCK, UNLOCK);
        watchdog.write(LOAD, TICKS);
        watchdog.write(CONTROL, CONTROL_COUNT | CONTROL_RESET);
        watchdog
    }

    /// All is well: it counts anew.
    pub fn feed(&mut self) {
        self.write(INTCLR, 1);
    }

    fn write(&mut self, offset: usize, value: u32) {
        // SAFETY: a register of this board's watchdog, of which `self` is the only owner.
        unsafe { write_volatile((BASE + offset) as *mut u32, value) }
    }
}

/// Half the time is over; a loop that goes on feeds the watchdog yet.
#[exception]
unsafe fn NonMaskableInt() {}
