//! The device's log: its results and its faults in a ring of the flash, for a host that comes weeks later.
//!
//! The ring is what a flash holds behind its four [places](crate::slots), from two erase sectors on; a flash
//! that ends there has none. Entries are of one size and stand one behind the other. Where the ring goes on
//! in another sector that is erased, with the oldest entries. An entry counts where its checksum, which is
//! written last, is right. One that the power has cut is passed over: whenever it goes, all entries before
//! are there.
//!
//! An entry is written at once, whatever goes on. A board where erasing one sector would cost samples should
//! give its device a flash without a ring.
//!
//! Each sector is erased once in a round: every sixteen entries on flash with sectors of 4 KiB one is, so a
//! ring of 64 of them stands 100 000 rounds of 1024 entries. Starts alone, one like the other, are one entry:
//! a device that restarts without end writes nothing.
//!
//! ```text
//! entry of 256 bytes: 0 number   4 key of its form   8 postcard   252 CRC-32 of all before it
//! ```

use crate::flash::{bytes, Sector, ERASED};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{Condition, LogEntry, Logged, Message, LOG_ENTRY};

/// Bytes of an entry; the largest write unit that there is, too.
const ENTRY: usize = 256;
const HEAD: usize = 8;
const CRC: usize = 4;
const _: () = assert!(HEAD + LOG_ENTRY + CRC == ENTRY);

/// Where a flash has its ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Ring {
    begin: usize,
    entries: usize,
    /// Entries that are erased at once.
    at_once: usize,
}

impl Ring {
    fn new<F: NorFlash>(flash: &F) -> Option<Self> {
        let begin = Sector::ALL.len() * bytes::<F>();
        let sector = F::ERASE_SIZE.next_multiple_of(ENTRY);
        let sectors = flash.capacity().saturating_sub(begin) / sector;
        let at_once = sector / ENTRY;
        (sectors >= 2).then_some(Self { begin, entries: sectors * at_once, at_once })
    }

    fn offset(&self, entry: usize) -> usize {
        self.begin + entry % self.entries * ENTRY
    }

    fn read<F: NorFlash>(&self, flash: &mut F, entry: usize, room: &mut [u8]) -> bool {
        flash.read(self.offset(entry) as u32, room).is_ok()
    }

    /// Number and form of what stands there; none where nothing does, or it cannot be read.
    fn head<F: NorFlash>(&self, flash: &mut F, entry: usize) -> Option<(u32, u32)> {
        let mut head = [ERASED; HEAD];
        let read = self.read(flash, entry, &mut head) && head != [ERASED; HEAD];
        read.then(|| (word(&head, 0), word(&head, 4)))
    }

    /// What stands there, if it counts and is of this form.
    #[inline(never)]
    fn entry<F: NorFlash>(&self, flash: &mut F, entry: usize) -> Option<LogEntry> {
        let mut room = [ERASED; ENTRY];
        self.whole(flash, entry, &mut room)?;
        if word(&room, 4) != LogEntry::KEY {
            return None;
        }
        postcard::from_bytes(&room[HEAD..ENTRY - CRC]).ok()
    }

    /// Its bytes, if it counts.
    fn whole<F: NorFlash>(
        &self,
        flash: &mut F,
        entry: usize,
        room: &mut [u8; ENTRY],
    ) -> Option<()> {
        let good =
            self.read(flash, entry, room) && word(room, ENTRY - CRC) == crc32(&room[..ENTRY - CRC]);
        good.then_some(())
    }

    fn is_erased<F: NorFlash>(&self, flash: &mut F, entry: usize) -> bool {
        let mut room = [ERASED; ENTRY];
        self.read(flash, entry, &mut room) && room == [ERASED; ENTRY]
    }

    /// Makes room there and behind it, where an erase sector begins. Also where it looks erased: the power may
    /// have cut that.
    fn clear<F: NorFlash>(&self, flash: &mut F, entry: usize) {
        if entry.is_multiple_of(self.at_once) {
            let from = self.offset(entry);
            // Looked at where something is to be written.
            let _ = flash.erase(from as u32, (from + self.at_once * ENTRY) as u32);
        }
    }
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Where the log goes on.
#[derive(Debug)]
pub struct Journal {
    ring: Option<Ring>,
    /// Where the next entry goes, and its number.
    at: usize,
    number: u32,
    /// This run's first entry, once it is written.
    run: Option<u32>,
    /// As the last entry of this run has it that says so.
    condition: Option<Condition>,
    /// Number of the next event to be looked at.
    pub next_event: u16,
}

/// What an entry says of when and where.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    pub at_sample: u32,
    pub lost_samples: u32,
    pub network: u32,
}

