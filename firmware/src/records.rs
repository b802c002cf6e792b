//! The records that the flash keeps of [lock](crate::lock) and [learning](crate::learning): the newest of
//! each kind counts.
//!
//! They are a log in two sectors. A record counts where its checksum, which is written last, is right. Where
//! one sector is full the other is erased, the newest record of the other kind is copied to it, and only then
//! comes the new one: the sector with the highest number has the newest of each kind and is never the one
//! that is erased. Whenever the power goes each kind is as before or as wanted, and no number comes again.
//!
//! ```text
//! record: 0 number   4 what it is   8 body   CRC-32 of all before it, up to whole write units
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
}

/// What supersedes each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Lock,
    Learnt,
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
    /// Something that was to say what was learnt does not count.
    pub torn_learnt: bool,
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
        if newest.is_none_or(|newest| newest.number <= record.number) {
            *newest = Some(record);
        }
    }

    fn records(&self) -> impl Iterator<Item = &Record> {
        [&self.lock, &self.learnt].into_iter().flatten()
    }

    /// By which of two sectors is the one that goes on: a copy has the number of what it is one of.
    fn rank(&self) -> (Option<u32>, usize) {
        (self.records().map(|record| record.number).max(), self.records().count())
    }
}

/// Bytes from one place for a record to the next.
const fn pitch<F: NorFlash>() -> usize {
    CELL.next_multiple_of(unit::<F>())
}

const fn places<F: NorFlash>() -> usize {
    SLOT_BYTES / pitch::<F>()
}

/// What a place says it is, and the record where it counts.
fn found<F: NorFlash>(flash: &mut F, sector: Sector, at: usize) -> Option<(Tag, Option<Record>)> {
    let mut bytes = [ERASED; LONGEST];
    read(flash, sector, at, &mut bytes[..HEAD]).then_some(())?;
    let word = |bytes: &[u8; LONGEST], at: usize| {
        u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    };
    let tag = Tag::ALL.into_iter().find(|tag| tag.word() == word(&bytes, 4))?;
    let checked = tag.length() - CRC;
    let whole = at + tag.length() <= SLOT_BYTES
        && read(flash, sector, at, &mut bytes[..tag.length()])
        && crc32(&bytes[..checked]) == word(&bytes, checked);
    let record = whole.then(|| {
        let mut body = [ERASED; BODY];
        body[..checked - HEAD].copy_from_slice(&bytes[HEAD..checked]);
        Record { number: word(&bytes, 0), tag, body }
    });
    Some((tag, record))
}

#[inline(never)]
fn of_sector<F: NorFlash>(flash: &mut F, sector: Sector) -> Newest {
    let mut newest = Newest::default();
    for place in 0..places::<F>() {
        match found(flash, sector, place * pitch::<F>()) {
            Some((_, Some(record))) => newest.add(record),
            Some((Tag::Learnt, None)) => newest.torn_learnt = true,
            _ => {}
        }
    }
    newest
}

/// Where the log goes on, and the newest records.
fn log<F: NorFlash>(flash: &mut F) -> (Sector, Newest) {
    let [mut newest, other] = LOG.map(|sector| of_sector(flash, sector));
    let sector = LOG[usize::from(other.rank() > newest.rank())];
    other.records().for_each(|record| newest.add(*record));
    newest.torn_learnt |= other.torn_learnt;
    (sector, newest)
}

/// The newest records of this flash.
pub(crate) fn newest<F: NorFlash>(flash: &mut F) -> Newest {
    log(flash).1
}

/// Writes the record that supersedes the last one of its kind; its number.
pub(crate) fn append<F: NorFlash>(flash: &mut F, tag: Tag, said: &[u8]) -> Result<u32, Refusal> {
    let (mut sector, mut newest) = log(flash);
    let number = newest.rank().0.unwrap_or(0).checked_add(1).ok_or(Refusal::FlashWrite)?;
    let used = |place: &usize| !is_erased(flash, sector, place * pitch::<F>(), pitch::<F>());
    let mut at = (0..places::<F>()).rev().find(used).map_or(0, |last| last + 1) * pitch::<F>();
    if at + tag.length().next_multiple_of(pitch::<F>()) > SLOT_BYTES {
        sector = if sector == LOG[0] { LOG[1] } else { LOG[0] };
        erase(flash, sector)?;
        at = 0;
        *newest.of(tag.kind()) = None;
        for copy in newest.records() {
            program(flash, sector, at, &copy.bytes()[..copy.tag.length()])?;
            at += copy.tag.length().next_multiple_of(pitch::<F>());
        }
    }
    let mut body = [ERASED; BODY];
    body[..said.len()].copy_from_slice(said);
    let record = Record { number, tag, body };
    program(flash, sector, at, &record.bytes()[..tag.length()])?;
    Ok(number)
}
