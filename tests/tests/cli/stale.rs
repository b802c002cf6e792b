//! A model beside records or values that are no longer those of its fit.

use serde_json::Value;
use std::path::Path;
use yawrig_tests::process::{yawrig, Ended};

fn run(folder: &Path, command: &str) -> Ended {
    yawrig(command).in_folder(folder).run()
}

fn simulated(folder: &Path, name: &str, wn: f64, seed: u32) {
    let rig = format!("--natural-frequency {wn} --damping 0.01 --seconds 15 --rate-hz 100 --force");
    run(folder, &format!("simulate {rig} --seed {seed} --out {name}")).exits(0);
}

fn stale(compared: &Value) -> Vec<&str> {
    compared["stale"].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
}

#[test]
fn a_record_that_changed_under_a_model_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    simulated(folder, "a.csv", 7.5, 1);
    simulated(folder, "b.csv", 7.5, 2);
    run(folder, "fit a.csv --hold-out b.csv").exits(0);
    let sound = run(folder, "compare --json").exits(0);
    assert!(!sound.stderr.contains("changed"), "{}", sound.stderr);
    assert!(stale(&sound.json()).is_empty());

    simulated(folder, "b.csv", 7.2, 3);
    for verb in
        ["compare", "compare b.csv", "law model.toml", "export model.toml --to csv --out x.csv"]
    {
        let ended = run(folder, verb);
        assert!(ended.stderr.contains("b.csv has changed"), "{verb}: {}", ended.report());
        assert!(!ended.stderr.contains("a.csv has changed"), "{verb}: {}", ended.report());
    }
    let compared = run(folder, "compare --json").exits(0).json();
    assert!(matches!(stale(&compared)[..], [one] if one.contains("b.csv")), "{compared}");
    let text = run(folder, "compare").exits(0).stdout;
    let begins = text.find("b.csv has changed").unwrap_or(usize::MAX);
    assert!(begins < text.find("residual").expect("a residual"), "{text}");
    run(folder, "report model.toml --out r.html").exits(0);
    let data = run(folder, "report --data r.html").exits(0).stdout;
    assert!(data.contains("b.csv has changed"));

    // Fitted to what is there now, it is sound again.
    run(folder, "fit").exits(0);
    let compared = run(folder, "compare --json").exits(0);
    assert!(!compared.stderr.contains("changed") && stale(&compared.json()).is_empty());
}

#[test]
fn an_uncertainty_is_not_printed_beside_a_value_that_was_edited() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    simulated(folder, "a.csv", 7.5, 1);
    run(folder, "fit a.csv").exits(0);
    let model = folder.join("model.toml");
    let text = std::fs::read_to_string(&model).expect("a model");
    let line = text.lines().find(|l| l.starts_with("natural_frequency_rad_s")).expect("wn");
    let (head, value) = line.split_once("value = ").expect("a value");
    let (_, rest) = value.split_once(',').expect("a comma");
    std::fs::write(&model, text.replace(line, &format!("{head}value = 7.6,{rest}"))).expect("room");

    let compared = run(folder, "compare").exits(0).says("natural_frequency_rad_s of a");
    assert!(
        compared.stdout.contains("wn 7.600000 (uncertainty unknown) rad/s"),
        "{}",
        compared.stdout
    );
    let json = run(folder, "compare --json").exits(0).json();
    let modal = &json["modal"];
    assert_eq!(modal["natural_frequency_rad_s"]["u"], Value::Null, "{modal}");
    assert!(modal["damping_ratio"]["u"].as_f64().is_some_and(|u| u > 0.0), "{modal}");
    for row in json["at_amplitude"].as_array().expect("amplitudes") {
        assert_eq!(row["natural_frequency_rad_s"]["u"], Value::Null, "{row}");
    }
    // A step that fits nothing makes it none of a fit's values.
    run(folder, "reject free_play --why small").exits(0);
    run(folder, "compare").exits(0).says("edited");
    run(folder, "fit").exits(0);
    let compared = run(folder, "compare").exits(0);
    assert!(!compared.report().contains("edited") && !compared.report().contains("unknown"));
}