impl Default for Journal {
    fn default() -> Self {
        Self::new()
    }
}

impl Journal {
    #[inline(always)]
    pub const fn new() -> Self {
        Self { ring: None, at: 0, number: 1, run: None, condition: None, next_event: 0 }
    }

    /// Looks where the log of this flash ends.
    #[inline(never)]
    pub fn open<F: NorFlash>(&mut self, flash: &mut F) {
        *self = Self { ring: Ring::new(flash), ..Self::new() };
        let Some(ring) = self.ring else { return };
        let mut room = [ERASED; ENTRY];
        for entry in 0..ring.entries {
            let Some((number, _)) = ring.head(flash, entry) else { continue };
            if number >= self.number && ring.whole(flash, entry, &mut room).is_some() {
                (self.at, self.number) = (entry + 1, number.saturating_add(1));
            }
        }
    }

    /// Whether there is one.
    pub fn is_there(&self) -> bool {
        self.ring.is_some()
    }

    /// Whether something may be missing in it, up to this event.
    pub fn is_behind(&self, next_event: u16) -> bool {
        self.is_there() && (self.run.is_none() || self.next_event != next_event)
    }

    /// Whether this run has no entry yet.
    pub fn has_begun(&self) -> bool {
        self.run.is_some()
    }

    /// The run begins, unless the last entry says the same: then it is one with that.
    pub fn begin<F: NorFlash>(
        &mut self,
        flash: &mut F,
        start: &yawrig_shared::wire::Start,
        when: Moment,
    ) {
        let Some(ring) = self.ring else { return };
        let last = ring.entry(flash, self.at + ring.entries - 1).filter(|last| {
            last.number.saturating_add(1) == self.number && last.network == when.network
        });
        if let Some(LogEntry { number, what: Logged::Start(before), .. }) = &last
            && before == start
        {
            self.run = Some(*number);
            return;
        }
        self.run = Some(self.number);
        self.write(flash, Logged::Start(start.clone()), when);
    }

    /// A result, with what it was made under where that is new.
    pub fn add<F: NorFlash>(
        &mut self,
        flash: &mut F,
        condition: Option<Condition>,
        what: Logged,
        when: Moment,
    ) {
        if let Some(condition) = condition.filter(|_| self.condition != condition) {
            self.condition = Some(condition);
            self.write(flash, Logged::Condition(condition), when);
        }
        self.write(flash, what, when);
    }

    #[inline(never)]
    fn write<F: NorFlash>(&mut self, flash: &mut F, what: Logged, when: Moment) {
        let Some(ring) = self.ring else { return };
        let Moment { at_sample, lost_samples, network } = when;
        let run = self.run.unwrap_or(self.number);
        let entry = LogEntry { number: self.number, run, at_sample, lost_samples, network, what };
        let mut room = [ERASED; ENTRY];
        room[..4].copy_from_slice(&self.number.to_le_bytes());
        room[4..HEAD].copy_from_slice(&LogEntry::KEY.to_le_bytes());
        // The wire's tests hold the longest against it.
        if postcard::to_slice(&entry, &mut room[HEAD..ENTRY - CRC]).is_err() {
            return;
        }
        let crc = crc32(&room[..ENTRY - CRC]);
        room[ENTRY - CRC..].copy_from_slice(&crc.to_le_bytes());
        // Past what a cut has left, and past what the flash does not take: once around at most.
        for at in self.at..self.at + ring.entries {
            let at = at % ring.entries;
            ring.clear(flash, at);
            if !ring.is_erased(flash, at) {
                continue;
            }
            let mut back = [ERASED; ENTRY];
            let written = flash.write(ring.offset(at) as u32, &room).is_ok();
            if written && ring.read(flash, at, &mut back) && back == room {
                (self.at, self.number) = (at + 1, self.number.saturating_add(1));
                return;
            }
        }
    }

    /// The first entry of this number or a higher one.
    pub fn entry_from<F: NorFlash>(&self, flash: &mut F, from: u32) -> Option<LogEntry> {
        let ring = self.ring?;
        // What a cut has left may have the number of what was written after it.
        let mut tried = (from, None);
        loop {
            let heads = (0..ring.entries).filter_map(|entry| {
                let (number, key) = ring.head(flash, entry)?;
                let counts = number < self.number && key == LogEntry::KEY;
                counts.then_some((number, Some(entry))).filter(|one| *one > tried)
            });
            tried = heads.min()?;
            if let Some(entry) = tried.1.and_then(|entry| ring.entry(flash, entry)) {
                return Some(entry);
            }
        }
    }
}
