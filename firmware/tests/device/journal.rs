//! The log: what is in it, how long it is kept, and power cuts at every operation of it.

use crate::chip::{Chip, Watched};
use crate::desk::{Desk, Swing};
use embedded_storage::nor_flash::NorFlash;
use yawrig_firmware::journal::{Journal, Moment};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{
    rig_id, Cause, Condition, Crash, LogEntry, Logged, Refined, Refusal, Reply, Request, Start,
};

const WHEN: Moment = Moment { at_sample: 7, lost_samples: 0, network: 3 };

fn condition(speed_m_s: f64) -> Condition {
    Condition {
        rig: rig_id("K3", "mid"),
        wind: Wind { density_kg_m3: 1.2, speed_m_s },
        model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
        inertia_kg_m2: 0.0,
    }
}

fn started(cause: Cause) -> Start {
    Start { cause, crash: None }
}

fn log<F: NorFlash>(desk: &mut Desk<F>) -> Vec<LogEntry> {
    let mut entries: Vec<LogEntry> = Vec::new();
    loop {
        let from = entries.last().map_or(0, |last| last.number + 1);
        match desk.ask(&Request::Log { from }) {
            Reply::Log(Some(entry)) => entries.push(entry),
            Reply::Log(None) => return entries,
            other => panic!("{other:?}"),
        }
    }
}

fn short(seed: u32) -> Vec<u16> {
    Swing { seconds: 9.0, ..Swing::new(8.0, 0.05) }.counts(seed)
}

/// Weeks without a host: forty releases, of which the line keeps none, over two runs; then somebody asks.
#[test]
fn what_nobody_listened_to_is_read_out_later() {
    let mut desk = Desk::new(MemoryFlash::with_log());
    desk.device.set_start(started(Cause::Power), 0);
    let mut said = Vec::new();
    for release in 0..40 {
        let wind = condition(if release < 20 { 0.0 } else { 10.0 });
        assert_eq!(desk.ask(&Request::Condition(wind)), Reply::Done);
        desk.play(short(release));
        desk.end();
        said.push((desk.releases.pop().expect("a result"), desk.refined.pop().expect("refined")));
        if release == 9 {
            desk = Desk::new(desk.device.into_flash());
            let crash = Crash { file: "refine.rs".try_into().unwrap(), line: 12 };
            desk.device.set_start(Start { cause: Cause::Watchdog, crash: Some(crash) }, 1);
        }
    }
    let entries = log(&mut desk);
    let numbers: Vec<u32> = entries.iter().map(|entry| entry.number).collect();
    assert_eq!(numbers, (1..=numbers.len() as u32).collect::<Vec<_>>());
    let mut found = Vec::new();
    let mut told = Vec::new();
    for entry in &entries {
        match &entry.what {
            Logged::Release(release) => found.push((*release, Refined::default())),
            Logged::Refined(refined) => found.last_mut().expect("its release").1 = *refined,
            Logged::Start(start) => told.push((entry.number, entry.run, start.cause as u8)),
            Logged::Condition(condition) => {
                told.push((entry.number, entry.run, condition.wind.speed_m_s as u8));
            }
        }
    }
    assert_eq!(found, said);
    // A start and a condition, ten releases; the same once more, and 10 m/s after ten.
    let (power, watchdog) = (Cause::Power as u8, Cause::Watchdog as u8);
    assert_eq!(told, [(1, 1, power), (2, 1, 0), (23, 23, watchdog), (24, 23, 0), (45, 23, 10)]);
    assert!(entries.iter().all(|entry| entry.network == desk.status().network.id));
    // The line had kept what came last alone.
    assert!(desk.status().next_event > 100);
}

#[test]
fn a_flash_without_room_for_it_has_none_and_says_so() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.play(short(1));
    desk.end();
    assert_eq!(desk.ask(&Request::Log { from: 0 }), Reply::Refused(Refusal::NoLog));
}

#[test]
fn starts_without_end_are_one_entry() {
    let mut flash = MemoryFlash::with_log();
    for cause in [Cause::Power, Cause::Watchdog] {
        for _ in 0..500 {
            let mut desk = Desk::new(flash);
            desk.device.set_start(started(cause), 0);
            desk.play([32_768; 3]);
            flash = desk.device.into_flash();
        }
    }
    let entries = log(&mut Desk::new(flash));
    // That of the asking device, which does not know its cause, is the third.
    let causes: Vec<_> = entries.iter().map(|entry| entry.what.clone()).collect();
    let starts = [Cause::Power, Cause::Watchdog, Cause::Unknown].map(|c| Logged::Start(started(c)));
    assert_eq!(causes, starts);
}

