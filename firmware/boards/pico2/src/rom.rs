//! The boot ROM's flash functions (RP2350 datasheet, 5.4.8), called from RAM: while they are at work, and until the fast
//! way of reading is set up again, nothing can be read from the flash, code neither.

use crate::flash::{Rom, FLASH_BYTES, PAGE, SECTOR};
use core::mem::transmute;
use core::ptr::{copy_nonoverlapping, read_volatile};
use cortex_m::asm::{dsb, isb};
use rp235x_hal::rom_data;

/// Where the flash is seen.
const XIP: usize = 0x1000_0000;
/// Where the boot ROM leaves the function that sets up reading as it found best; to be run in RAM (5.4.8.10).
const BOOT_RAM: usize = 0x400e_0000;
const SETUP_WORDS: usize = 64;
/// Erases a block of 64 KiB, where one is to be erased; of sectors there is but one.
const BLOCK: u32 = 1 << 16;
const BLOCK_ERASE: u8 = 0xd8;

/// What is to be done to the flash.
#[derive(Clone, Copy)]
enum Work {
    Erase { offset: u32 },
    Write { offset: u32, page: *const u8 },
}

/// All that is called, found beforehand.
struct Functions {
    connect: unsafe extern "C" fn(),
    exit_xip: unsafe extern "C" fn(),
    erase: unsafe extern "C" fn(u32, usize, u32, u8),
    write: unsafe extern "C" fn(u32, *const u8, usize),
    flush_cache: unsafe extern "C" fn(),
    set_up: unsafe extern "C" fn(),
}

/// The flash; there is but one.
pub struct BootRom(());

impl BootRom {
    /// # Safety
    /// One of them, no interrupt handlers, and the other core not started.
    pub const unsafe fn new() -> Self {
        Self(())
    }

    fn work(&mut self, work: Work) {
        let mut code = [0_u32; SETUP_WORDS];
        for (index, word) in code.iter_mut().enumerate() {
            // SAFETY: RAM of the boot ROM's, readable.
            *word = unsafe { read_volatile((BOOT_RAM as *const u32).add(index)) };
        }
        // SAFETY: thumb code of that many words at most, which stands wherever it is; now in RAM.
        let set_up =
            unsafe { transmute::<usize, unsafe extern "C" fn()>(code.as_ptr() as usize | 1) };
        dsb();
        isb();
        let functions = Functions {
            connect: rom_data::connect_internal_flash::ptr(),
            exit_xip: rom_data::flash_exit_xip::ptr(),
            erase: rom_data::flash_range_erase::ptr(),
            write: rom_data::flash_range_program::ptr(),
            flush_cache: rom_data::flash_flush_cache::ptr(),
            set_up,
        };
        // SAFETY: within the networks' places, as the one caller's tests show; nothing runs beside it.
        cortex_m::interrupt::free(|_| unsafe { in_ram(&functions, work) });
    }
}

/// Copied to RAM with the variables. It calls nothing but what is given.
#[inline(never)]
#[link_section = ".data.in_ram"]
unsafe fn in_ram(functions: &Functions, work: Work) {
    (functions.connect)();
    (functions.exit_xip)();
    match work {
        Work::Erase { offset } => (functions.erase)(offset, SECTOR, BLOCK, BLOCK_ERASE),
        Work::Write { offset, page } => (functions.write)(offset, page, PAGE),
    }
    (functions.flush_cache)();
    (functions.set_up)();
}

impl Rom for BootRom {
    fn erase_sector(&mut self, offset: usize) {
        assert!(offset + SECTOR <= FLASH_BYTES);
        self.work(Work::Erase { offset: offset as u32 });
    }

    fn write_page(&mut self, offset: usize, page: &[u8; PAGE]) {
        assert!(offset + PAGE <= FLASH_BYTES);
        self.work(Work::Write { offset: offset as u32, page: page.as_ptr() });
    }

    fn read(&self, offset: usize, room: &mut [u8]) {
        assert!(offset + room.len() <= FLASH_BYTES);
        // SAFETY: memory that is there and holds no code; no reference to it is kept.
        unsafe { copy_nonoverlapping((XIP + offset) as *const u8, room.as_mut_ptr(), room.len()) };
    }
}
