//! The network's slots in the microcontroller's own flash (RM0390, chapter 3).
//!
//! There is one bank: while a sector is erased (16 KiB in 0.25 s, at most 0.5 s; 64 KiB in 0.55 s, at most
//! 1.1 s) or a word programmed (16 us) the processor waits at its next instruction of the flash. What waits
//! for an erase is in RAM, as is what takes the samples meanwhile.

use embedded_storage::nor_flash::{
    check_erase, check_read, check_write, ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash,
};
use yawrig_firmware::slots::SLOT_BYTES;

/// What RM0390 calls CR, as bits.
pub const CR_PG: u32 = 1 << 0;
pub const CR_SER: u32 = 1 << 1;
pub const CR_SNB: u32 = 3;
/// Four bytes at a time, which a supply of 2.7 V and more allows.
pub const CR_PSIZE_WORD: u32 = 0b10 << 8;
pub const CR_STRT: u32 = 1 << 16;
pub const CR_LOCK: u32 = 1 << 31;
/// The same for SR.
pub const SR_EOP: u32 = 1 << 0;
pub const SR_BUSY: u32 = 1 << 16;
/// Operation, write protection, alignment, parallelism, sequence, read protection.
pub const SR_ERRORS: u32 = 0b1_1111_0010;
pub const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

/// The flash interface: its registers, and the memory itself.
pub trait Controller {
    fn status(&self) -> u32;
    /// Clears the bits that are set here.
    fn clear_status(&mut self, bits: u32);
    fn control(&self) -> u32;
    fn set_control(&mut self, value: u32);
    fn unlock(&mut self, key: u32);
    /// Begins to erase, as these bits of CR say, and waits for the end; nothing of it is in the flash.
    fn erase(&mut self, what: u32);
    /// Empties the data cache, which erasing does not.
    fn empty_cache(&mut self);
    /// A sector of [`SLOT_BYTES`].
    fn sector(&self, number: u32) -> &[u8; SLOT_BYTES];
    fn write_word(&mut self, number: u32, offset: usize, word: u32);
}

/// Two slots and the lock's two places as one flash of four sectors: three of 16 KiB, and the first 16 KiB of
/// a larger one.
pub struct Slots<C> {
    controller: C,
}

/// Their numbers in the microcontroller. Sector 0 is the vector table's, and code begins at sector 5. The
/// larger one is a network's: only the host has it erased, while the records' places are whenever what was
/// learnt has filled one.
pub const NUMBERS: [u32; 4] = [1, 4, 2, 3];

/// In which of the microcontroller's sectors a byte is, and where in it.
fn place(offset: usize) -> (u32, usize) {
    (NUMBERS[offset / SLOT_BYTES], offset % SLOT_BYTES)
}

impl<C: Controller> Slots<C> {
    pub const fn new(controller: C) -> Self {
        Self { controller }
    }

    /// Writes with `what` set in the control register, which is locked before and after.
    fn write_with(
        &mut self,
        what: u32,
        write: impl FnOnce(&mut C),
    ) -> Result<(), NorFlashErrorKind> {
        let c = &mut self.controller;
        while c.status() & SR_BUSY != 0 {}
        if c.control() & CR_LOCK != 0 {
            KEYS.into_iter().for_each(|key| c.unlock(key));
        }
        c.clear_status(SR_ERRORS | SR_EOP);
        c.set_control(what);
        write(c);
        while c.status() & SR_BUSY != 0 {}
        let faults = c.status() & SR_ERRORS;
        c.set_control(CR_LOCK);
        if faults == 0 {
            Ok(())
        } else {
            Err(NorFlashErrorKind::Other)
        }
    }
}

impl<C> ErrorType for Slots<C> {
    type Error = NorFlashErrorKind;
}

impl<C: Controller> ReadNorFlash for Slots<C> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, room: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, room.len())?;
        let (number, at) = place(offset as usize);
        // Within one sector, as all that is asked for is.
        let found = self.controller.sector(number).get(at..at + room.len());
        room.copy_from_slice(found.ok_or(NorFlashErrorKind::OutOfBounds)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        NUMBERS.len() * SLOT_BYTES
    }
}

impl<C: Controller> NorFlash for Slots<C> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SLOT_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for at in (from as usize..to as usize).step_by(SLOT_BYTES) {
            let what = CR_SER | place(at).0 << CR_SNB | CR_PSIZE_WORD;
            let erased = self.write_with(what, |c| c.erase(what | CR_STRT));
            self.controller.empty_cache();
            erased?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (index, word) in bytes.chunks_exact(4).enumerate() {
            let (number, at) = place(offset as usize + 4 * index);
            let word = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
            self.write_with(CR_PG | CR_PSIZE_WORD, |c| c.write_word(number, at, word))?;
        }
        Ok(())
    }
}
