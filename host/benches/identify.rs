//! Time of one identification, and time and memory of ten thousand.
//!
//! `cargo bench -p yawrig --bench identify [-- RECORDS]`; 10,000 records take 700 MB of the temporary folder.
//! The records are those of the virtual rig; the whole `yawrig identify --out` is timed, reading included,
//! and its peak memory (VmHWM) is read while it runs.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use yawrig_core::identify::samples::Samples;
use yawrig_core::identify::{identify, least_squares, Method, Settings};
use yawrig_core::record::Record;
use yawrig_records::write_samples;
use yawrig_rig::{End, Motion, Sensor, Start};
use yawrig_shared::modal::Modal;

fn release(wn: f64, zeta: f64, sensor: &Sensor, start: &Start, seed: u64) -> Vec<(f64, f64)> {
    let truth = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
    yawrig_rig::Samples::new(Motion::new(&truth), start, sensor, seed)
        .map(|s| (s.time_s, s.yaw_deg))
        .collect()
}

fn best_of(repeats: usize, mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..repeats).map(time).fold(f64::INFINITY, f64::min)
}

/// One record of 25 s at 1 kHz, from 10 deg to 1 deg.
fn one() {
    let sensor = Sensor { rate_hz: 1000.0, noise_deg: 0.05, ..Sensor::default() };
    let start = Start { amplitude_deg: 10.0, hold_s: 0.0, end: End::After(25.0) };
    let (time_s, yaw_deg): (Vec<f64>, Vec<f64>) =
        release(7.5, 0.012, &sensor, &start, 1).into_iter().unzip();
    let record = Record::new(PathBuf::from("one"), time_s, yaw_deg);
    println!("one record, {} samples, one core:", record.len());
    let fit = best_of(50, || {
        let samples = Samples::new(&record.time_s, &record.yaw_deg);
        let found = least_squares::fit_mode(&samples.all(), 7.7).unwrap();
        black_box(found.uncertainty(&samples.all(), yawrig_core::record::Derivative::None));
    });
    println!("  fit with its start and uncertainty        {:6.2} ms", 1e3 * fit);
    for (name, methods) in [
        ("release, windows, least squares", &[Method::LeastSquares][..]),
        ("the same and the conventional method", &[Method::LeastSquares, Method::Conventional]),
    ] {
        let settings = Settings::default();
        let whole = best_of(50, || {
            black_box(identify(&record, methods, &settings)).unwrap();
        });
        println!("  {name:<41} {:6.2} ms", 1e3 * whole);
    }
}

fn write(folder: &Path, count: usize) -> Vec<PathBuf> {
    let sensor = Sensor { rate_hz: 250.0, ..Sensor::default() };
    let start = Start { amplitude_deg: 15.0, hold_s: 1.0, end: End::After(16.0) };
    (0..count)
        .map(|k| {
            let share = k as f64 / count as f64;
            let file = folder.join(format!("{k:05}.csv"));
            let (wn, zeta) = (4.0 + 22.0 * share, 0.05 - 0.04 * share);
            let samples = release(wn, zeta, &sensor, &start, k as u64);
            write_samples(&file, samples.into_iter()).unwrap();
            file
        })
        .collect()
}

/// Runs `identify` over `files`: seconds and peak memory in MiB.
fn run(files: &[PathBuf], out: &Path) -> (f64, f64) {
    let begin = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_yawrig"))
        .arg("identify")
        .arg("--out")
        .arg(out)
        .args(files)
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0.0_f64;
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find(|l| l.starts_with("VmHWM:")).unwrap_or("");
        let kib: f64 = line.split_whitespace().nth(1).map_or(0.0, |n| n.parse().unwrap());
        peak = peak.max(kib / 1024.0);
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(child.wait().unwrap().success());
    (begin.elapsed().as_secs_f64(), peak)
}

fn main() {
    one();
    let count = std::env::args().filter_map(|a| a.parse().ok()).next().unwrap_or(10_000);
    let folder = tempfile::tempdir().unwrap();
    eprintln!("writing {count} records");
    let files = write(folder.path(), count);
    println!("many records of 17 s at 250 Hz, all cores:");
    println!("  records   seconds   ms/record   peak MiB");
    for part in [8, 4, 2, 1] {
        let some = &files[..count / part];
        let out = folder.path().join(format!("{part}.jsonl"));
        let (seconds, peak) = run(some, &out);
        let lines = std::fs::read_to_string(&out).unwrap().lines().count();
        assert_eq!(lines, some.len());
        println!(
            "  {:>7} {seconds:>9.2} {:>11.3} {peak:>10.1}",
            some.len(),
            1e3 * seconds / some.len() as f64
        );
    }
    let (again, _) = run(&files, &folder.path().join("1.jsonl"));
    println!("  all of them again, nothing left to do: {again:.2} s");
}
