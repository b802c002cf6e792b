//! Power cuts at every flash operation, and inside it, of keeping what was learnt beside a lock, and of
//! locking beside what was learnt; on flash as the boards have it. After each cut either is as before or as
//! wanted, and it goes on.
//! `cargo test --release -p yawrig-firmware --test device learnt_power_cuts -- --nocapture` prints how many.

use crate::chip::{Chip, Watched};
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use yawrig_firmware::learning::{Learning, Seen};
use yawrig_firmware::lock;
use yawrig_firmware::slots::{Sector, ERASED};
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::network::Estimate;
use yawrig_shared::wire::{rig_id, Condition, Forgotten, Learnt, Measured};

const NETWORK: u32 = 0x1234_5678;
/// A point of the curve (RFC 8032, 7.1, test 1), and so a public key.
const KEY: [u8; 32] = [
    0xd7, 0x5a, 0x98, 0x01, 0x82, 0xb1, 0x0a, 0xb7, 0xd5, 0x4b, 0xfe, 0xd3, 0xc9, 0x64, 0x07, 0x3a,
    0x0e, 0xe1, 0x72, 0xf3, 0xda, 0xa6, 0x23, 0x25, 0xaf, 0x02, 0x1a, 0x68, 0xf7, 0x07, 0x51, 0x1a,
];
fn estimate() -> Estimate {
    Estimate { natural_frequency_rad_s: 9.0, damping_ratio: 0.02, ..Estimate::default() }
}

fn condition() -> Condition {
    Condition {
        rig: rig_id("K3", "mid"),
        wind: Wind { density_kg_m3: 1.2, speed_m_s: 0.0 },
        model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
        inertia_kg_m2: 0.0,
    }
}

/// Another release, whose refined estimate lies beside the network's.
fn learn(learning: &mut Learning) {
    let release = u32::from(learning.learnt().releases);
    let means = [Measured { value: 9.0, u: 1e-4 }, Measured { value: 0.02, u: 1e-6 }];
    learning.mount(&condition());
    let bias = [0.02, 0.0005];
    learning.expect(Seen { release, means, windows: 20, single: [0.1, 0.001], bias });
    let by = 1.0 + 1e-6 * (release % 7) as f32;
    let refined = [9.01 * by, 0.0203].map(|value| Measured { value, u: 1e-6 });
    learning.learn(release, refined);
}

/// What a device that starts from this flash knows, and makes of an estimate once its rig is said.
fn known<F: NorFlash>(flash: &mut F) -> (Learnt, [u32; 2]) {
    let mut learning = Learning::new();
    learning.recall(flash, NETWORK);
    learning.mount(&condition());
    let Estimate { natural_frequency_rad_s, damping_ratio, .. } = learning.corrected(&estimate());
    (learning.learnt(), [natural_frequency_rad_s.to_bits(), damping_ratio.to_bits()])
}

fn key<F: NorFlash>(flash: &mut F) -> Option<[u8; 32]> {
    lock::read(flash).map(|lock| lock.key)
}

/// One more release of what this flash knows, kept in it.
fn keep<F: NorFlash>(flash: &mut F) {
    let mut learning = Learning::new();
    learning.recall(flash, NETWORK);
    learn(&mut learning);
    assert!(learning.is_due());
    learning.keep(flash, NETWORK).expect("room for it");
    assert!(!learning.is_due() && learning.learnt().kept);
}

/// What it knows after a record that says that it knows nothing.
fn forget<F: NorFlash>(flash: &mut F) {
    let mut learning = Learning::new();
    learning.recall(flash, NETWORK);
    learning.forget(Forgotten::Rig);
    learning.keep(flash, NETWORK).expect("room for it");
}

fn lock_or_renew<F: NorFlash>(flash: &mut F) {
    match lock::read(flash) {
        None => lock::lock(flash, &KEY).expect("a key"),
        Some(_) => drop(lock::renew(flash).expect("locked")),
    }
}

/// Cuts at every operation of `act`, which `chip` becomes what it makes of; how many.
fn cut<const WRITE: usize, const ERASE: usize>(
    chip: &mut Chip<WRITE, ERASE>,
    act: impl Fn(&mut Watched<WRITE, ERASE>),
) -> usize {
    let before = (known(chip), key(chip));
    let mut torn = Vec::new();
    let mut seen = |chip: &Chip<WRITE, ERASE>, _| torn.push(chip.clone());
    let mut watched = Watched { chip: chip.clone(), seen: &mut seen };
    act(&mut watched);
    *chip = watched.chip;
    let after = (known(chip), key(chip));
    let count = torn.len();
    for mut torn in torn {
        let (mut learnt, key_now) = (known(&mut torn), key(&mut torn));
        if before.0 .0.releases == 0 && learnt.0.releases == 0 {
            // The first record of all, half written, may be seen as one that is damaged.
            learnt.0.forgotten = before.0 .0.forgotten;
        }
        assert!(learnt == before.0 || learnt == after.0, "{learnt:?}: {before:?} or {after:?}");
        assert!(key_now == before.1 || key_now == after.1, "{key_now:?}");
        // Both go on from there, whatever was half done.
        let releases = learnt.0.releases;
        keep(&mut torn);
        lock_or_renew(&mut torn);
        assert_eq!((known(&mut torn).0.releases, key(&mut torn)), (releases + 1, Some(KEY)));
    }
    count
}

