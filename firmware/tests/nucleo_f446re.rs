//! What of the board nucleo-f446re can be tried without one: its sources, compiled for this machine, on simulated
//! registers. The image itself has not been run on hardware by us.

#[path = "../boards/nucleo-f446re/src/flash.rs"]
mod flash;
#[path = "../boards/nucleo-f446re/src/reset.rs"]
mod reset;
#[path = "../boards/nucleo-f446re/src/timing.rs"]
mod timing;

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind, ReadNorFlash};
use flash::*;
use std::cell::Cell;
use timing::{period, CONVERSIONS_HZ, RATE_HZ};
use yawrig_firmware::ring::{widened, Reader, CONVERSIONS};
use yawrig_firmware::slots::SLOT_BYTES;

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
    const BYTES: u32 = SLOT_BYTES as u32;
    let mut chip = Chip::new();
    let mut slots = Slots::new(&mut chip);
    assert_eq!(slots.capacity(), 4 * SLOT_BYTES);
    for start in [0, 1, 2, 3].map(|sector| sector * BYTES) {
        let mut all = [0; SLOT_BYTES];
        slots.erase(start, start + BYTES).expect("erased");
        slots.read(start, &mut all).expect("read");
        assert!(all.iter().all(|byte| *byte == 0xff));
        slots.write(start + 8, b"yawrig, ").expect("written");
        slots.write(start + BYTES - 4, &[1, 2, 3, 4]).expect("written");
        slots.read(start, &mut all).expect("read");
        assert_eq!(all[8..16], *b"yawrig, ");
        assert_eq!(all[SLOT_BYTES - 4..], [1, 2, 3, 4]);
        assert_eq!(all.iter().filter(|byte| **byte != 0xff).count(), 12);
        // Not across words, nor half a sector.
        assert_eq!(slots.write(start + 10, &[0; 4]), Err(NorFlashErrorKind::NotAligned));
        assert_eq!(slots.write(start + 16, &[0; 3]), Err(NorFlashErrorKind::NotAligned));
        assert_eq!(slots.erase(start, start + 4096), Err(NorFlashErrorKind::NotAligned));
    }
    // Nor beyond its end.
    let beyond = 4 * BYTES;
    assert_eq!(slots.write(beyond, &[0; 4]), Err(NorFlashErrorKind::OutOfBounds));
    assert_eq!(slots.erase(beyond, beyond + BYTES), Err(NorFlashErrorKind::OutOfBounds));
    assert_eq!(slots.read(beyond, &mut [0]), Err(NorFlashErrorKind::OutOfBounds));
    // The vector table's sector is as it was, as is the code from sector 4 on, and the door is shut.
    assert_eq!(flash::NUMBERS, [1, 2, 3, 7]);
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
    assert_eq!(slots.erase(0, SLOT_BYTES as u32), Err(NorFlashErrorKind::Other));
    assert_eq!(slots.write(0, &[0; 4]), Err(NorFlashErrorKind::Other));
    assert_eq!(chip.control, CR_LOCK);
    assert_eq!(chip.sectors[1], [0x5a; SLOT_BYTES]);
    // Once it takes writes again, the old faults are forgotten.
    chip.write_protected = false;
    assert_eq!(Slots::new(&mut chip).erase(0, SLOT_BYTES as u32), Ok(()));
}

#[test]
fn the_sampling_rate_is_exact_or_refused() {
    assert_eq!((RATE_HZ, CONVERSIONS_HZ), (1000, 16_000));
    assert_eq!(period(84_000_000, CONVERSIONS_HZ), Some(5249));
    for clock_mhz in (2..=180).step_by(2) {
        let clock_hz = clock_mhz * 1_000_000;
        let period = period(clock_hz, CONVERSIONS_HZ).expect("exact");
        assert_eq!((period + 1) * CONVERSIONS_HZ, clock_hz);
    }
    for inexact in [0, 999_999, 84_000_001, 32_768] {
        assert_eq!(period(inexact, CONVERSIONS_HZ), None);
    }
    assert_eq!(period(84_000_000, 0), None);
}

