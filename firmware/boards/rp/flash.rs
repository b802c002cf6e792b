//! The networks' places in the flash beside the processor, its last 64 KiB, and the log's before them.
//!
//! Code runs from that flash. While it is erased (45 ms a sector, at most 0.4 s) or written (0.4 ms a page)
//! the processor is in the boot ROM; DMA goes on into RAM, and USB lets the host wait.

use super::chip::FLASH_BYTES;
use embedded_storage::nor_flash::{
    check_erase, check_read, check_write, ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash,
};
use yawrig_firmware::slots::SLOT_BYTES;

/// What the flash writes and erases at once.
pub const PAGE: usize = 256;
pub const SECTOR: usize = 4096;
/// Where in the flash the log begins, and behind it the places.
pub const BEGIN: usize = PLACES - LOG_BYTES;
const PLACES: usize = FLASH_BYTES - PLACES_BYTES;
const PLACES_BYTES: usize = 4 * SLOT_BYTES;
const LOG_BYTES: usize = 256 * 1024;

/// Where in the flash something is: the device has its log behind the places.
fn place(offset: usize) -> usize {
    match offset.checked_sub(PLACES_BYTES) {
        Some(of_log) => BEGIN + of_log,
        None => PLACES + offset,
    }
}

/// The boot ROM's functions, and the memory they are for. Offsets are from the beginning of the flash.
pub trait Rom {
    fn erase_sector(&mut self, offset: usize);
    fn write_page(&mut self, offset: usize, page: &[u8; PAGE]);
    fn read(&self, offset: usize, room: &mut [u8]);
}

pub struct Slots<R> {
    rom: R,
}

impl<R: Rom> Slots<R> {
    pub const fn new(rom: R) -> Self {
        Self { rom }
    }
}

impl<R> ErrorType for Slots<R> {
    type Error = NorFlashErrorKind;
}

impl<R: Rom> ReadNorFlash for Slots<R> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, room: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, room.len())?;
        // Of one place, or of one entry of the log.
        self.rom.read(place(offset as usize), room);
        Ok(())
    }

    fn capacity(&self) -> usize {
        PLACES_BYTES + LOG_BYTES
    }
}

impl<R: Rom> NorFlash for Slots<R> {
    const WRITE_SIZE: usize = PAGE;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for offset in (from as usize..to as usize).step_by(SECTOR) {
            self.rom.erase_sector(place(offset));
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (index, bytes) in bytes.chunks_exact(PAGE).enumerate() {
            let mut page = [0xff; PAGE];
            page.copy_from_slice(bytes);
            self.rom.write_page(place(offset as usize + index * PAGE), &page);
        }
        Ok(())
    }
}
