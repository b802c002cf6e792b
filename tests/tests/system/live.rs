//! A device followed: its trace whole, gaps where the line has lost some, unplugging and restarts.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use yawrig_link::bench::{Bench, Target};
use yawrig_link::live::item::Item;
use yawrig_link::live::recording::Recording;
use yawrig_link::live::session::{Follow, Session};
use yawrig_link::live::stored::Stored;
use yawrig_link::port::{PortInfo, UsbId};
use yawrig_rig::{Rig, Sensor, Start};
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{Condition, Event, Forgotten, Request, Settings};
use yawrig_tests::line::{Board, Line, Way};
use yawrig_tests::PATIENCE;

/// Held, let go and swinging: what the potentiometer shows in so many seconds of releases.
fn counts(seconds: usize) -> Vec<u16> {
    let rig = Rig::default();
    let release = |number| {
        let condition = rig.conditions(10.0).nth(13).expect("a condition");
        let made = rig.release(&condition, &Start::default(), &Sensor::default(), number);
        made.expect("a release").samples.filter_map(|s| s.counts)
    };
    (0..).flat_map(release).take(1000 * seconds).collect()
}

/// The converter's count of an angle the session gives.
fn count(yaw_deg: f64) -> u16 {
    let Settings { degrees_per_count, zero_counts, .. } = Settings::default();
    ((yaw_deg / f64::from(degrees_per_count)).round() as i32 + i32::from(zero_counts)) as u16
}

/// What a session has said, held against what the device got.
#[derive(Default)]
struct Heard {
    items: Vec<Item>,
    samples: u64,
    missing: u64,
    next: Option<u64>,
    releases: usize,
}

impl Heard {
    /// `sent`: the counts, `first`: which of them is the session's number 0.
    fn take(&mut self, item: Item, sent: &[u16], first: usize) {
        match &item {
            Item::Samples { first: number, yaw_deg } => {
                assert!(self.next.is_none_or(|next| next == *number), "{:?} {number}", self.next);
                for (n, yaw_deg) in (*number as usize..).zip(yaw_deg) {
                    assert_eq!(count(*yaw_deg), sent[first + n], "sample {n}");
                }
                self.samples += yaw_deg.len() as u64;
                self.next = Some(number + yaw_deg.len() as u64);
            }
            Item::Gap { first, count } => {
                assert_eq!(self.next, Some(*first));
                self.missing += count;
                self.next = Some(first + count);
            }
            Item::Event { event: Event::Release(_), .. } => self.releases += 1,
            _ => {}
        }
        self.items.push(item);
    }

    fn has(&self, what: impl Fn(&Item) -> bool) -> bool {
        self.items.iter().any(what)
    }
}

/// Goes on until it is so; `what` says what is waited for.
fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !is_so() {
        assert!(Instant::now() < end, "{what}");
    }
}

fn session(path: &Path) -> Session {
    let path = path.display().to_string();
    // A bad line may spoil the first words.
    let bench = (0..20).find_map(|_| Bench::open(&Target::Port(path.clone())).ok());
    Session::new(bench.expect("one hello of twenty gets through"), Follow::Trace).expect("a device")
}

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
                heard.take(record, &sent, 0);
            }
            heard.take(item, &sent, 0);
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
    back.items.iter().for_each(|item| again.take(item.clone(), &sent, 0));
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
        let mut session = session(line.path());
        let mut heard = Heard::default();
        line.play(&board, &sent, || {
            while let Some(item) = session.next(Duration::from_millis(1)).expect("no fault") {
                heard.take(item, &sent, 0);
            }
        });
        until("what is on its way", || {
            while let Some(item) = session.next(Duration::from_millis(1)).expect("no fault") {
                heard.take(item, &sent, 0);
            }
            heard.next > Some(7200)
        });
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

fn plugged(line: &Option<Line>) -> &Line {
    line.as_ref().expect("it is plugged in")
}

/// A port that a board can be pulled from and put into again.
struct Socket {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl Socket {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        Self { path: folder.path().join("ttyBOARD"), _folder: folder }
    }

    fn plug(&self, line: Line) -> Line {
        let _ = std::fs::remove_file(&self.path);
        symlink(line.path(), &self.path).expect("a link");
        line
    }
}

