//! What of the board nucleo-f446re can be tried without one: its sources, compiled for this machine, on simulated
//! registers. The image itself has not been run on hardware by us.

#[path = "../boards/nucleo-f446re/src/flash.rs"]
mod flash;
#[path = "../boards/nucleo-f446re/src/ring.rs"]
mod ring;
#[path = "../boards/nucleo-f446re/src/timing.rs"]
mod timing;

use flash::*;
use ring::{widened, Reader};
use std::cell::Cell;
use timing::{divide, Division, RATE_HZ};
use yawrig_firmware::slots::{Flash, FlashFault, Sector, SLOT_BYTES};

/// The flash interface as RM0390 describes it: locked until both keys came in order, one kind of operation at a time,
/// busy for some looks, words that only lose bits; what breaks its rules sets an error and does nothing.
struct Chip {
    sectors: Vec<[u8; SLOT_BYTES]>,
    control: u32,
    status: Cell<u32>,
    busy: Cell<u32>,
    keys: Vec<u32>,
    write_protected: bool,
    /// Emptied since the last erase.
    cache_empty: bool,
}

const SR_SEQUENCE_ERROR: u32 = 1 << 7;
const SR_PROTECTION_ERROR: u32 = 1 << 4;

impl Chip {
    fn new() -> Self {
        Self {
            sectors: vec![[0x5a; SLOT_BYTES]; 8],
            control: CR_LOCK,
            // Left over from before: it must not be taken for the next operation's.
            status: Cell::new(SR_SEQUENCE_ERROR),
            busy: Cell::new(3),
            keys: Vec::new(),
            write_protected: false,
            cache_empty: true,
        }
    }

    fn fail(&self, error: u32) {
        self.status.set(self.status.get() | error);
    }

    /// Whether the next operation may begin.
    fn ready(&self) -> bool {
        let ready = self.busy.get() == 0
            && self.control & CR_LOCK == 0
            && self.control & CR_PSIZE_WORD == CR_PSIZE_WORD
            && !self.write_protected;
        if !ready {
            self.fail(if self.write_protected { SR_PROTECTION_ERROR } else { SR_SEQUENCE_ERROR });
        }
        ready
    }
}

impl Controller for &mut Chip {
    fn status(&self) -> u32 {
        let busy = self.busy.get();
        self.busy.set(busy.saturating_sub(1));
        self.status.get() | if busy > 0 { SR_BUSY } else { 0 }
    }

    fn clear_status(&mut self, bits: u32) {
        self.status.set(self.status.get() & !bits);
    }

    fn control(&self) -> u32 {
        self.control
    }

    fn set_control(&mut self, value: u32) {
        // Locked, or busy: writes do nothing but harm.
        if self.control & CR_LOCK != 0 || self.busy.get() > 0 {
            return self.fail(SR_SEQUENCE_ERROR);
        }
        self.control = value & !CR_STRT;
        if value & CR_LOCK != 0 {
            self.keys.clear();
        }
        if value & CR_STRT != 0 && value & CR_SER != 0 && self.ready() {
            let sector = (value >> CR_SNB & 0b1111) as usize;
            self.sectors[sector].fill(0xff);
            self.busy.set(5);
            self.cache_empty = false;
        }
    }

    fn unlock(&mut self, key: u32) {
        self.keys.push(key);
        if self.keys == KEYS {
            self.control &= !CR_LOCK;
        }
    }

    fn empty_cache(&mut self) {
        assert_eq!(self.busy.get(), 0);
        self.cache_empty = true;
    }

    fn sector(&self, number: u32) -> &[u8; SLOT_BYTES] {
        assert!(self.cache_empty, "read what the cache held before");
        &self.sectors[number as usize]
    }

    fn write_word(&mut self, number: u32, offset: usize, word: u32) {
        if self.control & CR_PG == 0 {
            return self.fail(SR_SEQUENCE_ERROR);
        }
        if self.ready() {
            for (byte, new) in
                self.sectors[number as usize][offset..offset + 4].iter_mut().zip(word.to_le_bytes())
            {
                *byte &= new;
            }
            self.busy.set(2);
        }
    }
}

#[test]
fn a_slot_is_erased_and_written_and_nothing_beside_it() {
    let mut chip = Chip::new();
    let mut slots = Slots::new(&mut chip);
    for slot in Sector::ALL {
        slots.erase(slot).expect("erased");
        assert!(slots.read(slot).iter().all(|byte| *byte == 0xff));
        slots.program(slot, 8, *b"yawr").expect("written");
        slots.program(slot, SLOT_BYTES - 4, [1, 2, 3, 4]).expect("written");
        assert_eq!(slots.read(slot)[8..12], *b"yawr");
        assert_eq!(slots.read(slot)[SLOT_BYTES - 4..], [1, 2, 3, 4]);
        assert_eq!(slots.read(slot).iter().filter(|byte| **byte != 0xff).count(), 8);
        // Not beyond its end, where the next sector is, and not across words.
        assert_eq!(slots.program(slot, SLOT_BYTES, [0; 4]), Err(FlashFault));
        assert_eq!(slots.program(slot, 10, [0; 4]), Err(FlashFault));
    }
    // The vector table's sector is as it was, as is the code from sector 4 on, and the door is shut.
    assert_eq!(Sector::ALL.map(flash::number), [1, 2, 3, 7]);
    for of_code in [0, 4, 5, 6] {
        assert!(chip.sectors[of_code].iter().all(|byte| *byte == 0x5a));
    }
    assert_eq!(chip.control, CR_LOCK);
}

