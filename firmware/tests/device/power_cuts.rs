//! Power cuts at every flash operation of an update, and inside it; then again at every operation of the
//! update that mends it; on flash as the boards have it and, with `tests/run --long`, of other write sizes
//! and sectors. `cargo test --release -p yawrig-firmware --test device power_cuts:: -- --nocapture` prints
//! how many.
//!
//! After each cut the device starts from what its flash holds. It must run the network that ran before or,
//! once the commit word was being written, the new one, bit for bit; and it must take the next update. The
//! flash takes no unit twice ([`chip`]).

use crate::chip::{write_tears, Chip, Watched, ERASE_TEARS};
use ed25519_compact::{KeyPair, Seed};
use embedded_storage::nor_flash::NorFlash;
use std::collections::HashSet;
use yawrig_firmware::lock::{self, Challenge};
use yawrig_firmware::slots::{Slot, Store, SLOT_BYTES};
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::network::Network;
use yawrig_shared::wire::{unlock_message, Signature, CHUNK};

/// What runs: its slot, generation, and checksum of the payload. None: the network compiled in.
type Runs = Option<(Slot, u32, u32)>;

fn starts<const WRITE: usize, const ERASE: usize>(chip: &Chip<WRITE, ERASE>) -> Runs {
    let mut store = Store::new(chip.clone());
    store
        .newest(&mut Network::empty())
        .map(|(slot, envelope, _)| (slot, envelope.generation, envelope.payload_crc))
}

/// The built-in network as the given generation.
fn network(generation: u32) -> Vec<u8> {
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, generation).expect("a blob");
    bytes
}

/// A whole update from what runs to the next generation, as a device makes it; what runs then.
fn update<F: NorFlash>(flash: F, runs: Runs) -> (F, Runs) {
    let newest = runs.map_or(0, |(_, generation, _)| generation);
    let bytes = network(newest + 1);
    let mut store = Store::new(flash);
    store.begin(bytes.len() as u32, runs.map(|(slot, ..)| slot)).expect("an erased slot");
    for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
        store.chunk((CHUNK * index) as u32, chunk).expect("in order");
    }
    let (slot, envelope, _) =
        store.verify(newest, &mut Network::empty(), None, None).expect("a sound network");
    store.commit().expect("verified");
    (store.into_flash(), Some((slot, envelope.generation, envelope.payload_crc)))
}

/// Counts of what was tried.
#[derive(Default)]
struct Tried {
    first: u64,
    second: u64,
    /// State of the flash, generation that ran, whether the next may: no other fact decides what happens.
    distinct: HashSet<(u64, Option<u32>, bool)>,
}

impl Tried {
    /// Starts from `chip`: `old` must run, or `new` where it may; what does.
    fn start<const WRITE: usize, const ERASE: usize>(
        &mut self,
        chip: &Chip<WRITE, ERASE>,
        old: Runs,
        new: Option<Runs>,
    ) -> Runs {
        let runs = starts(chip);
        assert!(
            runs == old || Some(runs) == new,
            "{runs:?} runs after a cut where {old:?} should{}",
            if new.is_some() { " or its successor" } else { "" }
        );
        runs
    }

    /// Cuts at every operation of an update of `chip`, which is to run `old`.
    fn cut_everywhere<const WRITE: usize, const ERASE: usize>(
        &mut self,
        chip: &Chip<WRITE, ERASE>,
        old: Runs,
        again: bool,
    ) {
        let (_, next) = update(chip.clone(), old);
        let mut seen = |torn: &Chip<WRITE, ERASE>, committing: bool| {
            let new = committing.then_some(next);
            if again {
                self.first += 1;
            } else {
                self.second += 1;
            }
            let generation = old.map(|(_, generation, _)| generation);
            if !self.distinct.insert((torn.sum, generation, committing)) && !again {
                return;
            }
            let runs = self.start(torn, old, new);
            if again {
                self.cut_everywhere(torn, runs, false);
            } else {
                // It takes the next update, whole.
                let (mended, newest) = update(torn.clone(), runs);
                assert_eq!(starts(&mended), newest);
            }
        };
        let watched = Watched { chip: chip.clone(), seen: &mut seen };
        let (watched, runs) = update(watched, old);
        assert_eq!(runs, next);
        assert_eq!(starts(&watched.chip), next);
    }
}

