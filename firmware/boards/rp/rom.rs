//! The boot ROM's flash functions (RP2040 datasheet, 2.8.3.1.3; RP2350's, 5.4.8), called from RAM: while
//! they are at work, and until the fast way of reading is set up again, nothing can be read from the flash,
//! code neither.

use super::chip::FLASH_BYTES;
use super::flash::{Rom, PAGE, SECTOR};
use super::hal::rom_data;
use super::SETUP;
use core::mem::transmute;
use core::ptr::{copy_nonoverlapping, read_volatile};
use cortex_m::asm::{dsb, isb};

/// Where the flash is seen.
const XIP: usize = 0x1000_0000;
const SETUP_WORDS: usize = 64;
/// Erases a block of 64 KiB, where one is to be erased; of sectors there is but one.
const BLOCK: usize = 1 << 16;
const BLOCK_ERASE: usize = 0xd8;

/// A function with four arguments at most, none wider than a register.
pub type Function = unsafe extern "C" fn(usize, usize, usize, usize);

/// All that is called, found beforehand.
struct Functions {
    connect: unsafe extern "C" fn(),
    exit_xip: unsafe extern "C" fn(),
    flush_cache: unsafe extern "C" fn(),
    set_up: unsafe extern "C" fn(),
}

/// The flash; there is but one.
pub struct BootRom(());

impl BootRom {
    /// # Safety
    /// One of them, and the other core not started.
    pub const unsafe fn new() -> Self {
        Self(())
    }

    /// Calls it while the flash takes commands.
    ///
    /// # Safety
    /// It touches nothing of the flash but by commands, and lies in RAM or the boot ROM.
    pub unsafe fn call(&mut self, function: Function, arguments: [usize; 4]) {
        let mut code = [0_u32; SETUP_WORDS];
        for (index, word) in code.iter_mut().enumerate() {
            // SAFETY: readable, wherever the chip keeps it.
            *word = unsafe { read_volatile((SETUP as *const u32).add(index)) };
        }
        // SAFETY: thumb code of that many words at most, which stands wherever it is; now in RAM.
        let set_up =
            unsafe { transmute::<usize, unsafe extern "C" fn()>(code.as_ptr() as usize | 1) };
        dsb();
        isb();
        let functions = Functions {
            connect: rom_data::connect_internal_flash::ptr(),
            exit_xip: rom_data::flash_exit_xip::ptr(),
            flush_cache: rom_data::flash_flush_cache::ptr(),
            set_up,
        };
        // SAFETY: as the caller says; nothing runs beside it.
        cortex_m::interrupt::free(|_| unsafe { in_ram(&functions, function, &arguments) });
    }
}

/// Copied to RAM with the variables. It calls nothing but what is given.
#[inline(never)]
#[link_section = ".data.in_ram"]
unsafe fn in_ram(functions: &Functions, function: Function, arguments: &[usize; 4]) {
    (functions.connect)();
    (functions.exit_xip)();
    let [first, second, third, fourth] = *arguments;
    function(first, second, third, fourth);
    (functions.flush_cache)();
    (functions.set_up)();
}

impl Rom for BootRom {
    fn erase_sector(&mut self, offset: usize) {
        assert!(offset + SECTOR <= FLASH_BYTES);
        // SAFETY: the boot ROM's, whose arguments take a register each; within the networks' places, as the
        // caller's tests show.
        unsafe {
            let erase: Function = transmute(rom_data::flash_range_erase::ptr());
            self.call(erase, [offset, SECTOR, BLOCK, BLOCK_ERASE]);
        }
    }

    fn write_page(&mut self, offset: usize, page: &[u8; PAGE]) {
        assert!(offset + PAGE <= FLASH_BYTES);
        // SAFETY: as above; the page is in RAM.
        unsafe {
            let write: Function = transmute(rom_data::flash_range_program::ptr());
            self.call(write, [offset, page.as_ptr() as usize, PAGE, 0]);
        }
    }

    fn read(&self, offset: usize, room: &mut [u8]) {
        assert!(offset + room.len() <= FLASH_BYTES);
        // SAFETY: memory that is there and holds no code; no reference to it is kept.
        unsafe { copy_nonoverlapping((XIP + offset) as *const u8, room.as_mut_ptr(), room.len()) };
    }
}
