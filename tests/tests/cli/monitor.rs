//! `monitor --record` and `--replay`.

use nix::sys::signal::Signal;
use std::io::Write;
use std::path::{Path, PathBuf};
use yawrig_tests::process::yawrig;

fn with_ending(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = folder.read_dir().expect("a folder").flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> =
        entries.filter(|file| file.to_string_lossy().ends_with(ending)).collect();
    files.sort();
    files
}

fn rows(file: &Path) -> usize {
    std::fs::read_to_string(file).expect("a trace").lines().count() - 1
}

#[test]
fn a_session_is_recorded_with_marks_and_shown_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let (monitor, mut typed) = yawrig("monitor --speed 20 --record session.csv").typing();
    let mut monitor = monitor.in_folder(folder.path()).start();
    monitor.prints("window");
    writeln!(typed, "tapped the model").expect("it listens");
    monitor.says("tapped the model");
    // However late that was, it goes on until two releases are kept.
    monitor.says("release 1 is kept");
    monitor.signal(Signal::SIGINT);
    let ended = monitor.ends().exits(130);
    let ended = ended.says("none missing").says("session-release-000.csv");
    let trace = folder.path().join("session.csv");
    assert!(rows(&trace) > 20_000, "{}", ended.report());
    assert!(with_ending(folder.path(), ".partial").is_empty());

    // Each release is a record as it is.
    let releases = with_ending(folder.path(), "-release-000.csv");
    let object = yawrig("identify --json").and(&releases[0]).run().exits(0).json();
    assert!(object["records"][0]["estimates"][0]["natural_frequency_rad_s"]["value"].is_f64());

    // Shown again: the same lines.
    let again = yawrig("monitor --speed 1e6 --replay session").in_folder(folder.path());
    let again = again.run().exits(0).says("tapped the model");
    assert_eq!(again.stdout, ended.stdout);
    let lines = yawrig("monitor --speed 1e6 --jsonl --replay").and(folder.path()).run().exits(0);
    let lines = lines.json_lines();
    let releases = lines.iter().filter(|line| line["event"] == "release").count();
    let is_release = |line: &&str| {
        line.starts_with("release ") && line.contains(": wn ") && !line.contains("refined")
    };
    let shown = ended.stdout.lines().filter(is_release).count();
    assert_eq!(releases, shown, "{}", ended.report());
    assert!(releases >= 2);
    assert!(lines.iter().any(|line| line["event"] == "mark" && line["text"] == "tapped the model"));

    // It is never written over.
    let again = yawrig("monitor --speed 20 --record session.csv").in_folder(folder.path());
    again.run().exits(3).helps().says("is there already");
}

#[test]
fn recording_is_ended_and_begun_by_typing() {
    let folder = tempfile::tempdir().expect("a folder");
    let (monitor, mut typed) = yawrig("monitor --speed 20 --record").and(folder.path()).typing();
    let mut monitor = monitor.start();
    monitor.prints("window");
    writeln!(typed, "/stop").expect("it listens");
    monitor.says("none missing");
    assert_eq!(with_ending(folder.path(), ".csv").len(), 1);
    writeln!(typed, "/start").expect("it listens");
    writeln!(typed, "the second one").expect("it listens");
    monitor.says("the second one");
    monitor.catches_interrupts();
    monitor.signal(Signal::SIGINT);
    monitor.ends().exits(130).says("none missing");
    assert_eq!(
        with_ending(folder.path(), "Z.csv").len() + with_ending(folder.path(), "-2.csv").len(),
        2
    );
    assert!(with_ending(folder.path(), ".partial").is_empty());
}

#[test]
fn a_session_that_was_killed_is_kept_and_can_be_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let command = yawrig("monitor --speed 20 --record s.csv").in_folder(folder.path());
    let mut monitor = command.start();
    monitor.prints("release 0:");
    monitor.says("release 0 is kept");
    monitor.signal(Signal::SIGKILL);
    monitor.ends();
    let partial = folder.path().join("s.csv.partial");
    assert!(rows(&partial) > 10_000);
    yawrig("identify --json").and(&partial).run().exits(0);
    let again = yawrig("monitor --speed 1e6 --replay s.csv.partial").in_folder(folder.path());
    let again = again.run().exits(0).says("never ended");
    assert!(again.stdout.contains("release 0:"), "{}", again.report());
    yawrig("monitor --replay nothing").in_folder(folder.path()).run().exits(3).helps();
}

#[test]
fn the_range_of_amplitudes_is_set_on_the_live_device() {
    let lines = yawrig("monitor --speed 300 --releases 1 --from-deg 6 --to-deg 3 --jsonl");
    let lines = lines.run().exits(0).json_lines();
    let windows: Vec<f64> = lines
        .iter()
        .filter(|line| line["event"] == "window")
        .map(|line| line["amplitude_deg"].as_f64().expect("an amplitude"))
        .collect();
    assert!(!windows.is_empty());
    assert!(windows.iter().all(|amplitude| (3.0..=6.0).contains(amplitude)), "{windows:?}");
    // Against what the device has: 1 deg.
    let refused = yawrig("monitor --from-deg 0.5").run().exits(2).helps();
    refused.says("from 0.5 deg down to 1 deg");
    yawrig("monitor --to-deg nan").run().exits(2).helps().says("--to-deg");
}

/// A board at a port that it can be pulled from; what monitors it is ended by what is given, or by Ctrl-C.
fn pulled_and_never_back(arguments: &str) -> yawrig_tests::process::Ended {
    let folder = tempfile::tempdir().expect("a folder");
    let line = yawrig_tests::line::Board::default().plug();
    let port = folder.path().join("ttyBOARD");
    std::os::unix::fs::symlink(line.path(), &port).expect("a link");
    let mut monitor = yawrig("monitor --record s.csv --device").and(&port);
    for argument in arguments.split_whitespace() {
        monitor = monitor.and(argument);
    }
    let mut monitor = monitor.in_folder(folder.path()).start();
    monitor.says("recording to");
    drop(line);
    monitor.says("is gone");
    if arguments.is_empty() {
        monitor.catches_interrupts();
        monitor.signal(Signal::SIGINT);
    }
    let ended = monitor.ends();
    assert!(folder.path().join("s.csv").exists(), "{}", ended.report());
    ended
}

#[test]
fn a_device_that_does_not_come_back_is_lost_however_the_waiting_ends() {
    for arguments in ["", "--seconds 4", "--seconds 4 --releases 3"] {
        let ended = pulled_and_never_back(arguments).exits(4).helps();
        ended.says("was unplugged and has not come back");
    }
}
