//! The records that the flash keeps of [lock](crate::lock), [learning](crate::learning) and
//! [linearity](crate::linearity): the newest of each kind counts.
//!
//! They are a log in two sectors. A record counts where its checksum, which is written last, is right. Where
//! one sector is full the other is erased, the newest record of each kind is copied to it, and only then
//! comes the new one: the sector with the highest number has the newest of each kind and is never the one
//! that is erased. Whenever the power goes each kind is as before or as wanted, and no number comes again.
//!
//! A record of the lock is written twice, one behind the other, and one good copy is enough. A write that the
//! power cut leaves nothing behind it, since what comes next keeps a place's distance: two copies side by
//! side of which neither can be read were whole once, and so were lost.
//!
//! A table of linearity is a long one. Where its newest record is damaged there is none, not the one
//! before.
//!
//! ```text
//! record: 0 number   4 what it is   8 body   CRC-32 of all before it, up to whole write units
//! the lock's, both copies: 40 what it is, once more
//! ```

mod kind;
mod table;

use crate::flash::{erase, is_erased, program, read, Sector, ERASED, SLOT_BYTES};
use embedded_storage::nor_flash::NorFlash;
use kind::{pitch, Kind, CELL, CRC, HEAD, LONGEST, MARK};
pub(crate) use kind::{Tag, BODY};
pub(crate) use table::TABLE;
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::Refusal;

const LOG: [Sector; 2] = [Sector::Lock, Sector::OtherLock];

/// A record that counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record {
    pub number: u32,
    pub tag: Tag,
    /// Erased bytes behind what it says.
    pub body: [u8; BODY],
}

impl Record {
    fn bytes(&self) -> [u8; LONGEST] {
        let mut bytes = [ERASED; LONGEST];
        bytes[..4].copy_from_slice(&self.number.to_le_bytes());
        bytes[4..HEAD].copy_from_slice(&self.tag.word().to_le_bytes());
        let checked = self.tag.length() - CRC;
        bytes[HEAD..checked].copy_from_slice(&self.body[..checked - HEAD]);
        if self.tag.kind() == Kind::Lock {
            bytes[MARK..MARK + 4].copy_from_slice(&self.tag.word().to_le_bytes());
        }
        let crc = crc32(&bytes[..checked]);
        bytes[checked..checked + CRC].copy_from_slice(&crc.to_le_bytes());
        bytes
    }
}

/// The newest of each kind, in one sector or in both.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Newest {
    pub lock: Option<Record>,
    pub learnt: Option<Record>,
    /// Both copies of the lock are good.
    pub lock_twice: bool,
    /// A lock was written after this one, and neither of its copies can be read.
    pub lock_lost: bool,
    /// And the flash does not even give its bytes.
    unread: bool,
    /// Something that was to say what was learnt does not count.
    pub torn_learnt: bool,
    /// Where the newest table is that is whole, and whether there was one after it.
    table: Option<table::Place>,
    damaged_table: bool,
    /// The place behind the last record that counts.
    end: usize,
}

impl Newest {
    fn add(&mut self, record: Record) {
        let newest = match record.tag.kind() {
            Kind::Lock => &mut self.lock,
            _ => &mut self.learnt,
        };
        let again = newest.is_some_and(|newest| newest.number == record.number);
        if newest.is_none_or(|newest| newest.number <= record.number) {
            *newest = Some(record);
            if record.tag.kind() == Kind::Lock {
                (self.lock_twice, self.lock_lost, self.unread) = (again, false, false);
            }
        }
    }

    fn records(&self) -> impl Iterator<Item = &Record> {
        [&self.lock, &self.learnt].into_iter().flatten()
    }

    /// Where the newest table is, unless that is damaged: the one before is none.
    fn whole_table(&self) -> Option<table::Place> {
        self.table.filter(|_| !self.damaged_table)
    }

    /// By which of two sectors is the one that goes on: a copy has the number of what it is one of.
    fn rank(&self) -> (Option<u32>, usize) {
        let of_table = self.table.map(|table| table.number);
        let numbers = || self.records().map(|record| record.number).chain(of_table);
        (numbers().max(), numbers().count())
    }

