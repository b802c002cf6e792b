//! `yawrig device log`: what a device kept while nobody listened.

use serde_json::Value;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{rig_id, Condition, Request};
use yawrig_tests::line::Board;
use yawrig_tests::process::yawrig;

/// A decay that is held for two seconds, at 1 kHz; the device's default scale.
fn counts() -> Vec<u16> {
    let (wn, zeta) = (8.0_f64, 0.04_f64);
    let wd = wn * (1.0 - zeta * zeta).sqrt();
    (0..12_000)
        .map(|k| {
            let t = f64::from(k - 2000).max(0.0) * 1e-3;
            let swing = (wd * t).cos() + zeta * wn / wd * (wd * t).sin();
            // A dither of a few counts: a reading that stands still is a sensor that is stuck.
            let dither = f64::from((k * 7919) % 11 - 5);
            (32_768.0 + 12.0 * (-zeta * wn * t).exp() * swing / 0.005 + dither).round() as u16
        })
        .collect()
}

fn events(log: &Value) -> Vec<&str> {
    let entries = log["entries"].as_array().expect("entries");
    entries.iter().map(|entry| entry["event"].as_str().expect("one")).collect()
}

#[test]
fn results_of_weeks_without_a_computer_are_read_out() {
    let board = Board::default();
    let wind = Wind { density_kg_m3: 1.2, speed_m_s: 12.5 };
    let model = Model { length_m: 0.625, frontal_area_m2: 0.036 };
    board.tell(&Request::Condition(Condition {
        rig: rig_id("K3", "mid"),
        wind,
        model,
        inertia_kg_m2: 0.0,
    }));
    // Nobody takes what it says.
    for _ in 0..20 {
        board.samples(&counts());
    }
    board.restart();
    board.samples(&counts());
    let on_it = |arguments: &str| {
        let line = board.plug();
        yawrig(arguments).and("--device").and(line.path()).run()
    };
    let log = on_it("device log --json").exits(0).json();
    assert_eq!((&log["made_room"], &log["unreadable"]), (&0.into(), &0.into()));
    let mut wanted = vec!["start", "condition"];
    (0..20).for_each(|_| wanted.extend(["release", "refined"]));
    wanted.extend(["start", "release", "refined"]);
    assert_eq!(events(&log), wanted);
    let entries = log["entries"].as_array().expect("entries");
    assert_eq!(entries[1]["wind_speed_m_s"], 12.5);
    for (index, entry) in entries.iter().enumerate() {
        assert_eq!(entry["number"], index + 1);
        assert_eq!(entry["run"], if index < 42 { 1 } else { 43 });
        // Of the run that goes on alone.
        assert_eq!(entry["ago_s"].is_null(), index < 42, "{entry}");
        assert!(entry["schema_version"].is_null(), "{entry}");
        if entry["event"] == "refined" {
            let zeta = &entry["damping_ratio"];
            let (value, u) = (zeta["value"].as_f64().unwrap(), zeta["u"].as_f64().unwrap());
            assert!((value - 0.04).abs() < 5.0 * u && u < 1e-4, "{entry}");
        }
    }
    let text = on_it("device log").exits(0);
    for said in ["run 1 begins", "wind 12.5 m/s from here on", "release 19 refined", "s ago"] {
        assert!(text.stdout.contains(said), "{said}: {}", text.report());
    }
    on_it("device log record.csv").exits(2).says("a potentiometer of its own").helps();
}

#[test]
fn an_emulated_device_shows_what_it_keeps_of_a_record() {
    let folder = tempfile::tempdir().expect("a folder");
    let of = |arguments: &str| yawrig(arguments).in_folder(folder.path()).run();
    let empty = of("device log").exits(0);
    assert!(empty.stdout.contains("begins"), "{}", empty.report());
    of("simulate --natural-frequency 8 --damping 0.02 --seed 1 --out r.csv").exits(0);
    let log = of("device log r.csv --json").exits(0).json();
    assert_eq!(events(&log), ["start", "release", "refined"]);
    assert!(log["entries"][2]["ago_s"].as_f64().is_some_and(|ago_s| ago_s >= 0.0), "{log}");
    of("device log none.csv").exits(3).says("none.csv").helps();
}
