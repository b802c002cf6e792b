//! The device with a fault put in: its main loop hangs for good after 3000 samples, and its watchdog resets
//! it. For the test of what the host makes of that.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use yawrig_mps2_an386::{run, say, watchdog};

const HANGS_AFTER: u32 = 3000;

#[entry]
fn main() -> ! {
    run::run(|samples| {
        if samples >= HANGS_AFTER {
            say(&["yawrig hangs"]);
            // SAFETY: once, here.
            unsafe { watchdog::start() };
            loop {
                core::hint::spin_loop();
            }
        }
    })
}
