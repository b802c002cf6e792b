//! Ctrl-C.

use nix::fcntl::{fcntl, FcntlArg};
use nix::sys::signal::Signal;
use std::fs::File;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::time::Duration;
use yawrig_shared::blob;
use yawrig_tests::process::{yawrig, Ended, Running};

fn interrupted(mut running: Running) -> Ended {
    running.catches_interrupts();
    running.signal(Signal::SIGINT);
    running.ends().exits(130).says("interrupted")
}

/// Names of what is in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().expect("a folder").flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn a_training_ends_at_once_and_leaves_a_network_or_nothing() {
    // At once, and well into its epochs.
    for steps in [0, 3] {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("n.yrn");
        let mut running =
            yawrig("train --json --samples 20000 --restarts 1000 --epochs 1000000 --out")
                .and(&file)
                .drawing()
                .start();
        running.catches_interrupts();
        if steps > 0 {
            running.draws_step(steps);
        }
        let ended = interrupted(running);
        let names = names(folder.path());
        match std::fs::read(&file) {
            Ok(bytes) => {
                let mut names = names;
                names.sort();
                assert_eq!(names, ["n.yrn", "n.yrn.unfinished"]);
                blob::decode(&bytes).expect("a whole network");
                assert_eq!(ended.json()["stopped"], "interrupted");
            }
            Err(_) => assert!(names.is_empty() && steps == 0, "{names:?}"),
        }
    }
}

#[test]
fn half_a_campaign_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let command = "simulate --seconds 3000 --campaign rig/monday";
    let mut running = yawrig(command).in_folder(folder.path()).start();
    running.says("writing 32 records");
    while !folder.path().join("rig/monday/K1-mid-off.csv").exists() {
        assert!(running.runs(), "it writes one after the other");
        std::thread::sleep(Duration::from_millis(5));
    }
    interrupted(running);
    assert!(!folder.path().join("rig/monday").exists());
}

#[test]
fn a_training_interrupted_before_its_first_epoch_leaves_an_older_network_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("n.yrn");
    let older = yawrig_tests::networks::sound();
    std::fs::write(&file, &older).expect("room for it");
    interrupted(yawrig("train --samples 3000 --epochs 1000000 --out").and(&file).start());
    assert_eq!(names(folder.path()), ["n.yrn"]);
    assert_eq!(std::fs::read(&file).expect("the older one"), older);
}

#[test]
fn an_interrupted_training_lies_beside_an_older_network() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("n.yrn");
    let older = yawrig_tests::networks::sound();
    std::fs::write(&file, &older).expect("room for it");
    let train = "train --json --samples 300 --epochs 1000000 --restarts 1000 --out";
    let mut running = yawrig(train).and(&file).drawing().start();
    running.draws_step(3);
    let ended = interrupted(running);
    assert_eq!(std::fs::read(&file).expect("the older one"), older);
    let partial = folder.path().join("n.yrn.partial");
    blob::decode(&std::fs::read(&partial).expect("the new one")).expect("a whole network");
    assert_eq!(ended.json()["network"], partial.display().to_string());
}

#[test]
fn a_record_is_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("r.csv");
    // A day at 10 kHz: nobody waits for that.
    let long =
        "simulate --natural-frequency 7 --damping 0.01 --seconds 86400 --rate-hz 10000 --out";
    let mut running = yawrig(long).and(&file).start();
    running.catches_interrupts();
    // Wherever it is by then.
    std::thread::sleep(Duration::from_millis(300));
    interrupted(running);
    assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
}

#[test]
fn monitor_and_demo_end_at_once() {
    let mut monitor = yawrig("monitor --device emulated --speed 20").start();
    monitor.prints("window");
    interrupted(monitor);

    // While it trains, and while it releases.
    interrupted(yawrig("demo --no-report").start());
    // Its table is more than its stdout takes, of which nobody reads the rest before the signal has come.
    let (mut ours, theirs) = nearly_full();
    let mut demo = yawrig("demo --no-report").printing_to(theirs).start();
    let mut table = String::new();
    while !table.contains("K1 mid") {
        let mut byte = [0];
        ours.read_exact(&mut byte).expect("it prints");
        table.push(char::from(byte[0]));
    }
    demo.catches_interrupts();
    demo.signal(Signal::SIGINT);
    ours.read_to_string(&mut table).expect("its end");
    demo.ends().exits(130).says("interrupted");
    assert!(!table.contains("K8 front wind on"), "{table}");
}

/// A pipe that takes a kilobyte, and no more before all that is in it is read.
fn nearly_full() -> (File, OwnedFd) {
    let (ours, theirs) = nix::unistd::pipe().expect("a pipe");
    let room = fcntl(&theirs, FcntlArg::F_SETPIPE_SZ(4096)).expect("a small one");
    let full = vec![b'\n'; room as usize - 1024];
    nix::unistd::write(&theirs, &full).expect("room");
    (ours.into(), theirs)
}

#[test]
fn a_follower_of_another_device_ends_and_leaves_it_be() {
    let (mut swinging, path) = crate::shells::swinging();
    let mut follower = yawrig("monitor --device").and(&path).start();
    follower.prints("window");
    interrupted(follower);
    assert!(swinging.runs());
    crate::shells::device(&path);
}

#[test]
fn waiting_for_a_silent_device_can_be_interrupted() {
    let line = yawrig_tests::line::Line::new(|_| Some(Vec::new()));
    interrupted(yawrig("device --device").and(line.path()).start());
}

#[test]
fn waiting_for_a_record_can_be_interrupted() {
    // Nobody ever writes to either.
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("r.csv");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
    interrupted(yawrig("identify").and(&pipe).start());
    let (waiting, _stdin) = yawrig("diagnose -").typing();
    interrupted(waiting.start());
}

#[test]
fn termination_and_hangup_end_it_as_ctrl_c_does() {
    for signal in [Signal::SIGTERM, Signal::SIGHUP] {
        let mut monitor = yawrig("monitor --device emulated --speed 20").start();
        monitor.prints("window");
        monitor.signal(signal);
        monitor.ends().exits(130);
    }
}
