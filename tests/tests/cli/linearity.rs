//! A table for the converter, from records to the device and back.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::path::Path;
use yawrig_shared::wire::Request;
use yawrig_tests::converter::{record, settings, Converter, Release, DEG_PER_COUNT};
use yawrig_tests::line::Board;
use yawrig_tests::process::yawrig;

/// Releases through a chip, as files.
fn write(folder: &Path, count: u64) -> String {
    let converter = Converter::chip(3);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut names = Vec::new();
    for seed in 0..count {
        // Short ones.
        let release = Release { wn: 12.0, zeta: 0.02, ..Release::random(1480.0, &mut random) };
        let record = record("r", &release.counts(&converter, seed));
        let rows = record.time_s.iter().zip(&record.yaw_deg);
        let text: String = rows.map(|(time_s, deg)| format!("{time_s:.3},{deg}\n")).collect();
        let name = format!("release-{seed}.csv");
        std::fs::write(folder.join(&name), format!("time_s,yaw_deg\n{text}")).expect("room for it");
        names.push(name);
    }
    names.join(" ")
}

#[test]
fn a_device_learns_its_converter_keeps_it_and_forgets_it_when_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let records = write(folder, 4);
    let board = Board::default();
    let on_it = |arguments: &str| {
        let line = board.plug();
        yawrig(arguments).and("--device").and(line.path()).in_folder(folder).run()
    };
    let none = on_it("device --json").exits(0).json();
    assert!(none["linearity"].is_null() && none["linearity_absent"].is_null(), "{none}");
    on_it("device linearity release-0.csv release-1.csv").exits(2).says("too few").helps();
    let twice = format!("device linearity {records} ./release-2.csv");
    on_it(&twice).exits(2).says("release-2.csv and ./release-2.csv are the same release").helps();
    let twice = format!("device linearity {records} release-2.csv");
    on_it(&twice).exits(2).says("release-2.csv is given twice").helps();
    // Its default is another potentiometer.
    on_it(&format!("device linearity {records}")).exits(3).says("deg a count").helps();
    board.tell(&Request::Configure(settings()));

    let learned = on_it(&format!("device linearity {records} --json")).exits(0).json();
    assert_eq!(learned["linearity"]["learned_from"], 4);
    let error = &learned["learned"]["damping_error"];
    let (value, u) = (error["value"].as_f64().expect("one"), error["u"].as_f64().expect("one"));
    assert!(value.abs() > 20.0 * u, "{learned}");
    for _ in 0..2 {
        let has = on_it("device --json").exits(0).json();
        assert_eq!(has["linearity"], learned["linearity"]);
        let codes = has["linearity"]["largest_codes"].as_f64().expect("a number");
        assert!((2.0..16.0).contains(&codes), "{has}");
        let shown = on_it("device").exits(0);
        assert!(shown.stdout.contains("from 4 releases"), "{}", shown.report());
        board.restart();
    }
    on_it(&format!("device linearity {records}")).exits(2).says("has a table already").helps();
    let forgotten = on_it("device linearity --forget").exits(0);
    assert!(forgotten.stdout.contains("not corrected"), "{}", forgotten.report());
    assert!(on_it("device --json").exits(0).json()["linearity"].is_null());

    // The scale may be said, too; and a locked device takes none.
    let said = on_it(&format!("device linearity {records} --travel-deg 340")).exits(0);
    assert!(said.stdout.contains("makes damping ratios"), "{}", said.report());
    assert!(said.stdout.contains("stands still"), "{}", said.report());
    yawrig("keygen key").in_folder(folder).run().exits(0);
    on_it("device lock --key key --yes").exits(0);
    on_it("device linearity --forget").exits(5).says("it is locked").helps();
    assert_eq!(on_it("device linearity --json").exits(0).json()["linearity"]["learned_from"], 4);
}

