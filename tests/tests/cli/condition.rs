//! `monitor` under a condition and through a campaign: derivatives on screen, records and a `campaign.toml`.

use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::time::Instant;
use tempfile::TempDir;
use yawrig_rig::{Condition, Rig, Sensor, Spring, Start, SPRINGS};
use yawrig_shared::axis::Axis;
use yawrig_shared::wire::Settings;
use yawrig_tests::line::{Board, Line};
use yawrig_tests::process::yawrig;
use yawrig_tests::PATIENCE;

/// A folder with the plan of a whole campaign, `plan/campaign.toml`, and no record of it.
fn planned() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let command = "simulate --campaign plan --rate-hz 20";
    yawrig(command).in_folder(folder.path()).run().exits(0);
    for file in folder.path().join("plan").read_dir().expect("a folder").flatten() {
        if file.path().extension().is_some_and(|e| e == "csv") {
            std::fs::remove_file(file.path()).expect("a record");
        }
    }
    folder
}

fn derivatives(folder: &Path, campaign: &str) -> Value {
    let command = format!("derivatives {campaign} --json");
    yawrig(&command).in_folder(folder).run().exits(0).json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// What is at the front of a campaign's file, with these releases of the plan.
fn shortened(folder: &Path, keep: &[(&str, &str, &str)]) {
    let file = folder.join("plan/campaign.toml");
    let text = std::fs::read_to_string(&file).expect("a plan");
    let mut campaign: toml::Table = toml::from_str(&text).expect("TOML");
    let releases = campaign["release"].as_array_mut().expect("releases");
    releases.retain(|release| {
        let name = release["file"].as_str().expect("a name");
        keep.iter().any(|(spring, axis, wind)| name == format!("{spring}-{axis}-{wind}.csv"))
    });
    std::fs::write(file, toml::to_string(&campaign).expect("TOML")).expect("room");
}

#[test]
fn a_campaign_of_eight_springs_is_measured_with_its_derivatives_on_screen() {
    let folder = planned();
    let command = "monitor --campaign plan/campaign.toml --record out --speed 200 --jsonl";
    let ended = yawrig(command).in_folder(folder.path()).run().exits(0);
    let lines = ended.says("none missing").json_lines();

    // After each wind-on release, before anything else is released: its derivatives beside the truth.
    let rig = Rig::default();
    let (mut next, mut shown) = (Value::Null, 0);
    println!(
        "spring axis    Cn_beta        u    truth  miss %       Cn_r        u    truth  miss %"
    );
    for line in &lines {
        match line["event"].as_str() {
            Some("condition") => next = line.clone(),
            Some("refined") if next["wind_speed_m_s"] != 0.0 => {
                let spring = SPRINGS.into_iter().find(|s| s.name == next["spring"]).expect("one");
                let axis: Axis = next["axis"].as_str().expect("an axis").parse().expect("one");
                let truth = rig.derivatives(&spring, axis);
                let found = &line["derivatives"];
                let [(beta, beta_u), (r, r_u)] = ["cn_beta", "cn_r"]
                    .map(|name| (number(&found[name]), number(&found[format!("{name}_u")])));
                let miss = |found: f64, truth: f64| 100.0 * (found / truth - 1.0);
                println!(
                    "{:6} {:5} {beta:9.6} {beta_u:8.6} {:8.4} {:+7.3}  {r:9.6} {r_u:8.6} {:8.4} {:+7.3}",
                    spring.name, axis.name(), truth.cn_beta, miss(beta, truth.cn_beta),
                    truth.cn_r, miss(r, truth.cn_r),
                );
                // The inertia as the springs so far give it; by two springs it is known to 1e-5.
                let allowed = |u: f64, truth: f64| 4.0 * u + 5e-5 * truth.abs();
                assert!((beta - truth.cn_beta).abs() < allowed(beta_u, truth.cn_beta), "{line}");
                assert!((r - truth.cn_r).abs() < allowed(r_u, truth.cn_r), "{line}");
                shown += 1;
            }
            _ => {}
        }
    }
    assert_eq!(shown, 16);

    // The device's table at the end, and the one from what is left behind.
    let table = lines.iter().find(|line| line["event"] == "derivatives").expect("a table");
    let from_records = derivatives(folder.path(), "out/campaign.toml");
    assert_eq!(from_records["releases"].as_array().map(Vec::len), Some(32));
    for points in [&table["table"]["points"], &from_records["points"]] {
        let points = points.as_array().expect("points");
        assert_eq!(points.len(), 8);
        for (point, spring) in points.iter().zip(&SPRINGS) {
            let truth = rig.truth(spring);
            for (name, truth) in [
                ("cn_beta", truth.cn_beta),
                ("cn_r", truth.cn_r),
                ("cy_beta", truth.cy_beta),
                ("cy_r", truth.cy_r),
            ] {
                let [value, u] = ["value", "u"].map(|key| number(&point[name][key]));
                assert!((value - truth).abs() < 4.0 * u, "{} {name}: {value} {u}", spring.name);
            }
        }
    }
}

/// Holds the model on spring K3 at the middle axis, lets it go in this wind and leaves it until it has come
/// to rest.
fn let_go(line: &Line, board: &Board, wind_speed_m_s: f64) {
    let spring = Spring::named("K3").expect("one of the rig's");
    let condition = Condition { spring, axis: Axis::Mid, wind_speed_m_s };
    let release = Rig::default().release(&condition, &Start::default(), &Sensor::default(), 1);
    let samples = release.expect("a release").samples;
    line.play(board, &samples.filter_map(|s| s.counts).collect::<Vec<_>>(), || ());
}

/// The model rests, and the device goes on with its refined estimate.
fn at_rest_until(line: &Line, board: &Board, mut is_so: impl FnMut() -> bool) {
    let until = Instant::now() + PATIENCE;
    while !is_so() {
        assert!(Instant::now() < until, "it never comes");
        line.play(board, &[Settings::default().zero_counts; 100], || ());
    }
}

#[test]
fn a_campaign_is_shown_step_by_step_taken_back_and_gone_on_with() {
    let folder = planned();
    shortened(
        folder.path(),
        &[("K3", "mid", "off"), ("K3", "mid", "on"), ("K3", "front", "off"), ("K3", "front", "on")],
    );
    // A device whose model is let go here: what is typed comes while nothing is under way.
    let command = "monitor --campaign plan/campaign.toml --record out";
    let board = Board::default();
    let line = board.plug();
    let (monitor, mut typed) = yawrig(command).and("--device").and(line.path()).typing();
    let mut monitor = monitor.in_folder(folder.path()).start();
    assert_eq!(monitor.prints("next:"), "next: K3 mid, wind off (release 1 of 4)");
    let_go(&line, &board, 0.0);
    at_rest_until(&line, &board, || {
        monitor.has_printed("next: K3 mid, wind 10 m/s (release 2 of 4), Izz 0.1010")
    });
    let_go(&line, &board, 10.0);
    at_rest_until(&line, &board, || {
        monitor.has_printed("next: K3 front, wind off (release 3 of 4)")
    });
    monitor.prints("Cn_beta 0.53");
    writeln!(typed, "/back").expect("it listens");
    at_rest_until(&line, &board, || monitor.has_printed_times("next: K3 mid, wind 10 m/s", 2));
    let_go(&line, &board, 10.0);
    at_rest_until(&line, &board, || monitor.has_said("K3-mid-on-2.csv"));
    monitor.catches_interrupts();
    monitor.signal(nix::sys::signal::Signal::SIGINT);
    let ended = monitor.ends().exits(130);
    assert_eq!(ended.stdout.matches("next: K3 mid, wind 10 m/s").count(), 2, "{}", ended.report());

    // Another day: what has a record is not made again; the table holds both days' releases.
    let command = format!("{command} --speed 200");
    let ended = yawrig(&command).in_folder(folder.path()).run().exits(0);
    let conditions: Vec<&str> =
        ended.stdout.lines().filter(|line| line.starts_with("next:")).collect();
    assert_eq!(conditions[0], "next: K3 front, wind off (release 3 of 4)", "{}", ended.report());
    assert_eq!(conditions.len(), 2);
    let table = ended.stdout.lines().find(|line| line.contains("K3 at 10 m/s"));
    assert!(table.is_some_and(|line| line.contains("Cy_beta 2.1")), "{}", ended.report());
    let points = derivatives(folder.path(), "out/campaign.toml");
    let files: Vec<&Value> =
        points["releases"].as_array().expect("releases").iter().map(|r| &r["file"]).collect();
    assert_eq!(files, ["K3-mid-off.csv", "K3-mid-on-2.csv", "K3-front-off.csv", "K3-front-on.csv"]);
    let cn_beta = number(&points["points"][0]["cn_beta"]["value"]);
    assert!((cn_beta - 0.5321).abs() < 1e-3, "{cn_beta}");

    // Into the folder of another rig nothing is put.
    let command = "monitor --campaign plan/campaign.toml --record out --density-kg-m3 1.1";
    let refused = yawrig(command).in_folder(folder.path()).run().exits(3).helps();
    refused.says("another model, air or rig");
}

#[test]
fn one_condition_is_held_and_shown() {
    let folder = planned();
    for (wind, shown) in [(0, "next: K3 front, wind off"), (10, "next: K3 front, wind 10 m/s")] {
        let command = format!(
            "monitor --spring K3 --axis front --wind {wind} --record out --releases 2 --speed 200"
        );
        let ended = yawrig(&command).in_folder(folder.path()).run().exits(0);
        let times = ended.stdout.lines().filter(|line| line.starts_with(shown)).count();
        assert!(times >= 2, "{}", ended.report());
    }
    // The same by the plan's file, and its own inertia: derivatives with the second condition.
    let text =
        std::fs::read_to_string(folder.path().join("out/campaign.toml")).expect("a campaign");
    assert_eq!(text.matches("[[release]]").count(), 4, "{text}");
    let command =
        "monitor --condition plan/campaign.toml#12 --inertia-kg-m2 0.1205 --releases 1 --speed 200";
    let ended = yawrig(command).in_folder(folder.path()).run().exits(0);
    let first = ended.stdout.lines().next().expect("a line");
    assert_eq!(first, "next: K3 front, wind 10 m/s, Izz 0.12050 kg m2");
    assert!(ended.stdout.contains("no_reference"), "{}", ended.report());
}

#[test]
fn conditions_that_cannot_be_are_refused_with_the_reason() {
    let folder = planned();
    for (flags, why) in [
        ("--spring K3 --wind nan", "wind speed NaN m/s"),
        ("--spring K3 --wind -1", "wind speed -1 m/s"),
        ("--spring K3 --wind 400", "0 (wind off) to 340 m/s"),
        ("--spring K3", "without a wind speed"),
        ("--wind 10", "without a spring"),
        ("--spring K3 --wind 10 --density-kg-m3 inf", "density_kg_m3 inf"),
        ("--spring K3 --wind 10 --density-kg-m3 1000", "air density 1000 kg/m3"),
        ("--spring K3 --wind 10 --length-m 0", "length_m 0"),
        ("--spring K3 --wind 10 --inertia-kg-m2 -0.1", "inertia_kg_m2 -0.1"),
        ("--spring K3 --wind 10 --inertia-kg-m2 1e9", "moment of inertia 1000000000 kg m2"),
        ("--spring stiff --wind 10", "nothing says how stiff"),
        ("--spring K33 --wind 10", "did you mean K3?"),
        ("--condition plan/campaign.toml --spring K12 --wind 10", "did you mean K1?"),
        ("--spring ../K3 --wind 10 --stiffness-n-per-m 100", "\"../K3\" names no spring"),
        ("--spring= --wind 10", "\"\" names no spring"),
        ("--spring stiff --wind 10 --stiffness-n-per-m 100", "there is no spring stiff"),
        ("--condition plan/campaign.toml#33", "releases 1 to 32"),
        ("--condition plan/campaign.toml", "says nothing of a release"),
        ("--condition plan/campaign.toml#2 --record trace.csv", "need a folder"),
        ("--spring K3 --wind 10 --device /dev/null", "the rig at the device is not described"),
    ] {
        let command = format!("monitor --speed 100 --releases 1 {flags}");
        yawrig(&command).in_folder(folder.path()).run().exits(2).helps().says(why);
    }
}

/// What a file says of one spring and wind speed is not said of another.
#[test]
fn uncertainties_belong_to_their_own_spring_stiffness_and_wind_speed() {
    let folder = planned();
    let file = folder.path().join("plan/campaign.toml");
    let text = std::fs::read_to_string(&file).expect("a plan");
    let mut campaign: toml::Table = toml::from_str(&text).expect("TOML");
    for release in campaign["release"].as_array_mut().expect("releases") {
        let release = release.as_table_mut().expect("a release");
        let u = if release["spring"].as_str() == Some("K4") { 0.8 } else { 0.5 };
        release.insert("spring_stiffness_u_n_per_m".to_owned(), u.into());
        release.insert("wind_speed_u_m_s".to_owned(), 0.02.into());
    }
    std::fs::write(&file, toml::to_string(&campaign).expect("TOML")).expect("room");
    for (flags, stiffness_u, wind_u) in [
        ("", Some(0.5), Some(0.02)),
        ("--spring K4", Some(0.8), Some(0.02)),
        ("--spring K4 --wind 12", Some(0.8), None),
        ("--stiffness-n-per-m 120", None, Some(0.02)),
    ] {
        let out = tempfile::tempdir().expect("a folder");
        let path = out.path().display();
        let command = format!(
            "monitor --condition plan/campaign.toml#2 {flags} --inertia-kg-m2 0.101 --releases 1 \
             --speed 500 --record {path}"
        );
        yawrig(&command).in_folder(folder.path()).run().exits(0);
        let made = std::fs::read_to_string(out.path().join("campaign.toml")).expect("a campaign");
        let made: toml::Table = toml::from_str(&made).expect("TOML");
        let u = |name: &str| made["release"][0].get(name).and_then(toml::Value::as_float);
        let found = (u("spring_stiffness_u_n_per_m"), u("wind_speed_u_m_s"));
        assert_eq!(found, (stiffness_u, wind_u), "{flags}");
    }
}