#[test]
fn unplugged_and_plugged_in_again_it_says_what_was_lost() {
    let sent = counts(24);
    let board = Board::default();
    let socket = Socket::new();
    let mut line = Some(socket.plug(board.plug()));
    let mut session = session(&socket.path);
    let mut heard = Heard::default();
    let mut hear = |heard: &mut Heard| {
        while let Some(item) = session.next(Duration::from_millis(1)).expect("no fault") {
            heard.take(item, &sent, 0);
        }
    };
    plugged(&line).play(&board, &sent[..6000], || hear(&mut heard));
    until("what is on its way", || {
        hear(&mut heard);
        heard.next >= Some(5950)
    });
    let before = heard.samples;
    let missed = heard.missing;
    assert!(before + missed > 5000, "{before} {missed}");

    // Pulled out: it goes on measuring, and a window or two go by.
    drop(line.take());
    until("it is gone", || {
        hear(&mut heard);
        heard.has(|item| matches!(item, Item::Disconnected { .. }))
    });
    board.samples(&sent[6000..14_000]);
    hear(&mut heard);
    assert!(heard.samples <= before + 500, "what was on its way");
    line = Some(socket.plug(board.plug()));
    let devices = |heard: &Heard| {
        heard.items.iter().filter(|item| matches!(item, Item::Device { .. })).count()
    };
    until("it is found", || {
        hear(&mut heard);
        devices(&heard) == 2
    });
    plugged(&line).play(&board, &sent[14_000..], || hear(&mut heard));
    until("what is on its way", || {
        hear(&mut heard);
        heard.next >= Some(23_950)
    });
    assert!(heard.samples > before + 1000, "{}", heard.samples);
    assert!(heard.missing >= missed + 8000, "{}", heard.missing);
    let first = heard.items.iter().find(|item| matches!(item, Item::Samples { .. })).map(Item::at);
    assert_eq!(heard.next, first.map(|first| first + heard.samples + heard.missing));
    assert!(!heard.has(|item| matches!(item, Item::Restarted { .. } | Item::EventsLost { .. })));
    // The windows that went by were kept, and asked for.
    let windows: Vec<u16> = (heard.items.iter())
        .filter_map(|item| match item {
            Item::Event { event: Event::Window(window), .. } => Some(window.window),
            _ => None,
        })
        .collect();
    assert!(windows.len() > 3, "{windows:?}");
    assert_eq!(windows, (0..windows.len() as u16).collect::<Vec<_>>());

    // Pulled out and without power: it counts from zero.
    drop(line.take());
    board.restart();
    let line = socket.plug(board.plug());
    let known = heard.items.len();
    let mut after = Heard::default();
    let mut hear = |after: &mut Heard| {
        while let Some(item) = session.next(Duration::from_millis(1)).expect("no fault") {
            match &item {
                Item::Restarted { .. } => after.next = None,
                Item::Samples { yaw_deg, .. } => after.samples += yaw_deg.len() as u64,
                _ => {}
            }
            after.items.push(item);
        }
    };
    until("it is found", || {
        hear(&mut after);
        after.has(|item| matches!(item, Item::Restarted { .. }))
    });
    line.play(&board, &sent[..4000], || hear(&mut after));
    until("what is on its way", || {
        hear(&mut after);
        after.samples > 1000
    });
    assert!(known > 0 && after.samples > 1000, "{}", after.samples);
    assert!(after.has(|item| matches!(item, Item::Restarted { .. })));
    let mut numbers =
        after.items.iter().filter(|i| matches!(i, Item::Samples { .. })).map(Item::at);
    let first = numbers.next().expect("samples");
    assert!(first >= heard.next.expect("samples before"), "time goes on: {first}");
    assert!(numbers.try_fold(first, |a, b| (b > a).then_some(b)).is_some());
}