/// The same chip turned slowly against a reference, 18 deg to either side of where the releases rest.
fn swept(folder: &Path) {
    let converter = Converter::chip(3);
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut text = "reference_deg,yaw_deg\n".to_owned();
    for k in -1800..=1800 {
        let angle_deg = f64::from(k) * 0.01;
        let conversion = |_| {
            let noise: f64 = StandardNormal.sample(&mut random);
            converter.read(1480.0 + angle_deg / (16.0 * DEG_PER_COUNT) + noise)
        };
        let counts: u16 = (0..16).map(conversion).sum();
        let reading = record("r", &[counts]).yaw_deg[0];
        // The reference has a zero of its own.
        text += &format!("{:.3},{reading}\n", angle_deg + 7.0);
    }
    std::fs::write(folder.join("sweep.csv"), text).expect("room for it");
}

/// A sweep says of the converter what releases say: the same error of a damping ratio.
#[test]
fn a_sweep_against_a_reference_is_a_table_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let records = write(folder, 8);
    swept(folder);
    let board = Board::default();
    board.tell(&Request::Configure(settings()));
    let on_it = |arguments: &str| {
        let line = board.plug();
        yawrig(arguments).and("--device").and(line.path()).in_folder(folder).run()
    };
    let error = |arguments: &str| {
        let learned = on_it(&format!("{arguments} --json")).exits(0).json();
        on_it("device linearity --forget").exits(0);
        let error = &learned["learned"]["damping_error"];
        let number = |name: &str| error[name].as_f64().expect("a number");
        (number("value"), number("u"), learned)
    };
    let (by_sweep, u, learned) = error("device linearity --sweep sweep.csv");
    let (by_releases, u_releases, _) = error(&format!("device linearity {records}"));
    println!("{by_sweep} +- {u}, {by_releases} +- {u_releases}");
    assert!((by_sweep - by_releases).abs() < 3.0 * u.hypot(u_releases), "{learned}");
    assert!(by_sweep.abs() > 10.0 * u, "{learned}");
    assert_eq!(learned["linearity"]["by"], "sweep");
    let gain = learned["learned"]["gain"].as_f64().expect("a number");
    // The wide code is 8 codes that are not read, of 430.
    assert!((gain - 1.02).abs() < 8e-3, "{gain}");

    let said = on_it("device linearity --sweep sweep.csv").exits(0);
    assert!(said.stdout.contains("from a sweep"), "{}", said.report());
    on_it("device linearity --sweep sweep.csv").exits(2).says("has a table already").helps();
    on_it("device linearity --forget").exits(0);
    let wrong = |text: &str, exit: i32, says: &str| {
        std::fs::write(folder.join("wrong.csv"), text).expect("room for it");
        on_it("device linearity --sweep wrong.csv").exits(exit).says(says).helps();
    };
    on_it("device linearity --sweep none.csv").exits(3).says("none.csv").helps();
    wrong("yaw_deg,angle\n1,2\n", 3, "wrong.csv, line 1: no column reference_deg");
    wrong("yaw_deg,reference_deg\n1,2\n1,x\n", 3, "wrong.csv, line 3: \"x\" is no angle in deg");
    wrong("yaw_deg,reference_deg\n", 3, "wrong.csv has no row");
    wrong("yaw_deg,reference_deg\n1,2\n2,3\n", 2, "2 rows are too few for this sweep: 32 at least");
    let still: String = (0..100).map(|k| format!("{},3\n", 0.1 * f64::from(k))).collect();
    wrong(&format!("yaw_deg,reference_deg\n{still}"), 3, "the angle does not follow the reading");
    let sweep = std::fs::read_to_string(folder.join("sweep.csv")).expect("the sweep");
    let in_rad = |row: &str| {
        let (angle, reading) = row.split_once(',').expect("two cells");
        format!("{:.6},{reading}\n", angle.parse::<f64>().expect("deg").to_radians())
    };
    let rad: String = sweep.lines().skip(1).map(in_rad).collect();
    wrong(
        &format!("reference_deg,yaw_deg\n{rad}"),
        3,
        "the angle rises by 0.018 for each deg read",
    );
    let beyond: String = (0..2000).map(|k| format!("{k},{k}\n")).collect();
    wrong(&format!("yaw_deg,reference_deg\n{beyond}"), 3, "no converter of this device gives");
}
