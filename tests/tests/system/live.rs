//! A device followed: its trace whole, gaps where the line has lost some, and restarts.

use crate::followed::{count, counts, session, until, Followed, Heard};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use yawrig_link::bench::{Bench, Target};
use yawrig_link::live::item::Item;
use yawrig_link::live::recording::Recording;
use yawrig_link::live::session::{Follow, Session};
use yawrig_link::live::stored::Stored;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{Condition, Forgotten, Request, Settings};
use yawrig_tests::line::{Board, Way};
use yawrig_tests::PATIENCE;

#[test]
fn sixty_seconds_at_a_kilohertz_come_whole_and_are_stored_whole() {
    let sent = counts(60);
    let bench = Bench::open(&Target::Emulated).expect("a device");
    let mut session = Session::new(bench, Follow::Trace).expect("a device");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("session.csv");
    let mut recording = Recording::begin(&file, None).expect("room for it");
    let mut heard = Heard::default();
    let mut take = |session: &mut Session, heard: &mut Heard, patience| {
        while let Some(item) = session.next(patience).expect("no fault") {
            for record in recording.put(&item).expect("room for it") {
                heard.take(record, &sent);
            }
            heard.take(item, &sent);
        }
    };
    // The stream is asked for.
    take(&mut session, &mut heard, Duration::from_millis(1));
    for some in sent.chunks(100) {
        session.bench().play(some).expect("it takes them");
        take(&mut session, &mut heard, Duration::ZERO);
    }
    // The last ones fill no message yet.
    session.mark("the end");
    until("the last samples", || {
        take(&mut session, &mut heard, Duration::from_millis(10));
        heard.samples >= 60_000
    });
    assert_eq!((heard.samples, heard.missing), (60_000, 0));
    assert!(heard.releases >= 1, "{}", heard.releases);
    let (finished, _) = recording.finish().expect("room for it");
    assert_eq!((finished.samples, finished.missing_samples), (60_000, 0));
    assert_eq!(finished.trace, file);

    let record = yawrig_records::read(&file).expect("a record");
    let stored: Vec<u16> = record.yaw_deg.iter().map(|yaw_deg| count(*yaw_deg)).collect();
    assert_eq!(stored, sent);
    assert!(record.timing().is_regular());

    // Each release is a record of its own, and the session is read back as it was.
    let back = Stored::open(folder.path()).expect("the session");
    assert!(back.finished);
    let mut again = Heard::default();
    back.items.iter().for_each(|item| again.take(item.clone(), &sent));
    assert_eq!((again.samples, again.missing, again.releases), (60_000, 0, heard.releases));
    let others = |items: &[Item]| {
        let others = items.iter().filter(|i| !matches!(i, Item::Samples { .. }));
        others.cloned().collect::<Vec<_>>()
    };
    let in_order = |mut items: Vec<Item>| {
        items.sort_by_key(|item| (item.at(), format!("{item:?}")));
        items
    };
    assert_eq!(in_order(others(&back.items)), in_order(others(&heard.items)));
    let records: Vec<PathBuf> = (heard.items.iter())
        .filter_map(|item| match item {
            Item::Record { file, missing_samples: 0, .. } => Some(folder.path().join(file)),
            _ => None,
        })
        .collect();
    assert_eq!(records.len(), heard.releases);
    for file in records {
        let record = yawrig_records::read(&file).expect("a record");
        assert!(record.timing().is_regular() && record.len() > 5000, "{}", record.len());
    }
}

