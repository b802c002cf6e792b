//! A device unplugged, and plugged in again: at its port, after a power cut, under another path.

use crate::followed::{counts, session, until, Followed, Heard};
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use yawrig_link::bench::Bench;
use yawrig_link::live::item::Item;
use yawrig_link::live::session::{Follow, Session};
use yawrig_link::port::{PortInfo, UsbId};
use yawrig_shared::wire::Event;
use yawrig_tests::line::{Board, Line};

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

fn devices(heard: &Heard) -> usize {
    heard.items.iter().filter(|item| matches!(item, Item::Device { .. })).count()
}

fn is_gone(heard: &Heard) -> bool {
    heard.has(|item| matches!(item, Item::Disconnected { .. }))
}

#[test]
fn unplugged_and_plugged_in_again_it_says_what_was_lost() {
    let sent = counts(24);
    let board = Board::default();
    let socket = Socket::new();
    let line = socket.plug(board.plug());
    let mut followed = Followed::new(session(&socket.path), &sent);
    followed.play(&line, &board, 0..6000);
    let before = followed.heard.samples;
    let missed = followed.heard.missing;
    assert!(before + missed > 5000, "{before} {missed}");

    // Pulled out: it goes on measuring, and a window or two go by.
    drop(line);
    followed.hear_until("it is gone", is_gone);
    board.samples(&sent[6000..14_000]);
    followed.hear();
    assert!(followed.heard.samples <= before + 500, "what was on its way");
    let line = socket.plug(board.plug());
    followed.hear_until("it is found", |heard| devices(heard) == 2);
    followed.play(&line, &board, 14_000..24_000);
    let heard = &followed.heard;
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

    // Pulled out and without power.
    drop(line);
    board.restart();
    let line = socket.plug(board.plug());
    counts_from_zero(&line, &board, followed);
}

/// And time goes on.
fn counts_from_zero(line: &Line, board: &Board, followed: Followed) {
    let Followed { mut session, heard, sent } = followed;
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
    line.play(board, &sent[..4000], || hear(&mut after));
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
    let session = Session::new(bench, Follow::Trace).expect("a device");
    let mut followed = Followed::new(session, &sent);
    followed.play(&line, &ours, 0..4000);
    let before = followed.heard.samples;
    assert!(before > 3000, "{before}");

    // Another board takes its place: it is not followed.
    pull(line, "ttyACM0");
    let line = plug(&other, "ttyACM0", "B2");
    followed.hear_until("ours is gone", is_gone);
    ours.samples(&sent[4000..8000]);
    // Time enough to look for it a few times: were the other one taken for it, this would show it.
    for _ in 0..1000 {
        followed.hear();
    }
    assert!(followed.heard.samples <= before + 500, "what was on its way");
    assert_eq!(devices(&followed.heard), 1);

    // Ours is there under another path.
    let plugged = plug(&ours, "ttyACM1", "A1");
    followed.hear_until("ours is found", |heard| heard.has(|i| matches!(i, Item::Back { .. })));
    followed.play(&plugged, &ours, 8000..20_000);
    let heard = followed.heard;
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

/// Of two boards with one serial number the other is left when ours is pulled.
#[test]
fn a_board_with_a_twin_is_waited_for_where_it_was() {
    let sent = counts(12);
    let (ours, twin) = (Board::default(), Board::default());
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let plug = |board: &Board, name: &str| {
        let line = board.plug();
        let _ = std::fs::remove_file(path(name));
        symlink(line.path(), path(name)).expect("a link");
        line
    };
    let line = plug(&ours, "ttyACM0");
    let _twin = plug(&twin, "ttyACM1");
    let list = {
        let paths = ["ttyACM0", "ttyACM1"].map(path);
        let usb = UsbId {
            vid: 0x0483,
            pid: 0x374b,
            serial_number: Some("A1".to_owned()),
            interface: Some(2),
        };
        let port = move |path: &PathBuf| PortInfo {
            path: path.display().to_string(),
            description: String::new(),
            usb: Some(usb.clone()),
        };
        Box::new(move || Ok(paths.iter().filter(|path| path.exists()).map(&port).collect()))
    };
    let bench = Bench::on_port(&path("ttyACM0").display().to_string(), list).expect("a device");
    let session = Session::new(bench, Follow::Trace).expect("a device");
    let mut followed = Followed::new(session, &sent);
    followed.play(&line, &ours, 0..4000);
    drop(line);
    std::fs::remove_file(path("ttyACM0")).expect("a link");
    followed.hear_until("ours is gone", is_gone);
    twin.samples(&sent[..2000]);
    // Time enough to look for it a few times.
    for _ in 0..1000 {
        followed.hear();
    }
    assert_eq!(devices(&followed.heard), 1);
    assert!(followed.session.is_gone());
    let line = plug(&ours, "ttyACM0");
    followed.hear_until("ours is found", |heard| devices(heard) == 2);
    followed.play(&line, &ours, 4000..12_000);
}
