//! What of the boards pico and pico2 can be tried without one: their sources, compiled for this machine, on
//! a simulated boot ROM. The images themselves are executed by `tests/tests/board_images`.

#[path = "../../boards/pico2/src/chip.rs"]
mod chip;
#[path = "../../boards/rp/flash.rs"]
mod flash;
#[path = "../../boards/pico/src/chip.rs"]
mod pico;
#[path = "../../boards/rp/reset.rs"]
mod reset;
#[path = "../../boards/rp/serial_number.rs"]
mod serial_number;
#[path = "../../boards/rp/timing.rs"]
mod timing;

use chip::FLASH_BYTES;

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind, ReadNorFlash};
use flash::{Rom, Slots, BEGIN, PAGE, SECTOR};
use timing::{divider, readings, FIRST_READING_US};
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
    let places = FLASH_BYTES - 64 * 1024;
    assert!(chip.bytes[..places].iter().all(|byte| *byte == 0x5a));
    let mut slots = Slots::new(&mut chip);
    assert_eq!(slots.write(128, &[0; PAGE]), Err(NorFlashErrorKind::NotAligned));
    assert_eq!(slots.erase(0, 2048), Err(NorFlashErrorKind::NotAligned));
    let beyond = slots.capacity() as u32;
    assert_eq!(slots.write(beyond, &[0; PAGE]), Err(NorFlashErrorKind::OutOfBounds));
    assert_eq!(slots.read(beyond, &mut [0]), Err(NorFlashErrorKind::OutOfBounds));
}

#[test]
fn the_sampling_rate_is_exact_or_refused() {
    // A conversion each 3000 cycles of the converter's 48 MHz (RP2350 datasheet, 12.4.3; RP2040's, 4.9.2).
    assert_eq!(divider(48_000_000), Some(2999));
    // The first of them is waited for long enough.
    assert!(readings(FIRST_READING_US) > 10);
    for refused in [0, 48_000_001, 16_000 * 95, 16_000 * 70_000] {
        assert_eq!(divider(refused), None, "{refused}");
    }
}

/// Readings come 62.5 us apart from the first on, 2 us after each begins; the timer shows whole
/// microseconds, and DMA is looked at a little after it.
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
fn the_image_leaves_the_networks_places_and_the_log_out() {
    for (board, flash_bytes, begins) in
        [("pico", pico::FLASH_BYTES, " - 256"), ("pico2", FLASH_BYTES, "")]
    {
        let script = format!("{}/boards/{board}/memory.x", env!("CARGO_MANIFEST_DIR"));
        let script = std::fs::read_to_string(script).expect("the board's");
        let code = format!("LENGTH = {}K - 320K{begins}\n", flash_bytes / 1024);
        assert!(script.contains(&code), "{board}: {code}");
    }
}

/// RP2350 datasheet, 6.4; RP2040's, 2.10.6.
#[test]
fn the_cause_of_a_reset_is_told() {
    for (chip_reset, pico_reset, watchdog, wanted) in [
        (1 << 16, 1 << 8, 0, Cause::Power),
        (1 << 17, 1 << 8 | 1 << 16, 0, Cause::Power),
        (1 << 18, 1 << 16, 0, Cause::Pin),
        (1 << 16, 1 << 8, 1, Cause::Watchdog),
        (1 << 18, 1 << 16, 2, Cause::Software),
        (0, 0, 0, Cause::Unknown),
    ] {
        let pico2 = (chip_reset & chip::HAD_POWER_ON, chip_reset & chip::HAD_RUN_LOW);
        let pico = (pico_reset & pico::HAD_POWER_ON, pico_reset & pico::HAD_RUN_LOW);
        for (power, low) in [pico2, pico] {
            let cause = reset::cause(power != 0, low != 0, watchdog);
            assert_eq!(cause, wanted, "{chip_reset:#x} {pico_reset:#x} {watchdog}");
        }
    }
}

#[test]
fn the_board_s_number_is_told_as_its_maker_writes_it() {
    assert_eq!(&serial_number::digits(0xa1c9_0b7a_6f5e_4d3c), b"A1C90B7A6F5E4D3C");
}
