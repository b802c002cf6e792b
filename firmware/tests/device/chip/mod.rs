//! A flash chip in memory, of any write and erase size, and all that a power cut in one of its operations can
//! leave.
//!
//! It keeps to the rules of flash with an error-correcting code: units are written as a whole, aligned, and
//! once between two erases. A unit in whose writing the power went may be unreadable afterwards.

use embedded_storage::nor_flash::{
    check_erase, check_read, check_write, ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash,
};
use yawrig_firmware::slots::SLOT_BYTES;

/// How far a torn erase may have come: nothing, all, or something between.
pub const ERASE_TEARS: u32 = 9;

/// The same of a write of one unit; a byte is torn in fewer ways.
pub const fn write_tears(write: usize) -> &'static [u32] {
    if write == 1 {
        &[0, 1, 8]
    } else {
        &[0, 1, 2, 3, 4, 5, 6, 7, 8]
    }
}

/// Scatters 64 bits (splitmix64, Vigna 2015).
fn scatter(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Bits of a byte of a unit that a write that was cut has reached.
fn written_bits(index: usize, length: usize, tear: u32, seed: u64) -> u8 {
    let reached = match tear {
        0 => false,
        1 => true,
        2 => index < length / 2,
        3 => index >= length / 2,
        4 => index == 0,
        5 => index + 1 == length,
        _ => {
            return scatter(seed.wrapping_add((u64::from(tear) << 40) + index as u64)) as u8;
        }
    };
    if reached {
        0xff
    } else {
        0
    }
}

/// Bits of a byte of a sector that an erase that was cut has reached.
fn erased_bits(index: usize, length: usize, tear: u32, seed: u64) -> u8 {
    let reached = match tear {
        0 => false,
        1 => true,
        2 => index < length / 2,
        3 => index >= length / 2,
        // All but the first words: the commit word stands longest.
        4 => index >= 8,
        // The first word alone: it goes first.
        5 => index < 4,
        6 => index < 1200,
        _ => return scatter(seed.wrapping_add((u64::from(tear) << 40) + index as u64)) as u8,
    };
    if reached {
        0xff
    } else {
        0
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Unit {
    Erased,
    Written,
    Unreadable,
}

/// The chip, with a sum over what it holds that tells one state from another.
#[derive(Clone)]
pub struct Chip<const WRITE: usize, const ERASE: usize> {
    bytes: Vec<u8>,
    units: Vec<Unit>,
    pub sum: u64,
}

impl<const WRITE: usize, const ERASE: usize> Chip<WRITE, ERASE> {
    /// Bytes from one of the four places to the next.
    pub const PLACE: usize = SLOT_BYTES.next_multiple_of(ERASE);

    pub fn erased() -> Self {
        Self::with_sectors_behind(0)
    }

    /// One that has more behind the four places.
    pub fn with_sectors_behind(sectors: usize) -> Self {
        let length = 4 * Self::PLACE + sectors * ERASE;
        Self { bytes: vec![0xff; length], units: vec![Unit::Erased; length / WRITE], sum: 0 }
    }

    /// What a unit adds to the sum.
    fn term(&self, unit: usize) -> u64 {
        if self.units[unit] == Unit::Erased {
            return 0;
        }
        let start = scatter((unit as u64) << 8 | self.units[unit] as u64);
        let bytes = &self.bytes[unit * WRITE..(unit + 1) * WRITE];
        bytes.iter().fold(start, |sum, &byte| scatter(sum.wrapping_add(0x9e37 + u64::from(byte))))
    }

    fn set(&mut self, unit: usize, bytes: &[u8], state: Unit) {
        self.sum ^= self.term(unit);
        self.bytes[unit * WRITE..(unit + 1) * WRITE].copy_from_slice(bytes);
        self.units[unit] = state;
        self.sum ^= self.term(unit);
    }

    /// A unit that is damaged afterwards: what it held with other bits in it.
    pub fn damage(&mut self, offset: usize) {
        let unit = offset / WRITE;
        let bytes: Vec<u8> = self.bytes[unit * WRITE..][..WRITE].iter().map(|byte| !byte).collect();
        self.set(unit, &bytes, Unit::Written);
    }

    /// One bit that has become the other one.
    pub fn flip(&mut self, offset: usize, bit: u8) {
        let unit = offset / WRITE;
        let mut bytes = self.bytes[unit * WRITE..][..WRITE].to_vec();
        bytes[offset % WRITE] ^= 1 << bit;
        self.set(unit, &bytes, Unit::Written);
    }

    /// A unit that cannot be read any more.
    pub fn fail_reads(&mut self, offset: usize) {
        let unit = offset / WRITE;
        let bytes = self.bytes[unit * WRITE..][..WRITE].to_vec();
        self.set(unit, &bytes, Unit::Unreadable);
    }

    /// Writes units, `torn` before each with what a cut in it leaves, and once more back again.
    fn write_torn(
        &mut self,
        offset: u32,
        bytes: &[u8],
        torn: &mut dyn FnMut(&Self, usize),
    ) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (index, new) in bytes.chunks(WRITE).enumerate() {
            let unit = offset as usize / WRITE + index;
            if self.units[unit] != Unit::Erased {
                return Err(NorFlashErrorKind::Other);
            }
            for &tear in write_tears(WRITE) {
                let seed = self.sum.wrapping_add(unit as u64);
                let reached = |index| written_bits(index, WRITE, tear, seed);
                let left: Vec<u8> =
                    new.iter().enumerate().map(|(i, byte)| byte | !reached(i)).collect();
                let state = match tear {
                    // With an error-correcting code.
                    7 if WRITE >= 8 => Unit::Unreadable,
                    // What looks erased is taken for that, and rightly: nothing else could be.
                    _ if left.iter().all(|&byte| byte == 0xff) => Unit::Erased,
                    _ => Unit::Written,
                };
                self.set(unit, &left, state);
                torn(self, unit * WRITE);
                self.set(unit, &[0xff; WRITE], Unit::Erased);
            }
            self.set(unit, new, Unit::Written);
        }
        Ok(())
    }

    /// Erases sectors, `torn` before each with what a cut in it leaves.
    fn erase_torn(
        &mut self,
        from: u32,
        to: u32,
        torn: &mut dyn FnMut(&Self),
    ) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for sector in (from as usize..to as usize).step_by(ERASE) {
            let units = sector / WRITE..(sector + ERASE) / WRITE;
            let used: Vec<usize> = units.filter(|&unit| self.units[unit] != Unit::Erased).collect();
            for tear in 0..ERASE_TEARS {
                let mut left = self.clone();
                for &unit in &used {
                    let bytes: Vec<u8> = (unit * WRITE..(unit + 1) * WRITE)
                        .map(|at| {
                            let seed = self.sum;
                            self.bytes[at] | erased_bits(at - sector, ERASE, tear, seed)
                        })
                        .collect();
                    let whole = bytes.iter().all(|&byte| byte == 0xff);
                    let state = if whole { Unit::Erased } else { self.units[unit] };
                    left.set(unit, &bytes, state);
                }
                torn(&left);
            }
            for &unit in &used {
                self.set(unit, &[0xff; WRITE], Unit::Erased);
            }
        }
        Ok(())
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for Chip<WRITE, ERASE> {
    type Error = NorFlashErrorKind;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for Chip<WRITE, ERASE> {
    const READ_SIZE: usize = if WRITE < 8 { 1 } else { 4 };

    fn read(&mut self, offset: u32, room: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, room.len())?;
        let at = offset as usize..offset as usize + room.len();
        let units = &self.units[at.start / WRITE..at.end.div_ceil(WRITE)];
        if units.contains(&Unit::Unreadable) {
            return Err(NorFlashErrorKind::Other);
        }
        room.copy_from_slice(&self.bytes[at]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for Chip<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for unit in from as usize / WRITE..to as usize / WRITE {
            if self.units[unit] != Unit::Erased {
                self.set(unit, &[0xff; WRITE], Unit::Erased);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (index, new) in bytes.chunks(WRITE).enumerate() {
            let unit = offset as usize / WRITE + index;
            if self.units[unit] != Unit::Erased {
                return Err(NorFlashErrorKind::Other);
            }
            self.set(unit, new, Unit::Written);
        }
        Ok(())
    }
}

/// A chip that shows `seen`, at each operation, all that a power cut in it could leave. `seen` is also told
/// whether the commit word was being written.
pub struct Watched<'a, const WRITE: usize, const ERASE: usize> {
    pub chip: Chip<WRITE, ERASE>,
    pub seen: &'a mut dyn FnMut(&Chip<WRITE, ERASE>, bool),
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for Watched<'_, WRITE, ERASE> {
    type Error = NorFlashErrorKind;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for Watched<'_, WRITE, ERASE> {
    const READ_SIZE: usize = Chip::<WRITE, ERASE>::READ_SIZE;

    fn read(&mut self, offset: u32, room: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.chip.read(offset, room)
    }

    fn capacity(&self) -> usize {
        self.chip.capacity()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for Watched<'_, WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.chip.erase_torn(from, to, &mut |torn| (self.seen)(torn, false))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        // The first write unit of a slot, where the commit word stands.
        let unit = WRITE.max(4);
        let committing = |at: usize| at % Chip::<WRITE, ERASE>::PLACE < unit;
        self.chip.write_torn(offset, bytes, &mut |torn, at| (self.seen)(torn, committing(at)))
    }
}
