//! What of the board pico2 can be tried without one: its sources, compiled for this machine, on a simulated
//! boot ROM. The image itself is executed by `tests/tests/board_images`.

#[path = "../../boards/pico2/src/flash.rs"]
mod flash;
#[path = "../../boards/pico2/src/reset.rs"]
mod reset;
#[path = "../../boards/pico2/src/serial_number.rs"]
mod serial_number;
#[path = "../../boards/pico2/src/timing.rs"]
mod timing;

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind, ReadNorFlash};
use flash::{Rom, Slots, BEGIN, FLASH_BYTES, PAGE, SECTOR};
use timing::{divider, readings, ENDLESS, FIRST_READING_US};
use yawrig_firmware::conversions::CONVERSIONS_HZ;
use yawrig_firmware::ring::Reader;
use yawrig_firmware::slots::{Slot, Store};
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::network::Network;
use yawrig_shared::wire::{Cause, CHUNK};

/// The flash as the boot ROM changes it, full of code.
struct Chip {
    bytes: Vec<u8>,
    /// Of the same page between two erases none is written twice.
    written: Vec<bool>,
}

impl Chip {
    fn new() -> Self {
        Self { bytes: vec![0x5a; FLASH_BYTES], written: vec![true; FLASH_BYTES / PAGE] }
    }
}

impl Rom for &mut Chip {
    fn erase_sector(&mut self, offset: usize) {
        assert!(offset.is_multiple_of(SECTOR) && offset >= BEGIN, "code, or half a sector");
        self.bytes[offset..offset + SECTOR].fill(0xff);
        self.written[offset / PAGE..(offset + SECTOR) / PAGE].fill(false);
    }

    fn write_page(&mut self, offset: usize, page: &[u8; PAGE]) {
        assert!(offset.is_multiple_of(PAGE) && offset >= BEGIN, "code, or not a page");
        assert!(!std::mem::replace(&mut self.written[offset / PAGE], true), "written twice");
        self.bytes[offset..offset + PAGE].copy_from_slice(page);
    }

    fn read(&self, offset: usize, room: &mut [u8]) {
        room.copy_from_slice(&self.bytes[offset..offset + room.len()]);
    }
}

#[test]
fn networks_are_kept_in_the_last_64_kib_and_nothing_else_is_touched() {
    let mut chip = Chip::new();
    let mut runs = None;
    for generation in 1..=3 {
        let mut store = Store::new(Slots::new(&mut chip));
        let mut bytes = BUILT_IN.to_vec();
        blob::set_generation(&mut bytes, generation).expect("a blob");
        store.begin(bytes.len() as u32, runs).expect("an erased slot");
        for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
            store.chunk((CHUNK * index) as u32, chunk).expect("in order");
        }
        let mut network = Network::empty();
        store.verify(generation - 1, &mut network, None, None).expect("a sound network");
        store.commit().expect("verified");
        // As after a reset.
        let mut store = Store::new(Slots::new(&mut chip));
        let (slot, envelope, _) = store.newest(&mut network).expect("a network");
        assert_eq!(envelope.generation, generation);
        assert_eq!(runs.map_or(Slot::First, Slot::other), slot);
        runs = Some(slot);
    }
    assert!(chip.bytes[..BEGIN].iter().all(|byte| *byte == 0x5a));
    let mut slots = Slots::new(&mut chip);
    assert_eq!(slots.write(128, &[0; PAGE]), Err(NorFlashErrorKind::NotAligned));
    assert_eq!(slots.erase(0, 2048), Err(NorFlashErrorKind::NotAligned));
    let beyond = slots.capacity() as u32;
    assert_eq!(slots.write(beyond, &[0; PAGE]), Err(NorFlashErrorKind::OutOfBounds));
    assert_eq!(slots.read(beyond, &mut [0]), Err(NorFlashErrorKind::OutOfBounds));
}

#[test]
fn the_sampling_rate_is_exact_or_refused() {
    // A conversion each 3000 cycles of the converter's 48 MHz (RP2350 datasheet, 12.4.3).
    assert_eq!(divider(48_000_000), Some(2999));
    for refused in [0, 48_000_001, 16_000 * 95, 16_000 * 70_000] {
        assert_eq!(divider(refused), None, "{refused}");
    }
}

/// As the datasheet has it (12.6.2.2.1): mode 0xf goes on for ever, any mode with a count of zero stops at
/// once.
#[test]
fn transfers_never_end_and_the_first_is_waited_for_long_enough() {
    assert_eq!(ENDLESS >> 28, 0xf);
    assert_ne!(ENDLESS & 0x0fff_ffff, 0);
    assert!(readings(FIRST_READING_US) > 10);
}

/// Readings come 62.5 us apart from the first on, 2 us after each begins; the timer shows whole microseconds,
/// and DMA is looked at a little after it.
#[test]
fn time_tells_how_many_readings_there_are() {
    const RING: usize = 16_384;
    for late_us in [0.0, 0.9] {
        for quarter_us in 0..4 * 200_000_u64 {
            let since_us = quarter_us as f64 / 4.0;
            let made = 1 + ((since_us + late_us) / 62.5) as u32;
            let triggers = readings(since_us as u64);
            assert_eq!(
                Reader::<RING>::made(triggers, made % RING as u32),
                Some(made),
                "{since_us}"
            );
        }
    }
    // An hour of them.
    assert_eq!(readings(3_600_000_000), 3_600 * CONVERSIONS_HZ + 1);
    // Two that are missing show.
    assert_eq!(Reader::<RING>::made(readings(1_000_000), CONVERSIONS_HZ - 1), None);
}

#[test]
fn the_cause_of_a_reset_is_told() {
    for (chip, watchdog, wanted) in [
        (1 << 16, 0, Cause::Power),
        (1 << 17, 0, Cause::Power),
        (1 << 18, 0, Cause::Pin),
        (1 << 16, 1, Cause::Watchdog),
        (1 << 18, 2, Cause::Software),
        (0, 0, Cause::Unknown),
    ] {
        assert_eq!(reset::cause(chip, watchdog), wanted, "{chip:#x} {watchdog}");
    }
}

#[test]
fn the_chip_s_number_is_told_as_its_maker_writes_it() {
    assert_eq!(&serial_number::digits([0x4d3c, 0x6f5e, 0x0b7a, 0xa1c9]), b"A1C90B7A6F5E4D3C");
}
