//! Flash as networks and lock are kept in: four sectors of one size.

use yawrig_shared::wire::Refusal;

/// Bytes of a slot: a sector or more that is erased as one.
pub const SLOT_BYTES: usize = 16 * 1024;
/// What an erased byte is.
pub const ERASED: u8 = 0xFF;

/// What is erased as one: a slot, or one of the lock's two places ([`crate::lock`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sector {
    First,
    Second,
    Lock,
    OtherLock,
}

impl Sector {
    pub const ALL: [Self; 4] = [Self::First, Self::Second, Self::Lock, Self::OtherLock];
}

/// The flash was not erased or programmed as asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashFault;

/// NOR flash of four sectors: erasing sets all bits, programming can only clear them.
pub trait Flash {
    /// Whether this device can be [locked](crate::lock). Checking signatures takes 14 kB of code.
    const LOCKABLE: bool = true;
    /// All bytes of a sector.
    fn read(&self, sector: Sector) -> &[u8; SLOT_BYTES];
    /// Sets every byte of the sector to 0xFF.
    fn erase(&mut self, sector: Sector) -> Result<(), FlashFault>;
    /// Programs the word at a multiple of four.
    fn program(&mut self, sector: Sector, offset: usize, word: [u8; 4]) -> Result<(), FlashFault>;
}

/// NOR flash in memory, for the emulated devices and the tests.
#[derive(Clone, Debug)]
pub struct MemoryFlash {
    sectors: [[u8; SLOT_BYTES]; 4],
}

impl Default for MemoryFlash {
    fn default() -> Self {
        Self::new()
    }
}

impl MemoryFlash {
    pub const fn new() -> Self {
        Self { sectors: [[ERASED; SLOT_BYTES]; 4] }
    }
}

impl Flash for MemoryFlash {
    fn read(&self, sector: Sector) -> &[u8; SLOT_BYTES] {
        &self.sectors[sector as usize]
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFault> {
        self.sectors[sector as usize].fill(ERASED);
        Ok(())
    }

    fn program(&mut self, sector: Sector, offset: usize, word: [u8; 4]) -> Result<(), FlashFault> {
        let place = self.sectors[sector as usize].get_mut(offset..offset + 4).ok_or(FlashFault)?;
        for (byte, new) in place.iter_mut().zip(word) {
            *byte &= new;
        }
        Ok(())
    }
}

impl<F: Flash> Flash for &mut F {
    const LOCKABLE: bool = F::LOCKABLE;

    fn read(&self, sector: Sector) -> &[u8; SLOT_BYTES] {
        (**self).read(sector)
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFault> {
        (**self).erase(sector)
    }

    fn program(&mut self, sector: Sector, offset: usize, word: [u8; 4]) -> Result<(), FlashFault> {
        (**self).program(sector, offset, word)
    }
}

/// Programs a word and reads it back.
pub(crate) fn program(
    flash: &mut impl Flash,
    sector: Sector,
    offset: usize,
    word: [u8; 4],
) -> Result<(), Refusal> {
    flash.program(sector, offset, word).map_err(|_| Refusal::FlashWrite)?;
    if flash.read(sector)[offset..offset + 4] != word {
        return Err(Refusal::FlashWrite);
    }
    Ok(())
}

/// Erases a sector and looks whether it is.
pub(crate) fn erase(flash: &mut impl Flash, sector: Sector) -> Result<(), Refusal> {
    flash.erase(sector).map_err(|_| Refusal::FlashWrite)?;
    if flash.read(sector).iter().any(|&byte| byte != ERASED) {
        return Err(Refusal::FlashWrite);
    }
    Ok(())
}