    /// Whether a lock was lost that was as new as what the other sector holds. One that is older was
    /// superseded; where nothing counts, the sector is the older one, half erased, if it can be read at all.
    fn lost_beside(&self, other: &Self) -> bool {
        let (newest, _) = self.rank();
        self.lock_lost && (newest >= other.rank().0 || newest.is_none() && self.unread)
    }
}

const fn places<F: NorFlash>() -> usize {
    SLOT_BYTES / pitch::<F>()
}

/// What stands at a place.
enum Found {
    Nothing,
    Counts(Record),
    /// A table that counts, of this number.
    Table(u32),
    /// A copy of this kind that does not count.
    Lost(Kind),
    /// What the flash does not give: it may have been a lock.
    Unread,
}

fn found<F: NorFlash>(flash: &mut F, sector: Sector, at: usize) -> Found {
    let mut bytes = [ERASED; LONGEST];
    let word = |bytes: &[u8; LONGEST], at: usize| {
        u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    };
    if !read(flash, sector, at, &mut bytes[..HEAD]) {
        return Found::Unread;
    }
    if bytes[..HEAD] == [ERASED; HEAD] {
        return Found::Nothing;
    }
    let near = Tag::near(word(&bytes, 4));
    if near == Some(Tag::Table) {
        return match table::found(flash, sector, at) {
            table::Found::Nothing => Found::Nothing,
            table::Found::Counts(number) => Found::Table(number),
            table::Found::Lost => Found::Lost(Kind::Table),
        };
    }
    let length = near.map_or(CELL, Tag::length);
    let given = at + length <= SLOT_BYTES && read(flash, sector, at, &mut bytes[..length]);
    let Some(tag) = near else {
        return match Tag::near(word(&bytes, MARK)) {
            Some(Tag::Locked | Tag::Open) => Found::Lost(Kind::Lock),
            _ if !given => Found::Unread,
            _ => Found::Nothing,
        };
    };
    let checked = length - CRC;
    let whole = given && tag.word() == word(&bytes, 4);
    if !whole || crc32(&bytes[..checked]) != word(&bytes, checked) {
        return if given || tag == Tag::Learnt { Found::Lost(tag.kind()) } else { Found::Unread };
    }
    let mut body = [ERASED; BODY];
    body[..checked - HEAD].copy_from_slice(&bytes[HEAD..checked]);
    Found::Counts(Record { number: word(&bytes, 0), tag, body })
}

#[inline(never)]
fn of_sector<F: NorFlash>(flash: &mut F, sector: Sector) -> Newest {
    let mut newest = Newest::default();
    // Side by side, up to this place: copies of a lock that are lost, and of these what is not even read.
    let (mut lost, mut unread) = (0, 0);
    let mut inside = 0;
    for place in 0..places::<F>() {
        if place < inside {
            continue;
        }
        let found = found(flash, sector, place * pitch::<F>());
        unread = if matches!(found, Found::Unread) { unread + 1 } else { 0 };
        lost = if matches!(found, Found::Unread | Found::Lost(Kind::Lock)) { lost + 1 } else { 0 };
        newest.lock_lost |= lost >= Kind::Lock.copies();
        newest.unread |= unread >= Kind::Lock.copies();
        match found {
            Found::Counts(record) => {
                newest.add(record);
                newest.end = place + record.tag.length().div_ceil(pitch::<F>());
            }
            Found::Table(number) => {
                let at = place * pitch::<F>();
                newest.table = Some(table::Place { number, sector, at });
                newest.damaged_table = false;
                newest.end = place + table::places::<F>();
                // What it says is none of a record's.
                inside = newest.end;
            }
            Found::Lost(Kind::Learnt) => newest.torn_learnt = true,
            Found::Lost(Kind::Table) => newest.damaged_table = true,
            _ => {}
        }
    }
    newest
}

