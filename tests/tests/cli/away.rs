//! Results taken away: CSV, and models side by side.

use std::path::Path;
use yawrig_tests::process::{yawrig, Ended};

fn run(folder: &Path, command: &str) -> Ended {
    yawrig(command).in_folder(folder).run()
}

/// Every row has as many cells as the header, whose numbers name their unit.
fn rows(ended: &Ended) -> Vec<Vec<String>> {
    let mut reader = ended.stdout.lines();
    let header = reader.next().expect("a header");
    let count = header.split(',').count();
    let rows: Vec<Vec<String>> =
        reader.map(|line| line.split(',').map(str::to_owned).collect()).collect();
    assert!(!rows.is_empty() && rows.iter().all(|row| row.len() == count), "{}", ended.report());
    std::iter::once(header.split(',').map(str::to_owned).collect()).chain(rows).collect()
}

#[test]
fn results_are_csv_with_units_in_the_header() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let rig = "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05 --seconds 40";
    run(folder, &format!("{rig} --out r.csv")).exits(0);
    let identified = rows(&run(folder, "identify r.csv --method all --csv").exits(0));
    assert_eq!(identified.len(), 4);
    assert_eq!(identified[0][2], "natural_frequency_rad_s");
    let json = run(folder, "identify r.csv --json").exits(0).json();
    let wn = &json["records"][0]["estimates"][0]["natural_frequency_rad_s"]["value"];
    assert_eq!(identified[1][2].parse::<f64>().ok(), wn.as_f64());
    let diagnosed = rows(&run(folder, "diagnose r.csv --csv").exits(0));
    assert_eq!(diagnosed.last().expect("a row")[2], "coulomb_friction");
    run(folder, "fit r.csv").exits(0);
    run(folder, "reject free_play --why tight").exits(0);
    let history = rows(&run(folder, "history --csv").exits(0));
    assert_eq!(history[2][2..4], ["reject", "free_play"]);
    run(folder, "simulate --campaign c --seconds 30 --rate-hz 200").exits(0);
    let points = rows(
        &run(folder, "derivatives c/campaign.toml --csv --method least-squares,network").exits(0),
    );
    assert_eq!(points.len(), 1 + 2 * 8);
    assert_eq!(points[0][4], "cn_beta_per_rad");
    run(folder, "derivatives c/campaign.toml --csv --json").exits(2);
}

#[test]
fn two_models_stand_side_by_side() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let rig = "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05 --seconds 40";
    run(folder, &format!("{rig} --out r.csv")).exits(0);
    run(folder, &format!("{rig} --seed 9 --out other.csv")).exits(0);
    for model in ["a", "b"] {
        run(folder, &format!("fit r.csv --model {model}.toml")).exits(0);
    }
    run(folder, "add coulomb_friction --model b.toml").exits(0);
    let ended = run(folder, "compare --model a.toml --model b.toml").exits(0);
    for said in
        ["a.toml", "b.toml", "held out over noise", "difference of BIC", "coulomb_friction.c"]
    {
        assert!(ended.stdout.contains(said), "{}", ended.report());
    }
    let models = run(folder, "compare a.toml b.toml --json").exits(0).json()["models"].clone();
    let gain = models[1]["bic_gain"].as_f64().expect("a number");
    assert!(gain > 100.0 && models[0]["bic_gain"] == 0.0, "{models}");
    assert!(models[1]["residual_over_noise"].as_f64() < models[0]["residual_over_noise"].as_f64());
    let back = run(folder, "compare b.toml a.toml --json").exits(0).json()["models"].clone();
    assert!((back[1]["bic_gain"].as_f64().expect("a number") + gain).abs() < 1e-6 * gain);
    run(folder, "compare a.toml b.toml other.csv").exits(0);
    let report = run(folder, "report a.toml b.toml --json").exits(0).json();
    assert_eq!(report["sides"][1]["bic_gain"], models[1]["bic_gain"]);
    assert_eq!(report["releases"][1]["name"], "b.toml: r.csv");
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    assert!(page.contains("Models side by side") && page.contains("coulomb_friction.c"));
    run(folder, "fit other.csv --model c.toml").exits(0);
    run(folder, "compare a.toml c.toml").exits(2).says("different records").helps();
}
