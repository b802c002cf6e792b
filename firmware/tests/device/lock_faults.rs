//! A lock whose flash fails: lost bits, units that cannot be read, power cuts. Once locked, a device is never
//! unlocked but by its key. `cargo test --release -p yawrig-firmware --test device lock_faults -- --nocapture`
//! prints the table.

use crate::chip::{Chip, Watched};
use crate::desk::Desk;
use ed25519_compact::{KeyPair, Seed};
use embedded_storage::nor_flash::NorFlash;
use std::collections::BTreeMap;
use yawrig_firmware::lock;
use yawrig_firmware::slots::Sector;
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{unlock_message, Refusal, Reply, Request, Signature, NOBODYS_KEY};

/// Bytes of a record of the lock.
const RECORD: usize = 48;

fn pair() -> KeyPair {
    KeyPair::from_seed(Seed::new([3; 32]))
}

fn start<const WRITE: usize, const ERASE: usize>() -> usize {
    Sector::Lock.start::<Chip<WRITE, ERASE>>()
}

/// Where the second copy begins.
const fn pitch(write: usize) -> usize {
    RECORD.next_multiple_of(write)
}

fn locked<const WRITE: usize, const ERASE: usize>() -> Chip<WRITE, ERASE> {
    let mut chip = Chip::erased();
    lock::lock(&mut chip, &pair().pk).expect("it can be locked");
    chip
}

/// A device locked by firmware that wrote one copy, with nothing in the bytes before the checksum.
fn locked_once<const WRITE: usize, const ERASE: usize>() -> Chip<WRITE, ERASE> {
    let mut record = [0xff; 256];
    record[..4].copy_from_slice(&1_u32.to_le_bytes());
    record[4..8].copy_from_slice(b"LOCK");
    record[8..40].copy_from_slice(&*pair().pk);
    let crc = crc32(&record[..44]);
    record[44..48].copy_from_slice(&crc.to_le_bytes());
    let mut chip = Chip::erased();
    chip.write(start::<WRITE, ERASE>() as u32, &record[..pitch(WRITE)]).expect("erased");
    chip
}

/// What a device that starts from this flash says it is locked with. Where that is somebody's key the lock
/// is in two good copies again; in either case nobody locks it, and nobody else opens it.
fn starts<const WRITE: usize, const ERASE: usize>(chip: &Chip<WRITE, ERASE>) -> Option<[u8; 32]> {
    let mut desk = Desk::new(chip.clone());
    let key = desk.status().lock;
    let Some(key) = key else { return key };
    let refused = Reply::Refused(Refusal::LockedAlready);
    assert_eq!(
        desk.ask(&Request::Lock { key: *KeyPair::from_seed(Seed::new([9; 32])).pk }),
        refused
    );
    assert_eq!(desk.ask(&Request::FlashBegin { length: 1000 }), Reply::Refused(Refusal::Unsigned));
    let challenge = desk.ask(&Request::Challenge);
    if key == NOBODYS_KEY {
        assert_eq!(challenge, Reply::Refused(Refusal::NotAKey));
        let signature = Signature::from_slice(&[0; 64]).expect("64 bytes");
        let wrong = Reply::Refused(Refusal::WrongSignature);
        assert_eq!(desk.ask(&Request::Unlock { signature }), wrong);
        return Some(key);
    }
    let Reply::Challenge { number, nonce } = challenge else { panic!("{challenge:?}") };
    let signed = pair().sk.sign(unlock_message(number, nonce), None);
    let signature = Signature::from_slice(&*signed).expect("64 bytes");
    assert_eq!(desk.ask(&Request::Unlock { signature }), Reply::Done);
    assert_eq!(desk.status().lock, None);
    Some(key)
}