#[test]
fn a_board_that_comes_back_under_another_path_is_followed_there_and_no_other_is() {
    let sent = counts(20);
    let (ours, other) = (Board::default(), Board::default());
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let ports = Arc::new(Mutex::new(Vec::<PortInfo>::new()));
    let plug = |board: &Board, name: &str, number: &str| {
        let line = board.plug();
        let _ = std::fs::remove_file(path(name));
        symlink(line.path(), path(name)).expect("a link");
        let serial_number = Some(number.to_owned());
        let usb = UsbId { vid: 0x0483, pid: 0x374b, serial_number, interface: Some(2) };
        let path = path(name).display().to_string();
        let port = PortInfo { path, description: String::new(), usb: Some(usb) };
        ports.lock().expect("ports").push(port);
        line
    };
    let pull = |line: Line, name: &str| {
        drop(line);
        std::fs::remove_file(path(name)).expect("a link");
        ports.lock().expect("ports").retain(|port| !port.path.ends_with(name));
    };
    let line = plug(&ours, "ttyACM0", "A1");
    let list = {
        let ports = ports.clone();
        Box::new(move || Ok(ports.lock().expect("ports").clone()))
    };
    let bench = Bench::on_port(&path("ttyACM0").display().to_string(), list).expect("a device");
    let mut session = Session::new(bench, Follow::Trace).expect("a device");
    let mut heard = Heard::default();
    let mut hear = |heard: &mut Heard| {
        while let Some(item) = session.next(Duration::from_millis(1)).expect("no fault") {
            heard.take(item, &sent, 0);
        }
    };
    line.play(&ours, &sent[..4000], || hear(&mut heard));
    until("what is on its way", || {
        hear(&mut heard);
        heard.next >= Some(3950)
    });
    assert!(heard.samples > 3000, "{}", heard.samples);

    // Another board takes its place: it is not followed.
    pull(line, "ttyACM0");
    let line = plug(&other, "ttyACM0", "B2");
    let before = heard.samples;
    until("ours is gone", || {
        hear(&mut heard);
        heard.has(|item| matches!(item, Item::Disconnected { .. }))
    });
    ours.samples(&sent[4000..8000]);
    // Time enough to look for it a few times: were the other one taken for it, this would show it.
    for _ in 0..1000 {
        hear(&mut heard);
    }
    assert!(heard.samples <= before + 500, "what was on its way");
    assert_eq!(heard.items.iter().filter(|i| matches!(i, Item::Device { .. })).count(), 1);

    // Ours is there under another path.
    let plugged = plug(&ours, "ttyACM1", "A1");
    until("ours is found", || {
        hear(&mut heard);
        heard.has(|item| matches!(item, Item::Back { .. }))
    });
    plugged.play(&ours, &sent[8000..], || hear(&mut heard));
    until("what is on its way", || {
        hear(&mut heard);
        heard.next >= Some(19_950)
    });
    let texts: Vec<String> = heard.items.iter().filter_map(|item| item.to_text("")).collect();
    let back: Vec<&String> = texts.iter().filter(|t| t.contains("back, now on")).collect();
    let (old, new) = (path("ttyACM0"), path("ttyACM1"));
    let said = format!("the device is back, now on {}; it was on {}", new.display(), old.display());
    assert_eq!(back, [&said]);
    assert!(
        heard.has(|i| matches!(i, Item::Device { port, .. } if *port == new.display().to_string()))
    );
    assert!(heard.samples > before + 1000, "{}", heard.samples);
    assert!(heard.missing >= 4000, "{}", heard.missing);
    assert!(!heard.has(|item| matches!(item, Item::Restarted { .. })));
    let back = heard.items.iter().find(|item| matches!(item, Item::Back { .. })).expect("it");
    assert_eq!(Item::from_json(&back.to_json()).as_ref(), Some(back));
    pull(line, "ttyACM0");
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
    let mut said = |rig| {
        // One that is going on ends under the rig it began with.
        board.tell(&Request::EndRelease { after_samples: 0 });
        session.set_condition(of_rig(rig)).expect("a condition");
        let mut items = Vec::new();
        // Longer than until the device is asked again.
        let until = Instant::now() + Duration::from_millis(1500);
        while Instant::now() < until {
            items.extend(session.next(Duration::from_millis(10)).expect("no fault"));
        }
        items.retain(|item| matches!(item, Item::Forgotten { .. }));
        items
    };
    assert_eq!(said(7), []);
    let items = said(8);
    let [Item::Forgotten { releases, why: Forgotten::Rig, .. }] = items[..] else {
        panic!("{items:?}")
    };
    assert_eq!(releases, learnt.releases);
    assert_eq!(Item::from_json(&items[0].to_json()).as_ref(), Some(&items[0]));
    let text = items[0].to_text("").expect("it is told");
    assert!(text.ends_with(" of its network's error: another rig is mounted"), "{text}");
    assert_eq!(said(9), [], "there was nothing left to forget");
}
