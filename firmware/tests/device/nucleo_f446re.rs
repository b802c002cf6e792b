//! What of the board nucleo-f446re can be tried without one: its sources, compiled for this machine, on
//! simulated registers. The image itself has not been run on hardware by us.

#[path = "../../boards/nucleo-f446re/src/flash.rs"]
mod flash;
#[path = "../../boards/nucleo-f446re/src/reset.rs"]
mod reset;

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind, ReadNorFlash};
use flash::*;
use std::cell::Cell;
use yawrig_firmware::slots::SLOT_BYTES;

/// The flash interface as RM0390 describes it: locked until both keys came in order, one kind of operation at
/// a time, busy for some looks, words that only lose bits; what breaks its rules sets an error and does
/// nothing.
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

    fn erase(&mut self, what: u32) {
        self.set_control(what);
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
    // The vector table's sector is as it was, as is the code from sector 5 on, and the door is shut.
    assert_eq!(flash::NUMBERS, [1, 4, 2, 3]);
    for of_code in [0, 5, 6, 7] {
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
fn what_made_the_processor_start_is_read_from_its_register() {
    use reset::cause;
    use yawrig_shared::wire::Cause;
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