/// What became of a fault: counts by what the device says.
#[derive(Default)]
struct Table(BTreeMap<&'static str, [usize; 3]>);

impl Table {
    fn add<const WRITE: usize, const ERASE: usize>(
        &mut self,
        fault: &'static str,
        chip: &Chip<WRITE, ERASE>,
    ) -> Option<[u8; 32]> {
        let key = starts(chip);
        let column = match key {
            Some(NOBODYS_KEY) => 1,
            Some(key) => {
                assert_eq!(key, *pair().pk, "{fault}");
                0
            }
            None => 2,
        };
        self.0.entry(fault).or_default()[column] += 1;
        key
    }

    fn print(&self, flash: &str) {
        println!("{flash:24} its own key  nobody's  unlocked");
        for (fault, [own, nobodys, unlocked]) in &self.0 {
            println!("{fault:24} {own:11} {nobodys:9} {unlocked:9}");
        }
    }
}

fn no_fault_unlocks<const WRITE: usize, const ERASE: usize>() {
    let mut table = Table::default();
    let whole = locked::<WRITE, ERASE>();
    let copies = [start::<WRITE, ERASE>(), start::<WRITE, ERASE>() + pitch(WRITE)];
    let bits = || (0..RECORD).flat_map(|byte| (0..8).map(move |bit| (byte, bit)));
    for (byte, bit) in bits() {
        for (copy, fault) in copies.into_iter().zip(["a bit of the first", "a bit of the second"]) {
            let mut chip = whole.clone();
            chip.flip(copy + byte, bit);
            table.add(fault, &chip);
        }
        // The same bit of both, and one of each that are not the same.
        for other in [(byte, bit), ((byte * 7 + 5) % RECORD, (bit + 3) % 8)] {
            let mut chip = whole.clone();
            chip.flip(copies[0] + byte, bit);
            chip.flip(copies[1] + other.0, other.1);
            table.add("a bit of both", &chip);
        }
    }
    let units: Vec<usize> = (0..RECORD).step_by(WRITE.max(4)).collect();
    for &first in &units {
        for (copy, fault) in
            copies.into_iter().zip(["no read of the first", "no read of the second"])
        {
            let mut chip = whole.clone();
            chip.fail_reads(copy + first);
            table.add(fault, &chip);
        }
        for &second in &units {
            let mut chip = whole.clone();
            chip.fail_reads(copies[0] + first);
            chip.fail_reads(copies[1] + second);
            table.add("no read of both", &chip);
            if WRITE == 4 {
                let mut chip = whole.clone();
                chip.damage(copies[0] + first);
                chip.damage(copies[1] + second);
                table.add("a word of both", &chip);
            }
        }
    }
    let mut dead = whole.clone();
    (0..ERASE).step_by(WRITE).for_each(|at| dead.fail_reads(copies[0] + at));
    table.add("no read of the sector", &dead);
    table.print(&format!("write size {WRITE}"));
    for (fault, [own, nobodys, unlocked]) in &table.0 {
        let both = fault.ends_with("both") || fault.ends_with("sector");
        assert_eq!((*own == 0, *nobodys == 0, *unlocked), (both, !both, 0), "{fault}");
    }
}

#[test]
fn no_fault_unlocks_a_device_with_flash_as_the_nucleo_has_it() {
    no_fault_unlocks::<4, { 16 * 1024 }>();
}

#[test]
fn no_fault_unlocks_a_device_with_flash_as_the_pico_has_it() {
    no_fault_unlocks::<256, 4096>();
}

/// A start makes a copy good that is lost: then each one of the two may be lost.
#[test]
fn a_start_mends_the_copy_that_is_lost() {
    let start = start::<4, 4096>();
    // One place is left free behind what does not count, where that is the last.
    for (lost, mended) in [(0, [2, 3]), (1, [3, 4])] {
        for again in mended {
            let mut chip = locked::<4, 4096>();
            chip.flip(start + lost * RECORD + 20, 3);
            let mut chip = Desk::new(chip).device.into_flash();
            for copy in [0, 1, again] {
                chip.fail_reads(start + copy * RECORD);
            }
            assert_eq!(starts(&chip), Some(*pair().pk), "{lost}, {again}");
        }
    }
}

/// An unlocked device whose last act was to be opened does not become anybody's by a fault either.
#[test]
fn what_opened_it_is_kept_twice_too() {
    let mut chip = Desk::new(locked::<4, 4096>()).device.into_flash();
    let number = lock::read(&mut chip).expect("locked").number;
    let challenge = lock::Challenge { number, nonce: 5 };
    let signed = pair().sk.sign(unlock_message(number, 5), None);
    let signature = Signature::from_slice(&*signed).expect("64 bytes");
    lock::unlock(&mut chip, challenge, &signature).expect("its key");
    assert_eq!(starts(&chip), None);
    let opened = start::<4, 4096>() + 2 * RECORD;
    for byte in 0..RECORD {
        let mut once = chip.clone();
        once.flip(opened + byte, 1);
        assert_eq!(starts(&once), None, "{byte}");
        once.flip(opened + RECORD + byte, 1);
        assert_eq!(starts(&once), Some(NOBODYS_KEY), "{byte}");
    }
}

#[test]
fn a_device_that_was_locked_with_one_copy_stays_locked_and_has_two() {
    fn check<const WRITE: usize, const ERASE: usize>() {
        let chip = locked_once::<WRITE, ERASE>();
        assert_eq!(starts(&chip), Some(*pair().pk));
        let mut chip = Desk::new(chip).device.into_flash();
        // What the update has made of it is as good as two copies of its own.
        chip.fail_reads(start::<WRITE, ERASE>());
        chip.fail_reads(start::<WRITE, ERASE>() + pitch(WRITE));
        assert_eq!(starts(&chip), Some(*pair().pk));
    }
    check::<4, { 16 * 1024 }>();
    check::<256, 4096>();
}

/// Erased flash, what another program has left there, and power cuts of what is no lock.
#[test]
fn what_was_never_locked_is_not() {
    assert_eq!(starts(&Chip::<4, 4096>::erased()), None);
    let mut noise = crate::desk::Noise(7);
    let mut chip = Chip::<256, 4096>::erased();
    for place in [Sector::Lock, Sector::OtherLock] {
        let bytes: Vec<u8> = (0..16 * 1024).map(|_| (40.0 * noise.next()) as i64 as u8).collect();
        chip.write(place.start::<Chip<256, 4096>>() as u32, &bytes).expect("erased");
    }
    assert_eq!(starts(&chip), None);
}

/// Every cut of the renewal of a lock, of which one copy or none was lost before, and of mending it.
#[test]
fn no_power_cut_unlocks_it_whatever_was_lost_before() {
    fn check<const WRITE: usize, const ERASE: usize>() -> usize {
        let mut cuts = 0;
        let copies = [start::<WRITE, ERASE>(), start::<WRITE, ERASE>() + pitch(WRITE)];
        for lost in [None, Some(copies[0]), Some(copies[1])] {
            let mut chip = locked::<WRITE, ERASE>();
            lost.into_iter().for_each(|lost| chip.flip(lost + 12, 0));
            let mut seen = |torn: &Chip<WRITE, ERASE>, _| {
                assert_eq!(starts(torn), Some(*pair().pk), "{lost:?}");
                cuts += 1;
            };
            let mut watched = Watched { chip, seen: &mut seen };
            assert!(!lock::mend(&mut watched));
            lock::renew(&mut watched).expect("locked");
        }
        cuts
    }
    let (words, pages) = (check::<4, { 16 * 1024 }>(), check::<256, 4096>());
    println!("{words} and {pages} cuts, none unlocks");
    // Nine of each unit: three renewals and two mendings, of two copies.
    assert_eq!((words, pages), (5 * 2 * 9 * RECORD / 4, 5 * 2 * 9));
}
