//! The flash's own number: of the chip there is none.

use crate::hal::pac::{IO_QSPI, XIP_SSI};
use crate::rom::BootRom;

/// Read unique ID (W25Q16JV data sheet, 8.2): the command, four bytes of nothing, then the number.
const READ_UNIQUE_ID: u32 = 0x4b;
const BEFORE: usize = 1 + 4;
const BYTES: usize = 8;
/// GPIO_QSPI_SS_CTRL's OUTOVER, bits 8 and 9 (RP2040 datasheet, 2.19.6.2): low, high.
const SELECTED: u32 = 2 << 8;
const NOT_SELECTED: u32 = 3 << 8;
/// SR of the SSI (4.10.13): what it has received holds something.
const RECEIVED: u32 = 1 << 3;

pub fn read(rom: &mut BootRom) -> u64 {
    let mut number = 0_u64;
    // SAFETY: in RAM, with a place for the number.
    unsafe { rom.call(in_ram, [(&raw mut number) as usize, 0, 0, 0]) };
    number
}

/// Copied to RAM with the variables. It calls nothing and reads no constant from elsewhere.
#[inline(never)]
#[link_section = ".data.unique_id"]
unsafe extern "C" fn in_ram(number: usize, _: usize, _: usize, _: usize) {
    let (port, pins) = (&*XIP_SSI::PTR, &*IO_QSPI::PTR);
    let select = pins.gpio_qspiss().gpio_ctrl();
    select.write(|w| w.bits(SELECTED));
    // All at once: it holds sixteen.
    port.dr0().write(|w| w.bits(READ_UNIQUE_ID));
    for _ in 1..BEFORE + BYTES {
        port.dr0().write(|w| w.bits(0));
    }
    let mut read = 0_u64;
    for _ in 0..BEFORE + BYTES {
        while port.sr().read().bits() & RECEIVED == 0 {}
        // Of those before the number nothing is left.
        read = read << 8 | u64::from(port.dr0().read().bits() & 0xff);
    }
    select.write(|w| w.bits(NOT_SELECTED));
    (number as *mut u64).write_volatile(read);
}