fn opened<F: NorFlash>(flash: &mut F) -> Journal {
    let mut journal = Journal::new();
    journal.open(flash);
    journal
}

fn refined(release: u32) -> Logged {
    Logged::Refined(Refined { release, ..Refined::default() })
}

fn add<F: NorFlash>(flash: &mut F, release: u32) {
    opened(flash).add(flash, None, refined(release), WHEN);
}

fn releases<F: NorFlash>(flash: &mut F) -> Vec<u32> {
    let journal = opened(flash);
    let mut from = 0;
    std::iter::from_fn(|| {
        let entry = journal.entry_from(flash, from)?;
        from = entry.number + 1;
        match entry.what {
            Logged::Refined(refined) => Some(refined.release),
            other => panic!("{other:?}"),
        }
    })
    .collect()
}

/// As many as the ring has room for, less a sector: the newest, in their order.
fn the_newest_are_kept<const WRITE: usize, const ERASE: usize>(sectors: usize, entries: usize) {
    let mut chip = Chip::<WRITE, ERASE>::with_sectors_behind(sectors);
    let at_once = (entries / sectors).max(1);
    for release in 0..3 * entries as u32 {
        add(&mut chip, release);
        let kept = releases(&mut chip);
        let first = (release + 1).saturating_sub(kept.len() as u32);
        assert!(kept.iter().copied().eq(first..=release), "{kept:?}");
        assert!(kept.len() > (entries - at_once).min(release as usize), "{release}: {kept:?}");
    }
}

#[test]
fn the_newest_are_kept_on_any_flash() {
    the_newest_are_kept::<256, 4096>(3, 48);
    the_newest_are_kept::<8, 2048>(3, 24);
    the_newest_are_kept::<4, 16_384>(2, 128);
    // Sectors smaller than an entry.
    the_newest_are_kept::<4, 128>(8, 4);
}

/// After a cut in any operation all that was there before is, but what made room, and it goes on.
fn no_cut_loses_any<const WRITE: usize, const ERASE: usize>(
    sectors: usize,
    entries: usize,
) -> usize {
    let mut chip = Chip::<WRITE, ERASE>::with_sectors_behind(sectors);
    let at_once = (entries / sectors) as u32;
    let mut cuts = 0;
    for release in 0..2 * entries as u32 + 3 {
        let before = releases(&mut chip);
        let mut torn = Vec::new();
        let mut seen = |chip: &Chip<WRITE, ERASE>, _| torn.push(chip.clone());
        let mut watched = Watched { chip: chip.clone(), seen: &mut seen };
        add(&mut watched, release);
        chip = watched.chip;
        cuts += torn.len();
        for mut torn in torn {
            let kept = releases(&mut torn);
            let missing: Vec<u32> =
                before.iter().copied().filter(|old| !kept.contains(old)).collect();
            assert!(missing.iter().all(|old| *old < before[0] + at_once), "{before:?}: {kept:?}");
            assert!(kept.iter().all(|one| before.contains(one) || *one == release), "{kept:?}");
            // The next two are there, and once.
            add(&mut torn, 9000);
            add(&mut torn, 9001);
            let after = releases(&mut torn);
            assert_eq!(after[after.len() - 2..], [9000, 9001], "{kept:?} {after:?}");
            let old = &after[..after.len() - 2];
            assert!(kept.ends_with(old) && old.len() + 2 * at_once as usize >= kept.len());
        }
    }
    cuts
}

/// `cargo test --release -p yawrig-firmware --test device journal -- --nocapture` prints how many.
#[test]
fn a_power_cut_at_every_write_and_erase_leaves_it_readable() {
    let cuts = [
        no_cut_loses_any::<256, 4096>(2, 32),
        no_cut_loses_any::<4, 2048>(2, 16),
        // With an error-correcting code: what was cut cannot be read any more.
        no_cut_loses_any::<8, 2048>(3, 24),
    ];
    println!("{cuts:?} cuts");
    assert!(cuts.iter().all(|cuts| *cuts > 500), "{cuts:?}");
}

/// What a flash does not take is written once more, further on.
#[test]
fn a_worn_place_is_passed_over() {
    let mut chip = Chip::<4, 2048>::with_sectors_behind(3);
    (0..5).for_each(|release| add(&mut chip, release));
    // Bits of the next place that do not take part any more.
    chip.damage(4 * Chip::<4, 2048>::PLACE + 5 * 256 + 40);
    (5..9).for_each(|release| add(&mut chip, release));
    assert_eq!(releases(&mut chip), (0..9).collect::<Vec<_>>());
}