#[test]
fn a_flash_that_refuses_is_a_fault_and_is_shut_again() {
    let mut chip = Chip::new();
    chip.write_protected = true;
    let mut slots = Slots::new(&mut chip);
    assert_eq!(slots.erase(Sector::First), Err(FlashFault));
    assert_eq!(slots.program(Sector::First, 0, [0; 4]), Err(FlashFault));
    assert_eq!(chip.control, CR_LOCK);
    assert_eq!(chip.sectors[1], [0x5a; SLOT_BYTES]);
    // Once it takes writes again, the old faults are forgotten.
    chip.write_protected = false;
    assert_eq!(Slots::new(&mut chip).erase(Sector::First), Ok(()));
}

#[test]
fn the_sampling_rate_is_exact_or_refused() {
    assert_eq!(divide(84_000_000, RATE_HZ), Some(Division { prescaler: 83, period: 999 }));
    for clock_mhz in 1..=180 {
        let clock_hz = clock_mhz * 1_000_000;
        let Division { prescaler, period } = divide(clock_hz, RATE_HZ).expect("exact");
        assert_eq!((u32::from(prescaler) + 1) * (period + 1) * RATE_HZ, clock_hz);
    }
    for inexact in [0, 999_999, 84_000_001, 32_768] {
        assert_eq!(divide(inexact, RATE_HZ), None);
    }
    assert_eq!(divide(84_000_000, 3), None);
    assert_eq!(divide(84_000_000, 0), None);
}

#[test]
fn every_reading_is_taken_once_or_counted_as_lost() {
    const RING: usize = 64;
    let mut memory = [u32::MAX; RING];
    // The count wraps on the way.
    let begun = u32::MAX - 5000;
    let mut reader = Reader::<RING>::new();
    while reader.overwritten(begun) != 0 {}
    while reader.next(begun).is_some() {}
    let (mut written, mut expected, mut lost_in_all) = (begun, begun, 0);
    let mut state = 1_u32;
    for _ in 0..2000 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Mostly a few, now and then more than the ring holds.
        let count = if state >> 28 == 0 { state >> 8 & 0xff } else { state >> 8 & 7 };
        for _ in 0..count {
            memory[written as usize % RING] = written;
            written = written.wrapping_add(1);
        }
        // The trigger of the next one may have been counted, or one more have come after the count.
        let triggers = match state >> 20 & 3 {
            0 => written.wrapping_add(1),
            1 => written.wrapping_sub(1),
            _ => written,
        };
        let made = Reader::<RING>::made(triggers, written % RING as u32).expect("they agree");
        assert_eq!(made, written);
        let lost = reader.overwritten(made);
        assert!(lost == 0 || count > RING as u32 / 2);
        lost_in_all += lost;
        expected = expected.wrapping_add(lost);
        while let Some(at) = reader.next(made) {
            assert_eq!(memory[at], expected);
            expected = expected.wrapping_add(1);
        }
        assert_eq!(expected, written);
    }
    assert!(lost_in_all > 0 && written < begun, "both happened");
    // A reading that went missing shows, and all that was not taken counts.
    assert_eq!(Reader::<RING>::made(written.wrapping_add(2), written % RING as u32), None);
    assert_eq!(reader.begin_anew(written.wrapping_add(2)), 2);
    assert_eq!(reader.next(0), None);
}

#[test]
fn bytes_are_read_up_to_where_dma_writes() {
    let mut reader = Reader::<16>::new();
    let mut read = |position| {
        let mut found = Vec::new();
        while let Some(at) = reader.next_before(position) {
            found.push(at);
        }
        found
    };
    assert_eq!(read(0), []);
    assert_eq!(read(3), [0, 1, 2]);
    assert_eq!(read(3), []);
    assert_eq!(read(14), (3..14).collect::<Vec<_>>());
    // Around the end; DMA's counter shows 16 as 0.
    assert_eq!(read(2), [14, 15, 0, 1]);
    assert_eq!(read(16), (2..16).collect::<Vec<_>>());
}

/// A ring that DMA has gone round unread is noticed, and nothing of it is taken for new; the end of the ring alone is
/// nothing.
#[test]
fn a_ring_that_is_overtaken_is_noticed() {
    let mut reader = Reader::<16>::new();
    let take = |reader: &mut Reader<16>, position| {
        let mut found = Vec::new();
        while let Some(at) = reader.next_before(position) {
            found.push(at);
        }
        found
    };
    assert!(!reader.overtaken(false, 10));
    assert_eq!(take(&mut reader, 10).len(), 10);
    // Round the end and not past the reader.
    assert!(reader.is_behind(4) && !reader.overtaken(true, 4));
    assert_eq!(take(&mut reader, 4), [10, 11, 12, 13, 14, 15, 0, 1, 2, 3]);
    // The flag of a wrap that came after it was looked at, cleared by the position: no second time.
    assert!(!reader.is_behind(4) && !reader.overtaken(false, 5));
    assert_eq!(take(&mut reader, 5), [4]);
    // Eighteen bytes since: the two that are left are of a frame whose beginning is gone.
    assert!(reader.overtaken(true, 7));
    assert_eq!(take(&mut reader, 7), []);
    assert_eq!(take(&mut reader, 9), [7, 8]);
}

#[test]
fn twelve_bits_reach_both_ends_of_sixteen() {
    assert_eq!((widened(0), widened(0x0fff)), (0, 0xffff));
    for reading in 1..0x0fff {
        let (low, here) = (widened(reading - 1), widened(reading));
        assert!(here - low == 16 || here - low == 17);
        // Within half a step of its place: straight to 0.4 % of a reading's own step.
        let place = f64::from(reading) * 65_535.0 / 4095.0;
        assert!((f64::from(here) - place).abs() <= 1.0);
    }
}
