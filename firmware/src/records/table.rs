//! A record that is longer than others: a table of [linearity](crate::linearity).
//!
//! Its bytes leave free where in a [record](super) a tag or the lock's mark would stand: half written, it is
//! taken for no other record, whatever it says. Without its checksum, which comes last, it never was one.

use super::kind::{pitch, Tag, CRC, HEAD, MARK};
use crate::flash::{program, read, Sector, ERASED, SLOT_BYTES};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::Refusal;

/// Bytes that it says.
pub(crate) const TABLE: usize = 528;
/// Most that it takes in the flash: three of the largest write units.
const LONGEST: usize = 768;

/// A record in the flash.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub number: u32,
    pub sector: Sector,
    pub at: usize,
}

/// What stands at a place that is said to be a table's.
pub(super) enum Found {
    /// It never was whole.
    Nothing,
    /// One of this number.
    Counts(u32),
    Lost,
}

/// Where its bytes stand behind the head, the checksum's last.
fn bytes<F: NorFlash>() -> impl Iterator<Item = usize> {
    let is_free = |at: usize| {
        matches!(at % pitch::<F>(), 4..HEAD) || (MARK..MARK + 4).contains(&(at % pitch::<F>()))
    };
    (HEAD..LONGEST).filter(move |at| !is_free(*at)).take(TABLE + CRC)
}

/// Places for a record that it takes.
pub(super) fn places<F: NorFlash>() -> usize {
    bytes::<F>().last().map_or(0, |last| last + 1).div_ceil(pitch::<F>())
}

/// Its head, what it says and its checksum, one behind the other.
fn gathered<F: NorFlash>(flash: &mut F, sector: Sector, at: usize) -> Option<[u8; LONGEST]> {
    let length = places::<F>() * pitch::<F>();
    let mut room = [ERASED; LONGEST];
    let given = at + length <= SLOT_BYTES && read(flash, sector, at, room.get_mut(..length)?);
    // No byte comes before its place.
    for (to, from) in (HEAD..).zip(bytes::<F>()) {
        room[to] = room[from];
    }
    given.then_some(room)
}

/// Whether its checksum was not even begun: the power was cut before.
fn never_was<F: NorFlash>(flash: &mut F, sector: Sector, at: usize) -> bool {
    bytes::<F>().skip(TABLE).all(|behind| {
        let mut byte = [0];
        read(flash, sector, at + behind, &mut byte) && byte == [ERASED]
    })
}

/// Looks whether it is one.
#[inline(never)]
pub(super) fn found<F: NorFlash>(flash: &mut F, sector: Sector, at: usize) -> Found {
    if never_was(flash, sector, at) {
        return Found::Nothing;
    }
    let Some(room) = gathered(flash, sector, at) else { return Found::Lost };
    let end = HEAD + TABLE;
    let word = |at: usize| u32::from_le_bytes([room[at], room[at + 1], room[at + 2], room[at + 3]]);
    if word(4) != Tag::Table.word() || word(end) != crc32(&room[..end]) {
        return Found::Lost;
    }
    Found::Counts(word(0))
}

/// Writes one; the place behind it.
#[inline(never)]
pub(super) fn write<F: NorFlash>(
    flash: &mut F,
    sector: Sector,
    at: usize,
    number: u32,
    said: &[u8; TABLE],
) -> Result<usize, Refusal> {
    let mut room = [ERASED; LONGEST];
    room[..4].copy_from_slice(&number.to_le_bytes());
    room[4..HEAD].copy_from_slice(&Tag::Table.word().to_le_bytes());
    room[HEAD..HEAD + TABLE].copy_from_slice(said);
    let crc = crc32(&room[..HEAD + TABLE]).to_le_bytes();
    room[HEAD..].fill(ERASED);
    for (to, byte) in bytes::<F>().zip(said.iter().chain(&crc)) {
        room[to] = *byte;
    }
    let length = places::<F>() * pitch::<F>();
    program(flash, sector, at, room.get(..length).ok_or(Refusal::FlashWrite)?)?;
    Ok(at + length)
}

/// What it says.
pub(super) fn read_at<F: NorFlash>(
    flash: &mut F,
    place: Place,
    said: &mut [u8; TABLE],
) -> Result<(), Refusal> {
    let room = gathered(flash, place.sector, place.at).ok_or(Refusal::FlashWrite)?;
    said.copy_from_slice(&room[HEAD..HEAD + TABLE]);
    Ok(())
}

/// The place behind a copy in another sector.
pub(super) fn copy<F: NorFlash>(
    flash: &mut F,
    place: Place,
    sector: Sector,
    at: usize,
) -> Result<usize, Refusal> {
    let mut said = [0; TABLE];
    read_at(flash, place, &mut said)?;
    write(flash, sector, at, place.number, &said)
}
