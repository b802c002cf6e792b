//! Ten thousand releases on one device, and fifty on QEMU's, two hundred at full size: none missed, no number
//! left out, the same answer to the same release early and late, memory as at the start.
//!
//! The firmware has no heap to lose: it is `no_std` without `alloc`, and its buffers are fields of one value.
//! What can grow here is the host's side, whose memory is looked at.

use rayon::prelude::*;
use std::process::Command;
use std::time::{Duration, Instant};
use yawrig_link::bench::{Bench, Target};
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::history::{BLOCK, LENGTH};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Event, ReleaseResult, WindowResult};
use yawrig_tests::desk::Desk;
use yawrig_tests::PATIENCE;

const DIFFERENT: usize = 50;
const HOLD_S: f64 = 1.6;
/// Blocks, and four of them where it is decided whether the model is held.
const ALIKE: usize = 4 * BLOCK;

/// Short releases, no two alike; each a multiple of the samples it looks at at once, so that all rounds lie
/// alike.
fn releases() -> Vec<Vec<u16>> {
    (0..DIFFERENT as u64)
        .into_par_iter()
        .map(|n| {
            let damping_ratio = 0.03 + 0.0007 * n as f64;
            let natural_frequency_rad_s = 12.0 + 0.28 * ((n * 7) % DIFFERENT as u64) as f64;
            let truth = Modal { natural_frequency_rad_s, damping_ratio };
            let side = if n % 3 == 0 { -1.0 } else { 1.0 };
            let start = Start {
                amplitude_deg: side * (10.0 + 0.1 * n as f64),
                hold_s: HOLD_S,
                end: End::Below { amplitude_deg: 0.45, at_most_s: 60.0 },
            };
            let sensor = Sensor {
                offset_deg: 0.1 * n as f64 - 2.0,
                noise_deg: 0.02 + 0.002 * n as f64,
                ..Sensor::default()
            };
            let samples = Samples::new(Motion::new(&truth), &start, &sensor, n);
            let mut counts: Vec<u16> = samples.filter_map(|s| s.counts).collect();
            counts.truncate(counts.len() / ALIKE * ALIKE);
            counts
        })
        .collect()
}

/// An answer without the moments it was found at.
#[derive(Clone, Debug, PartialEq)]
struct Answer {
    result: ReleaseResult,
    windows: Vec<WindowResult>,
}

fn answer(mut result: ReleaseResult, windows: &[WindowResult], begun: u32) -> Answer {
    result.release_sample = result.release_sample.wrapping_sub(begun);
    result.finished_sample = result.finished_sample.wrapping_sub(begun);
    result.release = 0;
    let windows = windows.iter().map(|window| WindowResult {
        release: 0,
        start_sample: window.start_sample.wrapping_sub(begun),
        end_sample: window.end_sample.wrapping_sub(begun),
        sent_sample: window.sent_sample.wrapping_sub(begun),
        ..*window
    });
    Answer { result, windows: windows.collect() }
}

/// Memory that this process has written to, KiB. (How much of its program is in memory is up to the kernel.)
fn written_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("this process");
    let line = status.lines().find(|line| line.starts_with("RssAnon:")).expect("its memory");
    line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).expect("a number")
}

/// Memory is that of a process: this test's again, in one that runs no other.
const ALONE: &str = "YAWRIG_TEST_SOAKS_ALONE";

#[test]
fn ten_thousand_releases_without_a_miss() {
    if std::env::var_os(ALONE).is_some() {
        return soak();
    }
    let output = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "soak::ten_thousand_releases_without_a_miss", "--nocapture"])
        .env(ALONE, "1")
        .output()
        .expect("this program again");
    let said = String::from_utf8_lossy(&output.stdout);
    print!("{said}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("10000 releases"), "{said}");
}

