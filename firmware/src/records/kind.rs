//! What records are, and how they are told from one another.

use crate::flash::unit;
use embedded_storage::nor_flash::NorFlash;

/// Head and checksum.
pub(super) const HEAD: usize = 8;
pub(super) const CRC: usize = 4;
/// Bytes in which a record is at least; a long one takes several of these.
pub(super) const CELL: usize = 48;
pub(super) const LONGEST: usize = 2 * CELL;
/// Most that a record says.
pub(crate) const BODY: usize = LONGEST - HEAD - CRC;
/// Where a record of the lock says once more what it is.
pub(super) const MARK: usize = 40;
/// So many wrong bits leave a tag what it was: fewer than half of the eleven or more between two tags.
const WRONG_BITS: u32 = 5;

/// What a record is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tag {
    Locked,
    Open,
    Learnt,
    Table,
}

impl Tag {
    const ALL: [Self; 4] = [Self::Locked, Self::Open, Self::Learnt, Self::Table];

    pub(super) const fn word(self) -> u32 {
        u32::from_le_bytes(match self {
            Self::Locked => *b"LOCK",
            Self::Open => *b"OPEN",
            Self::Learnt => *b"LRNT",
            Self::Table => *b"cURV",
        })
    }

    pub(super) const fn length(self) -> usize {
        match self {
            Self::Locked | Self::Open => CELL,
            // Of a table, which is longer, it is what is read first.
            Self::Learnt | Self::Table => LONGEST,
        }
    }

    pub(super) const fn kind(self) -> Kind {
        match self {
            Self::Locked | Self::Open => Kind::Lock,
            Self::Learnt => Kind::Learnt,
            Self::Table => Kind::Table,
        }
    }

    /// What a word was before a few of its bits were lost.
    pub(super) fn near(word: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|tag| (tag.word() ^ word).count_ones() <= WRONG_BITS)
    }
}

/// What supersedes each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Lock,
    Learnt,
    Table,
}

impl Kind {
    pub(super) const fn copies(self) -> usize {
        match self {
            Self::Lock => 2,
            Self::Learnt | Self::Table => 1,
        }
    }
}

/// Bytes from one place for a record to the next.
pub(super) const fn pitch<F: NorFlash>() -> usize {
    CELL.next_multiple_of(unit::<F>())
}