/// Ways to cut the power while so many bytes are written unit by unit, the last one made up.
fn cuts(write: usize, bytes: usize) -> u64 {
    let units = bytes.next_multiple_of(write.max(4)) / write;
    (units * write_tears(write).len()) as u64
}

/// The same while a place is erased.
fn cuts_in_erase(erase: usize) -> u64 {
    SLOT_BYTES.div_ceil(erase) as u64 * u64::from(ERASE_TEARS)
}

fn no_cut_costs_anything<const WRITE: usize, const ERASE: usize>() {
    let mut tried = Tried::default();
    // A new device; one with a network; one with two, as after every later update.
    let mut chip = Chip::<WRITE, ERASE>::erased();
    let mut runs = None;
    for _ in 0..3 {
        tried.cut_everywhere(&chip, runs, true);
        (chip, runs) = update(chip, runs);
    }
    println!(
        "write size {WRITE}, erase size {ERASE}: {} cuts in an update, {} in the update after such a cut; {} different \
         states of the flash, none lost",
        tried.first,
        tried.second,
        tried.distinct.len()
    );
    // Blob, length, commit word.
    let chunks: u64 = BUILT_IN.chunks(CHUNK).map(|chunk| cuts(WRITE, chunk.len())).sum();
    let all = chunks + 2 * cuts(WRITE, 4) + cuts_in_erase(ERASE);
    assert_eq!(tried.first, 3 * all);
    assert_eq!(tried.second, tried.first * all);
}

fn pair() -> KeyPair {
    KeyPair::from_seed(Seed::new([3; 32]))
}

/// The answer to this lock's challenge.
fn answer(number: u32) -> Signature {
    let signature = pair().sk.sign(unlock_message(number, 5), None);
    Signature::from_slice(&*signature).expect("64 bytes")
}

fn key(chip: &mut impl NorFlash) -> Option<[u8; 32]> {
    lock::read(chip).map(|lock| lock.key)
}

fn lock_it<F: NorFlash>(flash: &mut F) -> u32 {
    lock::lock(flash, &pair().pk).expect("it can be locked");
    lock::read(flash).expect("locked").number
}

fn renew_it<F: NorFlash>(flash: &mut F) -> u32 {
    lock::renew(flash).expect("it is locked")
}

fn open_it<F: NorFlash>(flash: &mut F) -> u32 {
    let number = lock::read(flash).expect("locked").number;
    let challenge = Challenge { number, nonce: 5 };
    lock::unlock(flash, challenge, &answer(number)).expect("it can be opened");
    number + 1
}

/// Cuts at every operation of locking, challenging or opening `chip`, which becomes what that makes of it:
/// the lock is as before or as wanted, no number comes again, the network stays, and lock and update work on.
/// Returns how many.
fn cut_the_lock<const WRITE: usize, const ERASE: usize>(
    chip: &mut Chip<WRITE, ERASE>,
    number: u32,
    act: impl Fn(&mut Watched<WRITE, ERASE>) -> u32,
) -> u64 {
    let (before, runs) = (key(chip), starts(chip));
    let mut torn = Vec::new();
    let mut seen = |chip: &Chip<WRITE, ERASE>, _| torn.push(chip.clone());
    let mut watched = Watched { chip: chip.clone(), seen: &mut seen };
    assert_eq!(act(&mut watched), number + 1);
    *chip = watched.chip;
    let after = key(chip);
    let count = torn.len() as u64;
    for mut torn in torn {
        let held = key(&mut torn);
        assert!(
            held == before || held == after,
            "{held:?}, where {before:?} or {after:?} should be"
        );
        assert_eq!(starts(&torn), runs);
        if held.is_none() {
            let (mended, newest) = update(torn.clone(), runs);
            assert_eq!(starts(&mended), newest);
            assert!(lock_it(&mut torn) > number, "a number comes again");
        } else {
            assert!(renew_it(&mut torn) > number, "a number comes again");
        }
        open_it(&mut torn);
        assert_eq!(key(&mut torn), None);
    }
    count
}

