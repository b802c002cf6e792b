//! Flash as networks, lock and what was learnt are kept in: four places of one size in any `NorFlash` of
//! [`embedded_storage`]. What it has behind them is the [log](crate::journal)'s.
//!
//! Place n begins at n times [`SLOT_BYTES`], or n times the erase size where that is larger. What is written
//! is made up to whole write units, at least four bytes, each of which is written once between two erases:
//! flash with an error-correcting code takes no unit twice.

use embedded_storage::nor_flash::{
    check_erase, check_write, ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash,
};
use yawrig_shared::wire::{Refusal, CHUNK};

/// Bytes of a slot.
pub const SLOT_BYTES: usize = 16 * 1024;
/// What an erased byte is.
pub const ERASED: u8 = 0xFF;
/// Largest write unit: a page of the flash beside a microcontroller that has none of its own.
const LARGEST_UNIT: usize = 256;

/// A place: a slot, or one of the two for the records of lock and learning ([`crate::records`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sector {
    First,
    Second,
    Lock,
    OtherLock,
}

impl Sector {
    pub const ALL: [Self; 4] = [Self::First, Self::Second, Self::Lock, Self::OtherLock];

    /// Where it begins.
    pub const fn start<F: NorFlash>(self) -> usize {
        self as usize * bytes::<F>()
    }
}

/// Bytes from one place to the next; a flash holds four, and what else it has is its log's.
pub const fn bytes<F: NorFlash>() -> usize {
    SLOT_BYTES.next_multiple_of(F::ERASE_SIZE)
}

/// Bytes that are written as one.
pub const fn unit<F: NorFlash>() -> usize {
    let unit = if F::WRITE_SIZE < 4 { 4 } else { F::WRITE_SIZE };
    assert!(unit.is_multiple_of(F::WRITE_SIZE), "a write size that is a power of two");
    assert!(unit <= LARGEST_UNIT && CHUNK.is_multiple_of(unit), "a write size up to 256");
    assert!(F::READ_SIZE <= 4, "a read size of 1, 2 or 4");
    unit
}

/// Reads at multiples of four bytes; whether that went well.
#[inline(never)]
fn read_words<F: NorFlash>(flash: &mut F, sector: Sector, offset: usize, room: &mut [u8]) -> bool {
    offset + room.len() <= SLOT_BYTES
        && flash.read((sector.start::<F>() + offset) as u32, room).is_ok()
}

/// Reads anywhere in a place; whether that went well.
pub(crate) fn read<F: NorFlash>(
    flash: &mut F,
    sector: Sector,
    offset: usize,
    room: &mut [u8],
) -> bool {
    if F::READ_SIZE == 1 {
        return read_words(flash, sector, offset, room);
    }
    room.iter_mut().enumerate().all(|(index, byte)| {
        let at = offset + index;
        let mut word = [0; 4];
        let good = read_words(flash, sector, at & !3, &mut word);
        *byte = word[at & 3];
        good
    })
}

/// Whether these bytes, whole words, are erased, as far as they can be read.
pub(crate) fn is_erased<F: NorFlash>(
    flash: &mut F,
    sector: Sector,
    offset: usize,
    length: usize,
) -> bool {
    let mut room = [0; 16];
    (0..length).step_by(room.len()).all(|from| {
        let room = &mut room[..(length - from).min(16)];
        read_words(flash, sector, offset + from, room) && room.iter().all(|&byte| byte == ERASED)
    })
}

/// Writes whole units from a multiple of the unit on, the last one made up, and reads them back.
pub(crate) fn program<F: NorFlash>(
    flash: &mut F,
    sector: Sector,
    offset: usize,
    bytes: &[u8],
) -> Result<(), Refusal> {
    let mut room = [ERASED; LARGEST_UNIT];
    let mut back = [ERASED; LARGEST_UNIT];
    let (room, back) = (&mut room[..unit::<F>()], &mut back[..unit::<F>()]);
    for (index, piece) in bytes.chunks(unit::<F>()).enumerate() {
        room.fill(ERASED);
        room[..piece.len()].copy_from_slice(piece);
        let at = offset + index * unit::<F>();
        let written = at + room.len() <= SLOT_BYTES
            && flash.write((sector.start::<F>() + at) as u32, room).is_ok()
            && read_words(flash, sector, at, back)
            && room == back;
        if !written {
            return Err(Refusal::FlashWrite);
        }
    }
    Ok(())
}

/// Erases a place and looks whether it is.
pub(crate) fn erase<F: NorFlash>(flash: &mut F, sector: Sector) -> Result<(), Refusal> {
    let start = sector.start::<F>();
    let erased = flash.erase(start as u32, (start + bytes::<F>()) as u32).is_ok();
    if erased && is_erased(flash, sector, 0, SLOT_BYTES) {
        Ok(())
    } else {
        Err(Refusal::FlashWrite)
    }
}

/// NOR flash in memory, for the emulated devices and the tests: words that are written once, sectors of 16
/// KiB. Those behind the first four are a [log](crate::journal)'s.
#[derive(Clone, Debug)]
pub struct MemoryFlash<const SECTORS: usize = 4> {
    bytes: [[u8; SLOT_BYTES]; SECTORS],
}

impl<const SECTORS: usize> Default for MemoryFlash<SECTORS> {
    fn default() -> Self {
        Self::erased()
    }
}

impl MemoryFlash {
    /// One without a log.
    pub const fn new() -> Self {
        Self::erased()
    }
}

impl MemoryFlash<8> {
    /// One with a log, of at least 192 entries.
    pub const fn with_log() -> Self {
        Self::erased()
    }
}

impl<const SECTORS: usize> MemoryFlash<SECTORS> {
    const fn erased() -> Self {
        Self { bytes: [[ERASED; SLOT_BYTES]; SECTORS] }
    }

    /// All that it holds.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.as_flattened()
    }
}

impl<const SECTORS: usize> ErrorType for MemoryFlash<SECTORS> {
    type Error = NorFlashErrorKind;
}

impl<const SECTORS: usize> ReadNorFlash for MemoryFlash<SECTORS> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, room: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let found = self.bytes().get(offset as usize..).and_then(|rest| rest.get(..room.len()));
        room.copy_from_slice(found.ok_or(NorFlashErrorKind::OutOfBounds)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SECTORS * SLOT_BYTES
    }
}

impl<const SECTORS: usize> NorFlash for MemoryFlash<SECTORS> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SLOT_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.bytes.as_flattened_mut()[from as usize..to as usize].fill(ERASED);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        let place = self.bytes.as_flattened_mut();
        let place = &mut place[offset as usize..offset as usize + bytes.len()];
        if place.iter().any(|&byte| byte != ERASED) {
            return Err(NorFlashErrorKind::Other);
        }
        place.copy_from_slice(bytes);
        Ok(())
    }
}
