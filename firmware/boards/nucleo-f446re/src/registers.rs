//! The flash interface itself.

use crate::brown_out::Options;
use crate::flash::{Controller, SR_BUSY};
use cortex_m::asm::dsb;
use stm32f4xx_hal::pac::FLASH;
use yawrig_firmware::slots::SLOT_BYTES;

const FLASH_AT: usize = 0x0800_0000;

/// The microcontroller's flash: its registers, and the sectors 1 to 4.
pub struct Registers {
    flash: FLASH,
}

impl Registers {
    pub fn new(flash: FLASH) -> Self {
        Self { flash }
    }
}

/// Where one of the sectors lies that hold no code.
fn address(number: u32) -> usize {
    match number {
        1..=3 => FLASH_AT + number as usize * SLOT_BYTES,
        4 => FLASH_AT + 64 * 1024,
        _ => panic!("code"),
    }
}

/// In RAM: at an instruction of the flash the processor would stand still until the end, interrupts included.
///
/// # Safety
/// `control` and `status` are the flash interface's, and the sector is one that [`address`] knows.
#[inline(never)]
#[link_section = ".data.erase"]
unsafe fn erase(control: *mut u32, status: *const u32, what: u32) {
    control.write_volatile(what);
    dsb();
    while status.read_volatile() & SR_BUSY != 0 {}
}

impl Controller for Registers {
    fn status(&self) -> u32 {
        self.flash.sr().read().bits()
    }

    fn clear_status(&mut self, bits: u32) {
        // SAFETY: clears by writing ones.
        self.flash.sr().write(|w| unsafe { w.bits(bits) });
    }

    fn control(&self) -> u32 {
        self.flash.cr().read().bits()
    }

    fn set_control(&mut self, value: u32) {
        // SAFETY: nothing but the slots' sectors is erased or written, as the one caller's tests show.
        self.flash.cr().write(|w| unsafe { w.bits(value) });
        dsb();
    }

    fn unlock(&mut self, key: u32) {
        // SAFETY: the register is there for this.
        self.flash.keyr().write(|w| unsafe { w.bits(key) });
    }

    fn erase(&mut self, what: u32) {
        // SAFETY: the sectors are those of the slots, as the one caller's tests show.
        unsafe { erase(self.flash.cr().as_ptr(), self.flash.sr().as_ptr(), what) }
    }

    fn empty_cache(&mut self) {
        // Only while it is off.
        self.flash.acr().modify(|_, w| w.dcen().clear_bit());
        self.flash.acr().modify(|_, w| w.dcrst().set_bit());
        self.flash.acr().modify(|_, w| w.dcrst().clear_bit().dcen().set_bit());
    }

    fn sector(&self, number: u32) -> &[u8; SLOT_BYTES] {
        // SAFETY: memory that is there, holds no code, and changes only where `self` is borrowed for writing.
        unsafe { &*(address(number) as *const [u8; SLOT_BYTES]) }
    }

    fn write_word(&mut self, number: u32, offset: usize, word: u32) {
        assert!(offset < SLOT_BYTES && offset.is_multiple_of(4));
        // SAFETY: within the sector, aligned; the interface takes it as a word to program.
        unsafe { core::ptr::write_volatile((address(number) + offset) as *mut u32, word) };
        dsb();
    }
}

impl Options for Registers {
    fn control(&self) -> u32 {
        self.flash.optcr().read().bits()
    }

    fn set_control(&mut self, value: u32) {
        // SAFETY: as it was but for the level, which every supply of the board's is above.
        self.flash.optcr().write(|w| unsafe { w.bits(value) });
        dsb();
    }

    fn unlock(&mut self, key: u32) {
        // SAFETY: the register is there for this.
        self.flash.optkeyr().write(|w| unsafe { w.bits(key) });
    }

    fn is_busy(&self) -> bool {
        self.flash.sr().read().bits() & SR_BUSY != 0
    }
}