#[test]
fn what_a_bad_line_loses_is_a_gap_and_nothing_is_invented() {
    for (turned, seed) in [(0.0, 0), (1e-5, 1), (1e-4, 2), (4e-4, 3)] {
        let sent = counts(8);
        let board = Board::default();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let line = board.plug_with(move |_, bytes| {
            for byte in bytes.iter_mut() {
                let bits = (0..8).filter(|_| random.random_bool(turned));
                *byte = bits.fold(*byte, |byte, bit| byte ^ (1 << bit));
            }
            true
        });
        let mut followed = Followed::new(session(line.path()), &sent);
        line.play(&board, &sent, || followed.hear());
        followed.hear_until("what is on its way", |heard| heard.next > Some(7200));
        let heard = followed.heard;
        println!("bits turned {turned:e}: {} samples, {} missing", heard.samples, heard.missing);
        // All but what was on its way at the end, and before the stream was asked for.
        assert!(heard.samples + heard.missing > 7000, "{}", heard.samples + heard.missing);
        // Of 160 messages of a thousand bits one in ten is hit at 1e-4, and none by chance once in 1e7.
        match turned {
            0.0 => assert_eq!(heard.missing, 0),
            1e-5 => assert!(heard.missing < 2000, "{}", heard.missing),
            _ => assert!(heard.missing > 0),
        }
    }
}

/// And its settings and the condition of its releases are what they were.
#[test]
fn a_reset_on_the_line_begins_the_stream_anew() {
    let sent = counts(8);
    let board = Board::default();
    let settings = Settings { degrees_per_count: 0.0025, ..Settings::default() };
    let condition = Condition {
        rig: 7,
        wind: Wind { density_kg_m3: 1.2, speed_m_s: 10.0 },
        model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
        inertia_kg_m2: 0.101,
    };
    board.tell(&Request::Configure(settings));
    board.tell(&Request::Condition(condition));
    assert_eq!(board.status().condition, Some(condition));
    let line = board.plug_with(|_: Way, _| true);
    let mut session = session(line.path());
    let mut items: Vec<Item> = Vec::new();
    let mut hear = |items: &mut Vec<Item>| {
        while let Some(item) = session.next(Duration::from_millis(1)).expect("no fault") {
            items.push(item);
        }
    };
    let last = |items: &[Item]| items.iter().map(Item::at).max();
    line.play(&board, &sent, || hear(&mut items));
    until("what is on its way", || {
        hear(&mut items);
        last(&items) >= Some(7900)
    });
    board.restart();
    until("it is noticed", || {
        hear(&mut items);
        items.iter().any(|item| matches!(item, Item::Restored { .. }))
    });
    let begun = last(&items);
    line.play(&board, &sent, || hear(&mut items));
    until("what is on its way", || {
        hear(&mut items);
        last(&items) >= begun.map(|begun| begun + 4000)
    });
    let at = items.iter().position(|item| matches!(item, Item::Restarted { .. }));
    let (before, after) = items.split_at(at.expect("it is noticed"));
    for items in [before, after] {
        let samples = items.iter().filter(|item| matches!(item, Item::Samples { .. }));
        assert!(samples.count() > 20);
    }
    let restored = items.iter().position(|item| matches!(item, Item::Restored { .. }));
    assert!(restored > at, "it is said: {restored:?} {at:?}");
    let item = &items[restored.expect("said")];
    assert_eq!(Item::from_json(&item.to_json()).as_ref(), Some(item));
    let status = board.status();
    assert_eq!((status.settings, status.condition), (settings, Some(condition)));
}

