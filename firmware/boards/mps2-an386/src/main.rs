//! The yawrig device on QEMU's mps2-an386: UART0 is the host link, UART1 the potentiometer.
#![no_std]
#![no_main]

use cortex_m_rt::{entry, exception, ExceptionFrame};
use yawrig_mps2_an386::{digits, run, say};

#[entry]
fn main() -> ! {
    run::run(|_| ())
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    say(&["hard fault at 0x", digits(frame.pc(), 16, &mut [0; 10])]);
    panic!();
}
