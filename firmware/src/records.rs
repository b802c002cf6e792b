//! The records that the flash keeps of [lock](crate::lock) and [learning](crate::learning): the newest of
//! each kind counts.
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
//! ```text
//! record: 0 number   4 what it is   8 body   CRC-32 of all before it, up to whole write units
//! the lock's, both copies: 40 what it is, once more
//! ```

use crate::flash::{erase, is_erased, program, read, unit, Sector, ERASED, SLOT_BYTES};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::Refusal;

const LOG: [Sector; 2] = [Sector::Lock, Sector::OtherLock];
/// Head and checksum.
const HEAD: usize = 8;
const CRC: usize = 4;
/// Bytes in which a record is at least; a long one takes several of these.
const CELL: usize = 48;
const LONGEST: usize = 2 * CELL;
/// Most that a record says.
pub(crate) const BODY: usize = LONGEST - HEAD - CRC;
/// Where a record of the lock says once more what it is.
const MARK: usize = 40;
/// So many wrong bits leave a tag what it was: fewer than half of the eleven or more between two tags.
const WRONG_BITS: u32 = 5;

/// What a record is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tag {
    Locked,
    Open,
    Learnt,
}

impl Tag {
    const ALL: [Self; 3] = [Self::Locked, Self::Open, Self::Learnt];

    const fn word(self) -> u32 {
        u32::from_le_bytes(match self {
            Self::Locked => *b"LOCK",
            Self::Open => *b"OPEN",
            Self::Learnt => *b"LRNT",
        })
    }

    const fn length(self) -> usize {
        match self {
            Self::Locked | Self::Open => CELL,
            Self::Learnt => LONGEST,
        }
    }

    const fn kind(self) -> Kind {
        match self {
            Self::Locked | Self::Open => Kind::Lock,
            Self::Learnt => Kind::Learnt,
        }
    }

    /// What a word was before a few of its bits were lost.
    fn near(word: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|tag| (tag.word() ^ word).count_ones() <= WRONG_BITS)
    }
}

/// What supersedes each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Lock,
    Learnt,
}

impl Kind {
    const fn copies(self) -> usize {
        match self {
            Self::Lock => 2,
            Self::Learnt => 1,
        }
    }
}

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
    /// The place behind the last record that counts.
    end: usize,
}

impl Newest {
    fn of(&mut self, kind: Kind) -> &mut Option<Record> {
        match kind {
            Kind::Lock => &mut self.lock,
            Kind::Learnt => &mut self.learnt,
        }
    }

    fn add(&mut self, record: Record) {
        let newest = self.of(record.tag.kind());
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

    /// By which of two sectors is the one that goes on: a copy has the number of what it is one of.
    fn rank(&self) -> (Option<u32>, usize) {
        (self.records().map(|record| record.number).max(), self.records().count())
    }

    /// Whether a lock was lost that was as new as what the other sector holds. One that is older was
    /// superseded; where nothing counts, the sector is the older one, half erased, if it can be read at all.
    fn lost_beside(&self, other: &Self) -> bool {
        let (newest, _) = self.rank();
        self.lock_lost && (newest >= other.rank().0 || newest.is_none() && self.unread)
    }
}

/// Bytes from one place for a record to the next.
const fn pitch<F: NorFlash>() -> usize {
    CELL.next_multiple_of(unit::<F>())
}

const fn places<F: NorFlash>() -> usize {
    SLOT_BYTES / pitch::<F>()
}

/// What stands at a place.
enum Found {
    Nothing,
    Counts(Record),
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
    for place in 0..places::<F>() {
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
            Found::Lost(Kind::Learnt) => newest.torn_learnt = true,
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
    let (mut sector, newest) = log(flash);
    if newest.lock_lost {
        return Err(Refusal::FlashWrite);
    }
    let number = newest.rank().0.unwrap_or(0).checked_add(1).ok_or(Refusal::FlashWrite)?;
    let used = |place: &usize| !is_erased(flash, sector, place * pitch::<F>(), pitch::<F>());
    let last = (0..places::<F>()).rev().find(used).map_or(0, |last| last + 1);
    // Away from what does not count, which the power has cut.
    let mut at = (last + usize::from(last > newest.end)) * pitch::<F>();
    let long = tag.kind().copies() * tag.length().next_multiple_of(pitch::<F>());
    if at + long > SLOT_BYTES {
        sector = if sector == LOG[0] { LOG[1] } else { LOG[0] };
        erase(flash, sector)?;
        at = 0;
        for copy in newest.records() {
            at = write(flash, sector, at, copy)?;
        }
    }
    let mut body = [ERASED; BODY];
    body[..said.len()].copy_from_slice(said);
    write(flash, sector, at, &Record { number, tag, body })?;
    Ok(number)
}