/// Once, with its reason; a condition of the same rig is none.
#[test]
fn what_a_condition_makes_the_device_forget_is_said() {
    let board = Board::default();
    let of_rig = |rig| Condition {
        rig,
        wind: Wind { density_kg_m3: 1.2, speed_m_s: 0.0 },
        model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
        inertia_kg_m2: 0.101,
    };
    board.tell(&Request::Condition(of_rig(7)));
    // Let go at 14 deg twice, with 0.08 deg of noise.
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let Settings { degrees_per_count, zero_counts, .. } = Settings::default();
    let releases: Vec<u16> = (0..24_000_u32)
        .map(|k| {
            let t = f64::from((k % 12_000).saturating_sub(2000)) * 1e-3;
            let yaw_deg =
                14.0 * (-0.36 * t).exp() * (12.0 * t).cos() + random.random_range(-0.14..0.14);
            (f64::from(zero_counts) + yaw_deg / f64::from(degrees_per_count)).round() as u16
        })
        .collect();
    board.samples(&releases);
    let learnt = board.status().learnt;
    assert!(learnt.releases > 0 && learnt.forgotten.is_none(), "{learnt:?}");
    let line = board.plug();
    let mut session = session(line.path());
    let is_forgotten = |item: &Item| matches!(item, Item::Forgotten { .. });
    let mut said = |rig, is_told: bool| {
        // One that is going on ends under the rig it began with.
        board.tell(&Request::EndRelease { after_samples: 0 });
        session.set_condition(of_rig(rig)).expect("a condition");
        let mut items = Vec::new();
        // Longer than until the device is asked again; and until it is told, however busy the machine is.
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(1500)
            || is_told && !items.iter().any(is_forgotten)
        {
            assert!(begun.elapsed() < PATIENCE, "nothing is told of {rig}");
            items.extend(session.next(Duration::from_millis(10)).expect("no fault"));
        }
        items.retain(is_forgotten);
        items
    };
    assert_eq!(said(7, false), []);
    let items = said(8, true);
    let [Item::Forgotten { releases, why: Forgotten::Rig, .. }] = items[..] else {
        panic!("{items:?}")
    };
    assert_eq!(releases, learnt.releases);
    assert_eq!(Item::from_json(&items[0].to_json()).as_ref(), Some(&items[0]));
    let text = items[0].to_text("").expect("it is told");
    assert!(text.ends_with(" of its network's error: another rig is mounted"), "{text}");
    assert_eq!(said(9, false), [], "there was nothing left to forget");
}

/// As when the disk has less left than a trace may leave: all but the trace is written.
#[test]
fn where_little_of_the_disk_is_left_the_trace_ends_and_nothing_else_is_lost() {
    let sent = counts(60);
    let bench = Bench::open(&Target::Emulated).expect("a device");
    let mut session = Session::new(bench, Follow::Trace).expect("a device");
    let folder = tempfile::tempdir().expect("a folder");
    let mut recording = Recording::begin(folder.path(), None).expect("room for it");
    let (mut said, mut heard) = (Vec::new(), Heard::default());
    let mut take = |session: &mut Session, recording: &mut Recording, patience| {
        while let Some(item) = session.next(patience).expect("no fault") {
            said.extend(recording.put(&item).expect("room for it"));
            heard.take(item, &sent);
        }
        heard.samples
    };
    take(&mut session, &mut recording, Duration::from_millis(1));
    // From a second on.
    for (index, some) in sent.chunks(100).enumerate() {
        if index == 10 {
            recording.leave_free(u64::MAX);
        }
        session.bench().play(some).expect("it takes them");
        take(&mut session, &mut recording, Duration::ZERO);
    }
    session.mark("the end");
    until("the last samples", || {
        take(&mut session, &mut recording, Duration::from_millis(10)) >= 60_000
    });
    let (finished, last) = recording.finish().expect("room for it");
    said.extend(last);
    let ended: Vec<&Item> =
        said.iter().filter(|item| matches!(item, Item::TraceEnded { .. })).collect();
    let [ended] = ended[..] else { panic!("{ended:?}") };
    assert!(ended.to_text("").expect("words").contains("make room"), "{ended:?}");
    assert_eq!(finished.samples, ended.at());
    assert_eq!((finished.samples + finished.lost_samples, finished.missing_samples), (60_000, 0));
    // No sample that came after.
    assert!(finished.samples <= 1000, "{}", finished.samples);
    assert!(finished.to_text().contains("could not be written"), "{}", finished.to_text());

    // What is stored says the same, and has every result; the last release's record begins after the end.
    let back = Stored::open(folder.path()).expect("the session");
    assert!(back.items.contains(ended));
    let releases = |items: &[Item]| {
        items.iter().filter(|i| matches!(i, Item::Record { .. })).cloned().collect::<Vec<_>>()
    };
    assert_eq!(releases(&back.items), releases(&said));
    let Some(Item::Record { file, missing_samples: 0, at, .. }) = releases(&said).pop() else {
        panic!("{said:?}")
    };
    assert!(at > ended.at(), "{at}");
    let record = yawrig_records::read(&folder.path().join(file)).expect("a record");
    assert!(record.timing().is_regular() && record.len() > 5000, "{}", record.len());
}