/// Where the log goes on, and the newest records.
fn log<F: NorFlash>(flash: &mut F) -> (Sector, Newest) {
    let both = LOG.map(|sector| of_sector(flash, sector));
    let index = usize::from(both[1].rank() > both[0].rank());
    let (mut newest, other) = (both[index], both[1 - index]);
    let lost = newest.lost_beside(&other) || other.lost_beside(&newest);
    other.records().for_each(|record| newest.add(*record));
    newest.lock_lost = lost;
    newest.torn_learnt |= other.torn_learnt;
    if newest.table.is_none() {
        newest.table = other.table;
        newest.damaged_table |= other.damaged_table;
    }
    (LOG[index], newest)
}

/// The newest records of this flash.
pub(crate) fn newest<F: NorFlash>(flash: &mut F) -> Newest {
    log(flash).1
}

/// Writes a record from a place on, as often as its kind is; the place behind it.
fn write<F: NorFlash>(
    flash: &mut F,
    sector: Sector,
    mut at: usize,
    record: &Record,
) -> Result<usize, Refusal> {
    let length = record.tag.length();
    for copy in 0..record.tag.kind().copies() {
        let written = program(flash, sector, at, &record.bytes()[..length]);
        // With one it is as wanted; the next start makes good a second that the flash did not take.
        if copy == 0 {
            written?;
        }
        at += length.next_multiple_of(pitch::<F>());
    }
    Ok(at)
}

/// Writes the record that supersedes the last one of its kind; its number. Nothing once a lock is lost, or
/// its remains might be erased.
pub(crate) fn append<F: NorFlash>(flash: &mut F, tag: Tag, said: &[u8]) -> Result<u32, Refusal> {
    let long = tag.kind().copies() * tag.length().next_multiple_of(pitch::<F>());
    let (sector, at, number) = room(flash, long)?;
    let mut body = [ERASED; BODY];
    body[..said.len()].copy_from_slice(said);
    write(flash, sector, at, &Record { number, tag, body })?;
    Ok(number)
}

/// Where the next record goes, of so many bytes, and its number.
#[inline(never)]
fn room<F: NorFlash>(flash: &mut F, long: usize) -> Result<(Sector, usize, u32), Refusal> {
    let (mut sector, newest) = log(flash);
    if newest.lock_lost {
        return Err(Refusal::FlashWrite);
    }
    let number = newest.rank().0.unwrap_or(0).checked_add(1).ok_or(Refusal::FlashWrite)?;
    let used = |place: &usize| !is_erased(flash, sector, place * pitch::<F>(), pitch::<F>());
    let last = (0..places::<F>()).rev().find(used).map_or(0, |last| last + 1);
    // Away from what does not count, which the power has cut.
    let mut at = (last + usize::from(last > newest.end)) * pitch::<F>();
    if at + long > SLOT_BYTES {
        sector = if sector == LOG[0] { LOG[1] } else { LOG[0] };
        erase(flash, sector)?;
        at = 0;
        for copy in newest.records() {
            at = write(flash, sector, at, copy)?;
        }
        if let Some(place) = newest.whole_table() {
            at = table::copy(flash, place, sector, at)?;
        }
    }
    Ok((sector, at, number))
}

/// Writes a table that supersedes the last one.
pub(crate) fn append_table<F: NorFlash>(flash: &mut F, said: &[u8; TABLE]) -> Result<(), Refusal> {
    let (sector, at, number) = room(flash, table::places::<F>() * pitch::<F>())?;
    table::write(flash, sector, at, number, said).map(drop)
}

/// What the newest table says; false where there is none.
///
/// # Errors
/// Where there was one that is damaged.
pub(crate) fn read_table<F: NorFlash>(
    flash: &mut F,
    said: &mut [u8; TABLE],
) -> Result<bool, Refusal> {
    let newest = newest(flash);
    match newest.whole_table() {
        Some(place) => table::read_at(flash, place, said).map(|()| true),
        None if newest.damaged_table => Err(Refusal::Linearity),
        None => Ok(false),
    }
}
