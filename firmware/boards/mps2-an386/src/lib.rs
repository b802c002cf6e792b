//! What the images for QEMU's mps2-an386 share.
#![no_std]

pub mod uart;

use core::panic::PanicInfo;
use cortex_m_semihosting::{debug, hprintln};

/// Says where, and ends the emulator as failed. The message stays unsaid: what prints any value at all takes a third
/// of the image.
#[panic_handler]
fn panicked(info: &PanicInfo) -> ! {
    if let Some(place) = info.location() {
        hprintln!("panicked at {}:{}", place.file(), place.line());
    }
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
