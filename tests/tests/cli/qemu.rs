//! The same commands on the ARM image, and that no QEMU is left behind.

use crate::demo::of_seed_1;
use nix::sys::signal::Signal;
use std::time::{Duration, Instant};
use yawrig_link::bench::{Bench, Target};
use yawrig_tests::process::{yawrig, Running};
use yawrig_tests::PATIENCE;

/// QEMUs whose image this is: those that the process `owner` started.
fn children(owner: u32) -> Vec<u32> {
    let processes = std::fs::read_dir("/proc").expect("/proc").flatten();
    processes
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .filter(|pid| stat(*pid).is_some_and(|(_, parent)| parent == owner))
        .collect()
}

/// State and parent of a process.
fn stat(pid: u32) -> Option<(String, u32)> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let mut fields = stat.rsplit(')').next()?.split_whitespace();
    Some((fields.next()?.to_owned(), fields.next()?.parse().ok()?))
}

/// Waits for the end of processes that got the signal to end.
fn gone(pids: &[u32]) {
    let patience = Instant::now() + PATIENCE;
    for pid in pids {
        while stat(*pid).is_some_and(|(state, _)| state != "Z") {
            assert!(Instant::now() < patience, "process {pid} is left behind");
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

/// A board that swings, and the process number of its QEMU.
fn swinging() -> (Running, Vec<u32>) {
    let mut monitor = yawrig("monitor --device qemu --speed 5").start();
    monitor.says("--device /dev/");
    let qemu = children(monitor.pid());
    assert_eq!(qemu.len(), 1, "{qemu:?}");
    (monitor, qemu)
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn the_main_job_gives_the_same_bits_on_the_arm_image_at_full_size() {
    let here = of_seed_1().json();
    let mut running = yawrig("demo --no-report --json --seed 1 --device qemu").start();
    running.says("--device /dev/");
    let qemu = children(running.pid());
    assert_eq!(qemu.len(), 1, "{qemu:?}");
    let there = running.ends().exits(0).json();
    gone(&qemu);
    assert_eq!(there["device"], "qemu");
    assert_eq!(here["releases"], there["releases"]);
    assert_eq!(here["points"], there["points"]);
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn another_shell_asks_and_writes_to_the_board() {
    // A board whose model stands still: a network is on trial for so many of its samples, not for so long a
    // time.
    let bench = Bench::open(&Target::Qemu).expect("a board");
    let path = bench.shared_path();
    let object = crate::shells::device(path);
    assert!(object["firmware"].as_str().is_some_and(|f| f.contains("mps2-an386")), "{object}");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("n.yrn");
    std::fs::write(&file, yawrig_tests::networks::another()).expect("room for it");
    yawrig("flash --device").and(path).and(&file).run().exits(0);
    let object = crate::shells::device(path);
    assert_eq!(object["slots"][0]["state"], "valid");
    assert_eq!(object["network"]["generation"], 1);
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn ctrl_c_takes_the_board_along() {
    let (monitor, qemu) = swinging();
    monitor.signal(Signal::SIGINT);
    monitor.ends().exits(130);
    gone(&qemu);
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn a_killed_program_takes_the_board_along() {
    let (monitor, qemu) = swinging();
    monitor.signal(Signal::SIGKILL);
    assert_eq!(monitor.ends().code, -9);
    gone(&qemu);
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn a_reader_that_goes_away_takes_the_board_along() {
    let command = yawrig("monitor --device qemu --speed 20");
    let mut monitor = command.start_with_short_reader(1);
    monitor.says("--device /dev/");
    let qemu = children(monitor.pid());
    monitor.ends().exits(0);
    gone(&qemu);
}