fn no_cut_leaves_anything_wrong<const WRITE: usize, const ERASE: usize>() {
    let mut chip = Chip::<WRITE, ERASE>::erased();
    let mut cuts = 0;
    // As it comes, used, and where the other sector is begun: erased as it comes, then with old records in
    // it.
    for round in 0..4 {
        let number = |chip: &mut Chip<WRITE, ERASE>| lock::read(chip).map_or(0, |lock| lock.number);
        for _ in 0..2 {
            cuts += cut(&mut chip, |flash| keep(flash));
            cuts += cut(&mut chip, |flash| lock_or_renew(flash));
        }
        cuts += cut(&mut chip, |flash| forget(flash));
        // Nearly full, by records of either kind; then its end, by one of either.
        let mut full = chip.clone();
        let sector = [Sector::Lock, Sector::OtherLock].map(Sector::start::<Chip<WRITE, ERASE>>);
        let first = |chip: &mut Chip<WRITE, ERASE>, sector: usize| {
            let mut words = [0; 4];
            chip.read(sector as u32, &mut words).is_ok().then_some(words)
        };
        let begins = sector.map(|sector| first(&mut full, sector));
        while sector.map(|sector| first(&mut full, sector)) == begins {
            chip = full.clone();
            keep(&mut full);
        }
        let mut by_lock = chip.clone();
        cuts += cut(&mut chip, |flash| keep(flash));
        let mut last = by_lock.clone();
        while sector.map(|sector| first(&mut last, sector)) == begins {
            by_lock = last.clone();
            lock_or_renew(&mut last);
        }
        cuts += cut(&mut by_lock, |flash| lock_or_renew(flash));
        assert!(round == 0 || number(&mut chip) > 0);
    }
    println!("write size {WRITE}, erase size {ERASE}: {cuts} cuts, none leaves anything wrong");
}

#[test]
fn no_power_cut_leaves_anything_wrong_on_flash_as_the_nucleo_has_it() {
    no_cut_leaves_anything_wrong::<4, { 16 * 1024 }>();
}

#[test]
fn no_power_cut_leaves_anything_wrong_on_flash_as_the_pico_has_it() {
    no_cut_leaves_anything_wrong::<256, 4096>();
}

#[test]
fn no_power_cut_leaves_anything_wrong_on_double_words_at_full_size() {
    no_cut_leaves_anything_wrong::<8, 4096>();
}

/// Damage long after it was written: the record before it counts, or nothing does, and that is said.
#[test]
fn what_is_damaged_is_not_taken_and_that_is_said() {
    let mut flash = Chip::<4, 4096>::erased();
    keep(&mut flash);
    let once = known(&mut flash);
    let mut again = flash.clone();
    keep(&mut again);
    assert_eq!(known(&mut again).0.releases, 2);
    let start = Sector::Lock.start::<Chip<4, 4096>>();
    for offset in (8..96).step_by(4) {
        let mut damaged = flash.clone();
        damaged.damage(start + offset);
        let (learnt, corrected) = known(&mut damaged);
        assert_eq!(learnt.forgotten, Some(Forgotten::Damaged), "{offset}");
        assert_eq!((learnt.releases, corrected[0]), (0, 9.0_f32.to_bits()), "{offset}");
        let mut damaged = again.clone();
        damaged.damage(start + 96 + offset);
        assert_eq!(known(&mut damaged), once, "{offset}");
    }
}

#[test]
fn neither_is_lost_however_often_the_other_is_written() {
    let mut flash = Chip::<256, 4096>::erased();
    keep(&mut flash);
    lock_or_renew(&mut flash);
    let number = lock::read(&mut flash).expect("locked").number;
    for releases in 2..4 * 64 {
        keep(&mut flash);
        assert_eq!(known(&mut flash).0, Learnt { releases, kept: true, forgotten: None });
        // Its challenges are good all the while.
        let lock = lock::read(&mut flash).expect("locked");
        assert_eq!((lock.number, lock.key), (number, KEY));
    }
    let learnt = known(&mut flash);
    for _ in 0..4 * 64 {
        lock_or_renew(&mut flash);
        assert_eq!(known(&mut flash), learnt);
    }
}

/// Flash wears by being erased.
#[test]
fn a_sector_is_erased_once_in_170_releases() {
    let mut flash = Chip::<4, { 16 * 1024 }>::erased();
    let begun = |flash: &mut Chip<4, { 16 * 1024 }>| {
        let mut first = [0; 4];
        flash.read(Sector::OtherLock.start::<Chip<4, 4096>>() as u32, &mut first).expect("whole");
        first != [ERASED; 4]
    };
    for _ in 0..170 {
        keep(&mut flash);
        assert!(!begun(&mut flash));
    }
    keep(&mut flash);
    assert!(begun(&mut flash));
}
