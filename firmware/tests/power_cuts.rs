//! Power cuts at every flash operation of an update, and inside it; then again at every operation of the update that
//! mends it. `cargo test --release -p yawrig-firmware --test power_cuts -- --nocapture` prints how many.
//!
//! After each cut the device starts from what its flash holds. It must run the network that ran before or, once the
//! commit word was being written, the new one, bit for bit; and it must take the next update.

use ed25519_compact::{KeyPair, Seed};
use std::collections::HashSet;
use yawrig_firmware::lock::{self, Challenge};
use yawrig_firmware::slots::{Flash, FlashFault, Sector, Slot, Store, SLOT_BYTES};
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::network::Network;
use yawrig_shared::wire::{unlock_message, Signature};

/// How far a torn operation may have come: nothing, all, or something between.
const TEARS: u32 = 9;
/// Where the commit word stands in a slot.
const COMMIT_WORD: usize = 0;

/// Scatters 64 bits (splitmix64, Vigna 2015).
fn scatter(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// What a program operation that was cut leaves of `old` on its way to `new`: bits only ever go from 1 to 0.
fn torn_word(old: u32, new: u32, tear: u32, seed: u64) -> u32 {
    let reached = match tear {
        0 => 0,
        1 => u32::MAX,
        2 => 0x0000_ffff,
        3 => 0xffff_0000,
        4 => 0x0000_00ff,
        5 => 0xff00_0000,
        _ => scatter(seed.wrapping_add(u64::from(tear) << 40)) as u32,
    };
    old & (new | !reached)
}

/// What an erase that was cut leaves: bits only ever go from 0 to 1.
fn torn_erase(old: u32, index: usize, tear: u32, seed: u64) -> u32 {
    let words = SLOT_BYTES / 4;
    let reached = match tear {
        0 => 0,
        1 => u32::MAX,
        2 if index < words / 2 => u32::MAX,
        3 if index >= words / 2 => u32::MAX,
        // All but the first words: the commit word stands longest.
        4 if index >= 2 => u32::MAX,
        // The first word alone: it goes first.
        5 if index == 0 => u32::MAX,
        6 if index < 300 => u32::MAX,
        7 | 8 => scatter(seed.wrapping_add((u64::from(tear) << 40) + index as u64)) as u32,
        _ => 0,
    };
    old | reached
}

/// Four sectors, and a sum over their words that tells one state from another.
#[derive(Clone)]
struct Chip {
    sectors: [Box<[u8; SLOT_BYTES]>; 4],
    sum: u64,
}

impl Chip {
    fn erased() -> Self {
        let mut chip = Self { sectors: [(); 4].map(|()| Box::new([0xff; SLOT_BYTES])), sum: 0 };
        chip.sum_up();
        chip
    }

    fn sum_up(&mut self) {
        self.sum = 0;
        for sector in Sector::ALL {
            for offset in (0..SLOT_BYTES).step_by(4) {
                self.sum ^= Self::term(sector, offset, self.word(sector, offset));
            }
        }
    }

    fn term(sector: Sector, offset: usize, word: u32) -> u64 {
        scatter(
            (((sector as u64) << 20 | offset as u64) << 32 | u64::from(word))
                ^ 0x9e37_79b9_7f4a_7c15,
        )
    }

    fn word(&self, sector: Sector, offset: usize) -> u32 {
        let at = &self.sectors[sector as usize][offset..offset + 4];
        u32::from_le_bytes(at.try_into().expect("four bytes"))
    }

    fn set(&mut self, sector: Sector, offset: usize, word: u32) {
        self.sum ^= Self::term(sector, offset, self.word(sector, offset));
        self.sectors[sector as usize][offset..offset + 4].copy_from_slice(&word.to_le_bytes());
        self.sum ^= Self::term(sector, offset, word);
    }
}

impl Flash for Chip {
    fn read(&self, sector: Sector) -> &[u8; SLOT_BYTES] {
        &self.sectors[sector as usize]
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFault> {
        self.sectors[sector as usize].fill(0xff);
        self.sum_up();
        Ok(())
    }

    fn program(&mut self, sector: Sector, offset: usize, word: [u8; 4]) -> Result<(), FlashFault> {
        let old = self.word(sector, offset);
        self.set(sector, offset, old & u32::from_le_bytes(word));
        Ok(())
    }
}

/// A chip that shows `seen`, at each operation, all that a power cut in it could leave. `seen` is also told whether
/// the commit word was being written.
struct Watched<'a> {
    chip: Chip,
    seed: u64,
    seen: &'a mut dyn FnMut(&Chip, bool),
}

impl Flash for Watched<'_> {
    fn read(&self, sector: Sector) -> &[u8; SLOT_BYTES] {
        self.chip.read(sector)
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFault> {
        self.seed += 1;
        for tear in 0..TEARS {
            let mut torn = self.chip.clone();
            for offset in (0..SLOT_BYTES).step_by(4) {
                let old = self.chip.word(sector, offset);
                torn.set(sector, offset, torn_erase(old, offset / 4, tear, self.seed));
            }
            (self.seen)(&torn, false);
        }
        self.chip.erase(sector)
    }

    fn program(&mut self, sector: Sector, offset: usize, word: [u8; 4]) -> Result<(), FlashFault> {
        self.seed += 1;
        let old = self.chip.word(sector, offset);
        for tear in 0..TEARS {
            let torn = torn_word(old, u32::from_le_bytes(word), tear, self.seed);
            self.chip.set(sector, offset, torn);
            (self.seen)(&self.chip, offset == COMMIT_WORD);
        }
        self.chip.set(sector, offset, old);
        self.chip.program(sector, offset, word)
    }
}

/// What runs: its slot, generation, and checksum of the payload. None: the network compiled in.
type Runs = Option<(Slot, u32, u32)>;

fn starts(chip: &Chip) -> Runs {
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
fn update<F: Flash>(flash: F, runs: Runs) -> (F, Runs) {
    let newest = runs.map_or(0, |(_, generation, _)| generation);
    let bytes = network(newest + 1);
    let mut store = Store::new(flash);
    store.begin(bytes.len() as u32, runs.map(|(slot, ..)| slot)).expect("an erased slot");
    for (index, chunk) in bytes.chunks(256).enumerate() {
        store.chunk(256 * index as u32, chunk).expect("in order");
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
    fn start(&mut self, chip: &Chip, old: Runs, new: Option<Runs>) -> Runs {
        let runs = starts(chip);
        assert!(
            runs == old || Some(runs) == new,
            "{runs:?} runs after a cut where {old:?} should{}",
            if new.is_some() { " or its successor" } else { "" }
        );
        runs
    }

    /// Cuts at every operation of an update of `chip`, which is to run `old`.
    fn cut_everywhere(&mut self, chip: &Chip, old: Runs, again: bool) {
        let (_, next) = update(chip.clone(), old);
        let mut seen = |torn: &Chip, committing: bool| {
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
        let watched = Watched { chip: chip.clone(), seed: u64::from(again), seen: &mut seen };
        let (watched, runs) = update(watched, old);
        assert_eq!(runs, next);
        assert_eq!(starts(&watched.chip), next);
    }
}

#[test]
fn no_power_cut_costs_the_network_or_the_next_update() {
    let mut tried = Tried::default();
    // A new device; one with a network; one with two, as after every later update.
    let mut chip = Chip::erased();
    let mut runs = None;
    for _ in 0..3 {
        tried.cut_everywhere(&chip, runs, true);
        (chip, runs) = update(chip, runs);
    }
    println!(
        "cut points: {} in an update, {} in the update after such a cut; {} different states of the flash, none lost",
        tried.first,
        tried.second,
        tried.distinct.len()
    );
    let operations = (BUILT_IN.len().div_ceil(4) + 3) as u64;
    assert_eq!(tried.first, 3 * operations * u64::from(TEARS));
    assert_eq!(tried.second, tried.first * operations * u64::from(TEARS));
}

fn pair() -> KeyPair {
    KeyPair::from_seed(Seed::new([3; 32]))
}

/// The answer to this lock's challenge.
fn answer(number: u32) -> Signature {
    let signature = pair().sk.sign(unlock_message(number, 5), None);
    Signature::from_slice(&*signature).expect("64 bytes")
}

fn key(chip: &Chip) -> Option<[u8; 32]> {
    lock::read(chip).map(|lock| lock.key)
}

fn lock_it<F: Flash>(flash: &mut F) -> u32 {
    lock::lock(flash, &pair().pk).expect("it can be locked");
    lock::read(flash).expect("locked").number
}

fn renew_it<F: Flash>(flash: &mut F) -> u32 {
    lock::renew(flash).expect("it is locked")
}

fn open_it<F: Flash>(flash: &mut F) -> u32 {
    let number = lock::read(flash).expect("locked").number;
    let challenge = Challenge { number, nonce: 5 };
    lock::unlock(flash, challenge, &answer(number)).expect("it can be opened");
    number + 1
}

/// Cuts at every operation of locking, challenging or opening `chip`, which becomes what that makes of it: the lock is
/// as before or as wanted, no number comes again, the network stays, and lock and update work on. Returns how many.
fn cut_the_lock(chip: &mut Chip, number: u32, act: impl Fn(&mut Watched) -> u32) -> usize {
    let (before, runs) = (key(chip), starts(chip));
    let mut torn = Vec::new();
    let mut seen = |chip: &Chip, _| torn.push(chip.clone());
    let mut watched = Watched { chip: chip.clone(), seed: 7, seen: &mut seen };
    assert_eq!(act(&mut watched), number + 1);
    *chip = watched.chip;
    let after = key(chip);
    for mut torn in torn.iter().cloned() {
        let held = key(&torn);
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
        assert_eq!(key(&torn), None);
    }
    torn.len()
}

#[test]
fn no_power_cut_leaves_a_lock_that_was_not_wanted() {
    const RECORDS: usize = SLOT_BYTES / 48;
    let (mut chip, _) = update(Chip::erased(), None);
    let (mut tried, mut number) = (0, 0);
    // New, used, and full, where the other sector is begun: erased as it comes, then with old records in it.
    for round in 0..4 {
        let acts: [fn(&mut Watched) -> u32; 3] = [|c| lock_it(c), |c| renew_it(c), |c| open_it(c)];
        for act in acts {
            tried += cut_the_lock(&mut chip, number, act);
            number += 1;
        }
        if round > 0 {
            lock_it(&mut chip);
            let up_to = (round * RECORDS) as u32 - 2;
            while renew_it(&mut chip) < up_to {}
            number = open_it(&mut chip);
            assert_eq!(number, up_to + 1);
        }
    }
    println!(
        "cut points in locking, challenging and opening: {tried}, each as before or as wanted"
    );
    // Two of the rounds begin another sector.
    assert_eq!(tried, (4 * 3 * 12 + 2) * TEARS as usize);
}
