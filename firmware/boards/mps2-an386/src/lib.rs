//! What the images for QEMU's mps2-an386 share.
#![no_std]

pub mod flash;
pub mod run;
pub mod stack;
pub mod swing;
pub mod uart;
pub mod watchdog;

use core::panic::PanicInfo;
use cortex_m_semihosting::{debug, hio};

/// Says where, and ends the emulator as failed. The message stays unsaid: what prints any value at all takes
/// a third of the image.
#[panic_handler]
fn panicked(info: &PanicInfo) -> ! {
    if let Some(place) = info.location() {
        say(&["panicked at ", place.file(), ":", digits(place.line(), 10, &mut [0; 10])]);
    }
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

/// A line on QEMU's output. Not by core's formatting, which takes a tenth of the image.
pub fn say(parts: &[&str]) {
    let Ok(mut out) = hio::hstdout() else { return };
    for part in parts.iter().chain(&["\n"]) {
        let _ = out.write_all(part.as_bytes());
    }
}

/// A number's digits to this base (2 to 16; ten places hold any to base 10 or 16).
pub fn digits(number: u32, base: u32, room: &mut [u8; 10]) -> &str {
    let mut left = number;
    let mut from = room.len();
    while from > 0 {
        from -= 1;
        room[from] = b"0123456789abcdef"[(left % base) as usize & 15];
        left /= base;
        if left == 0 {
            break;
        }
    }
    core::str::from_utf8(&room[from..]).unwrap_or_default()
}
