//! `campaign init` and `check`: from a folder of records with odd names to the table.

use std::path::Path;
use yawrig_tests::process::{yawrig, Ended};

fn run(folder: &Path, command: &str) -> Ended {
    yawrig(command).in_folder(folder).run()
}

fn init(folder: &Path, pattern: &str) -> Ended {
    yawrig("campaign init runs --force --pattern").and(pattern).in_folder(folder).run()
}

#[test]
fn eight_oddly_named_files_to_a_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    run(folder, "simulate --campaign c --seconds 30 --rate-hz 200").exits(0);
    std::fs::create_dir(folder.join("runs")).expect("room");
    for spring in ["K2", "K6"] {
        for (axis, called) in [("mid", "m"), ("front", "vorn")] {
            for (wind, speed) in [("off", "off"), ("on", "10,0")] {
                let from = folder.join(format!("c/{spring}-{axis}-{wind}.csv"));
                let to = folder.join(format!("runs/Feder {spring}_V{speed}_{called}_run7.csv"));
                std::fs::copy(from, to).expect("room");
            }
        }
    }
    std::fs::write(folder.join("runs/notes.csv"), "not a record").expect("room");
    init(folder, "{spring}.csv{n}").exits(3).says("no file's name matches").helps();
    init(folder, "{spring").exits(2).helps();
    let ended = init(folder, "Feder {spring}_V{wind}_{axis}_run{n}.csv").exits(0).says("notes.csv");
    assert!(ended.stdout.contains("8 releases with springs K2, K6; 7 lines"), "{}", ended.report());
    // All at once, each with its line and unit.
    let ended = run(folder, "campaign check runs/campaign.toml").exits(3).helps();
    for said in [
        "line 6: length_m is missing: reference length, m",
        "density_kg_m3",
        "spring_arm_m",
        "\"K2\"",
        "\"K6\"",
    ] {
        assert!(ended.stdout.contains(said), "{said}: {}", ended.report());
    }
    assert_eq!(ended.stdout.lines().count(), 7, "{}", ended.report());
    run(folder, "derivatives runs/campaign.toml").exits(3).helps();
    // Filled in as the comments ask.
    let path = folder.join("runs/campaign.toml");
    let mut text = std::fs::read_to_string(&path).expect("the file");
    for (name, value) in [
        ("length_m", "0.625"),
        ("frontal_area_m2", "0.036"),
        ("density_kg_m3", "1.2"),
        ("spring_arm_m", "0.1"),
        ("axis_offset_m", "0.05"),
        ("\"K2\"", "214.0"),
        ("\"K6\"", "1751.0"),
    ] {
        let from = format!("\n{name} = nan  # MISSING: ");
        assert!(text.contains(&from), "{name}: {text}");
        text = text.replace(&from, &format!("\n{name} = {value}  # "));
    }
    std::fs::write(&path, &text).expect("room");
    let ended = run(folder, "campaign check runs/campaign.toml").exits(0);
    assert!(
        ended.stdout.contains("nothing is wrong with its 8 releases of 2 springs"),
        "{}",
        ended.report()
    );
    let table = run(folder, "derivatives runs/campaign.toml --json").exits(0).json();
    let truth = run(folder, "derivatives c/campaign.toml --json").exits(0).json();
    let of = |table: &serde_json::Value, spring: &str| {
        let points = table["points"].as_array().expect("points").clone();
        let point = points.into_iter().find(|p| p["spring"] == spring).expect(spring);
        point["cn_beta"]["value"].as_f64().expect("a value")
    };
    for spring in ["K2", "K6"] {
        assert!((of(&table, spring) / of(&truth, spring) - 1.0).abs() < 1e-3, "{spring}");
    }
    // Several faults are said together.
    let wrong = text.replacen("Feder K2_Voff", "Feder K2_Vof", 1).replacen(
        "axis_offset_m = 0.05",
        "axis_offset_m = -0.05",
        1,
    );
    let wrong = wrong.replacen("wind_speed_m_s = 10.0", "wind_speed_m_s = -10.0", 1);
    std::fs::write(&path, wrong).expect("room");
    let ended = run(folder, "campaign check runs/campaign.toml").exits(3).says("3 faults");
    for said in ["is not there", "axis_offset_m is not a positive", "wind_speed_m_s is negative"] {
        assert!(ended.stdout.contains(said), "{said}: {}", ended.report());
    }
}

#[test]
fn the_example_of_the_help_is_a_campaign() {
    let folder = tempfile::tempdir().expect("a folder");
    let help = run(folder.path(), "campaign --help").exits(0).stdout;
    let from = help.find("schema_version").expect("an example");
    let to = help.find("Each number may have").expect("its end");
    std::fs::write(folder.path().join("campaign.toml"), &help[from..to]).expect("room");
    let record = "simulate --natural-frequency 5 --damping 0.01 --seconds 60 --rate-hz 100 --out";
    run(folder.path(), &format!("{record} K1-mid-off.csv")).exits(0);
    let record = "simulate --natural-frequency 4.6 --damping 0.02 --seconds 60 --rate-hz 100 --out";
    run(folder.path(), &format!("{record} K1-mid-on.csv")).exits(0);
    run(folder.path(), "campaign check campaign.toml").exits(0);
}