#[test]
fn every_reading_is_taken_once_or_counted_as_lost() {
    const RING: usize = 64;
    let mut memory = [u32::MAX; RING];
    // The count wraps on the way.
    let begun = u32::MAX - 5000;
    let mut reader = Reader::<RING>::new();
    while reader.overwritten(begun, 1) != 0 {}
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
        let lost = reader.overwritten(made, 1);
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
        while reader.has_before(position) {
            found.push(reader.next_before(position).expect("there is one"));
        }
        assert_eq!(reader.next_before(position), None);
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

/// What is overwritten is left out by whole samples: those after it are of sixteen conversions of their own.
#[test]
fn samples_stay_whole_where_conversions_were_overwritten() {
    let mut reader = Reader::<64>::new();
    assert_eq!((reader.overwritten(16, 16), reader.waiting(16)), (0, 16));
    while reader.next(16).is_some() {}
    for (made, lost) in [(72, 0), (73, 16), (90, 32), (106, 48)] {
        let mut reader = reader;
        assert_eq!(reader.overwritten(made, 16), lost, "{made}");
        let first = reader.next(made).expect("one is left");
        assert_eq!(first, (16 + lost as usize) % 64, "{made}");
    }
}

#[test]
fn sixteen_readings_of_twelve_bits_reach_both_ends_of_sixteen() {
    assert_eq!((widened(0), widened(CONVERSIONS * 0x0fff)), (0, 0xffff));
    for sum in 1..=CONVERSIONS * 0x0fff {
        let step = widened(sum) - widened(sum - 1);
        assert!(step == 1 || step == 2);
        // Straight to one count.
        let place = f64::from(sum) * 65_535.0 / f64::from(CONVERSIONS * 4095);
        assert!((f64::from(widened(sum)) - place).abs() <= 1.0);
    }
}

/// The error of a sample against that of one conversion, 340 deg over 12 bits, the model moving slowly: a quarter where
/// the potentiometer's noise is half a step or more, and next to nothing gained where there is none to blur the steps.
#[test]
fn sixteen_conversions_lower_the_noise_floor_to_a_quarter() {
    const STEP_DEG: f64 = 340.0 / 4096.0;
    let mut state = 1_u64;
    let mut even = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    println!("noise deg   one conversion deg rms   sixteen deg rms   ratio");
    for (noise_steps, most) in [(0.0, 1.01), (0.25, 0.45), (0.5, 0.28), (1.0, 0.26), (2.0, 0.26)] {
        let (mut single, mut summed) = (0.0, 0.0);
        let count = 20_000;
        for k in 0..count {
            // Over some hundred steps, each place between two of them as often as any other.
            let at = 1000.0 + 100.0 * f64::from(k) / f64::from(count);
            let mut read = || {
                let noise: f64 = (0..12).map(|_| even()).sum::<f64>() - 6.0;
                (at + noise_steps * noise).round().clamp(0.0, 4095.0) as u32
            };
            let readings: [u32; CONVERSIONS as usize] = std::array::from_fn(|_| read());
            let sample = f64::from(widened(readings.iter().sum())) * 4095.0 / 65_535.0;
            single += (f64::from(readings[0]) - at).powi(2);
            summed += (sample - at).powi(2);
        }
        let [single, summed] =
            [single, summed].map(|sum| STEP_DEG * (sum / f64::from(count)).sqrt());
        let ratio = summed / single;
        println!("{:9.4}   {single:22.4}   {summed:15.4}   {ratio:5.3}", noise_steps * STEP_DEG);
        assert!(ratio < most, "{noise_steps}: {ratio}");
    }
}

#[test]
fn what_ended_the_run_before_is_read_back_and_nothing_else_is() {
    use reset::cause;
    use yawrig_firmware::crash::{Note, BYTES};
    use yawrig_shared::wire::{Cause, CRASH_FILE};
    let note = Note::new("firmware/src/device.rs", 123);
    let crash = note.read().expect("a crash");
    assert_eq!((crash.file.as_str(), crash.line), ("firmware/src/device.rs", 123));
    // Of a long path the end; a letter that was cut in two is left out.
    let long = format!("{}é{}", "x".repeat(10), "y".repeat(CRASH_FILE - 1));
    assert_eq!(
        Note::new(&long, 1).read().expect("a crash").file.as_str(),
        "y".repeat(CRASH_FILE - 1)
    );
    assert_eq!(Note::new("", 0x0801_2345).read().expect("a fault").line, 0x0801_2345);
    assert_eq!(Note::NONE.read(), None);
    // What RAM holds when power comes, and a note of which a bit is another.
    for fill in [0x00_u8, 0xff, 0x5a] {
        assert_eq!(Note([fill; BYTES]).read(), None);
    }
    for bit in 0..8 * BYTES {
        let mut other = note;
        other.0[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(other.read(), None, "bit {bit}");
    }
    for (csr, wanted) in [
        (0x0e00_0000, Cause::Power),
        (0x0600_0000, Cause::Power),
        (0x2400_0000, Cause::Watchdog),
        (0x1400_0000, Cause::Software),
        (0x0400_0000, Cause::Pin),
        (0, Cause::Unknown),
    ] {
        assert_eq!(cause(csr), wanted, "{csr:#010x}");
    }
}