fn no_cut_leaves_a_lock_that_was_not_wanted<const WRITE: usize, const ERASE: usize>() {
    let record = 48_usize.next_multiple_of(WRITE);
    // Each twice; all sectors but the first begin with the one before.
    let records = (SLOT_BYTES / record / 2) as u32;
    let (mut chip, _) = update(Chip::<WRITE, ERASE>::erased(), None);
    let (mut tried, mut number) = (0, 0);
    // New, used, and full, where the other sector is begun: erased as it comes, then with old records in it.
    for round in 0..4 {
        let acts: [fn(&mut Watched<WRITE, ERASE>) -> u32; 3] =
            [|c| lock_it(c), |c| renew_it(c), |c| open_it(c)];
        for act in acts {
            tried += cut_the_lock(&mut chip, number, act);
            number += 1;
        }
        if round > 0 {
            lock_it(&mut chip);
            let up_to = round * (records - 1) - 1;
            while renew_it(&mut chip) < up_to {}
            number = open_it(&mut chip);
            assert_eq!(number, up_to + 1);
        }
    }
    println!(
        "write size {WRITE}, erase size {ERASE}: {tried} cuts in locking, challenging and opening, each as before or as \
         wanted"
    );
    // Two of the rounds begin another sector.
    let twice = 2 * cuts(WRITE, record);
    assert_eq!(tried, 4 * 3 * twice + 2 * (cuts_in_erase(ERASE) + twice));
}

/// The two on flash of one kind: its write size, its erase size.
macro_rules! flash {
    ($($name:ident: $write:literal, $erase:expr;)*) => {
        mod no_power_cut_costs_the_network_or_the_next_update {
            $(#[test] fn $name() { super::no_cut_costs_anything::<$write, { $erase }>() })*
        }
        mod no_power_cut_leaves_a_lock_that_was_not_wanted {
            $(#[test] fn $name() {
                super::no_cut_leaves_a_lock_that_was_not_wanted::<$write, { $erase }>()
            })*
        }
    };
}

flash! {
    words_and_16_kib_as_the_nucleo_has: 4, 16 * 1024;
    pages_and_4_kib_as_the_pico_has: 256, 4 * 1024;
    bytes_and_4_kib_at_full_size: 1, 4 * 1024;
    bytes_and_16_kib_at_full_size: 1, 16 * 1024;
    words_and_4_kib_at_full_size: 4, 4 * 1024;
    words_and_128_kib_at_full_size: 4, 128 * 1024;
    double_words_and_4_kib_at_full_size: 8, 4 * 1024;
    double_words_and_16_kib_at_full_size: 8, 16 * 1024;
    quad_words_and_4_kib_at_full_size: 16, 4 * 1024;
    quad_words_and_16_kib_at_full_size: 16, 16 * 1024;
}

/// Else the tests above would pass over a device that writes a unit twice, or half of one.
#[test]
fn the_chip_refuses_what_flash_with_an_error_correcting_code_does() {
    let mut chip = Chip::<8, 4096>::erased();
    chip.write(0, &[0xff; 16]).expect("erased");
    assert!(chip.write(8, &[0; 8]).is_err(), "written, though it looks erased");
    assert!(chip.write(20, &[0; 8]).is_err() && chip.write(16, &[0; 4]).is_err(), "not aligned");
    assert!(chip.erase(0, 2048).is_err(), "half a sector");
    chip.erase(0, 4096).expect("a sector");
    chip.write(8, &[0; 8]).expect("erased");
}