fn soak() {
    const ROUNDS: usize = 200;
    let releases = releases();
    let mut desk = Desk::default();
    // The first round begins without a history behind it; those after it begin alike.
    let mut settled: Vec<Answer> = Vec::new();
    let (mut found, mut events, mut samples, mut early_kib) = (0_u32, 0_u64, 0_u32, 0);
    for round in 0..ROUNDS {
        for (which, counts) in releases.iter().enumerate() {
            desk.play(counts.iter().copied());
            let last = desk.releases.len() - 1;
            assert_eq!(desk.releases.len(), 1, "round {round}, release {which}: {:?}", desk.phases);
            let result = desk.releases[last];
            assert!(result.windows > 0 && !result.flags.unusable(), "{round} {which}: {result:?}");
            assert_eq!(result.release, found, "round {round}, release {which}");
            let answer = answer(result, &desk.windows, samples);
            match settled.get(which) {
                Some(same) => assert_eq!(&answer, same, "round {round}, release {which}"),
                None if round > 0 => settled.push(answer),
                None => {}
            }
            for number in desk.numbers.drain(..) {
                assert_eq!(number, events as u16, "round {round}, release {which}");
                events += 1;
            }
            desk.releases.clear();
            desk.refined.clear();
            desk.windows.clear();
            desk.phases.clear();
            found += 1;
            samples = samples.wrapping_add(counts.len() as u32);
        }
        if round == ROUNDS / 10 {
            early_kib = written_kib();
        }
    }
    let late_kib = written_kib();
    println!(
        "{found} releases, {events} events, {samples} samples; memory {early_kib} KiB \
         after a tenth, {late_kib} KiB at the end"
    );
    assert!(events > 65_536, "event numbers have gone round");
    assert!(samples as usize > 100 * LENGTH, "the ring has gone round");
    // Less than a page for each hundred releases.
    assert!(late_kib <= early_kib + 256, "{early_kib} KiB, then {late_kib} KiB");
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn fifty_releases_on_qemu() {
    releases_on_qemu(1);
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn two_hundred_releases_on_qemu_at_full_size() {
    releases_on_qemu(4);
}

fn releases_on_qemu(rounds: usize) {
    let releases = releases();
    let mut bench = Bench::open(&Target::Qemu).expect("a board");
    let mut taken: Vec<(u16, Event)> = Vec::new();
    let listen = |bench: &mut Bench, taken: &mut Vec<(u16, Event)>, patience| {
        while let Some(numbered) = bench.client.next_event(patience).expect("a board that runs") {
            taken.push((numbered.number, numbered.event));
        }
    };
    let mut played = 0;
    for _ in 0..rounds {
        for counts in &releases {
            bench.play(counts).expect("a board that takes samples");
            played += counts.len() as u32;
            listen(&mut bench, &mut taken, Duration::ZERO);
        }
    }
    yawrig_link::replay::wait_for(&mut bench, played).expect("all samples");
    // Until it has nothing left to say.
    let until = Instant::now() + PATIENCE;
    let status = loop {
        listen(&mut bench, &mut taken, Duration::from_millis(20));
        let status = bench.client.status().expect("its state");
        if taken.len() as u16 == status.next_event {
            break status;
        }
        assert!(Instant::now() < until, "{} events came", taken.len());
    };
    let missed = bench.client.missed_events();
    assert_eq!((missed, status.lost_events, status.lost_samples), (0, 0, 0));
    for (n, (number, _)) in taken.iter().enumerate() {
        assert_eq!(*number, n as u16, "a number is missing");
    }
    assert_eq!(taken.len() as u16, status.next_event);

    // The same releases on the emulated device: the same bits, so early and late are alike here too.
    let mut desk = Desk::default();
    for counts in std::iter::repeat_n(&releases, rounds).flatten() {
        desk.play(counts.iter().copied());
    }
    let found: Vec<ReleaseResult> = taken
        .iter()
        .filter_map(|(_, event)| match event {
            Event::Release(result) => Some(*result),
            _ => None,
        })
        .collect();
    println!("{} releases on QEMU, {} events, {played} samples", found.len(), taken.len());
    assert_eq!(found.len(), rounds * DIFFERENT);
    assert_eq!(format!("{found:?}"), format!("{:?}", desk.releases));
}
