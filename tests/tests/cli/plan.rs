//! `plan`: which release would tell two models of a record apart.

use std::path::Path;
use yawrig_tests::process::{yawrig, Yawrig};

const RIVALS: &str = "--rival quadratic_damping --rival cubic_damping --rival coulomb_friction";

fn of(folder: &Path, arguments: &str) -> Yawrig {
    yawrig(arguments).in_folder(folder)
}

#[test]
fn releases_are_ranked_by_how_far_they_part_the_rivals() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let rig = "--natural-frequency 7 --damping 0.006 --amplitude-deg 7 --seconds 20 --rate-hz 200";
    let hidden = "--effect quadratic_damping:d=0.02 --out r.csv";
    of(folder, &format!("simulate {rig} {hidden}")).run().exits(0);
    of(folder, "fit r.csv").run().exits(0);
    // Three rivals at sixty releases that the rig can make.
    let model = folder.join("model.toml");
    let text = std::fs::read_to_string(&model).expect("a model");
    let can = "[can]\namplitudes_deg = [3, 6, 12, 20, 30]\nseconds = [20, 40, 60, 80]\n\
               natural_frequencies_rad_s = [4.0, 14.0]\n";
    std::fs::write(&model, format!("{text}\n{can}")).expect("room for it");
    let planned = of(folder, &format!("plan model.toml {RIVALS} --json")).run().exits(0).json();
    assert_eq!(planned["rivals"].as_array().map(Vec::len), Some(3), "{planned}");
    let releases = planned["releases"].as_array().expect("releases");
    assert_eq!(releases.len(), 60);
    let number = |k: usize, name: &str| releases[k][name].as_f64().expect("a number");
    println!("{} s", planned["seconds"]);
    assert!(number(0, "chance_to_decide") > 0.95, "{}", releases[0]);
    assert!(number(0, "amplitude_deg") > 15.0 && number(59, "amplitude_deg") < 15.0);
    assert!(number(0, "separation_sigma") > 5.0 * number(59, "separation_sigma"));
    for k in 1..60 {
        assert!(number(k, "chance_to_decide") <= number(k - 1, "chance_to_decide"));
    }
    // The rivals are found where none is named, and the table stays in the file.
    let found = of(folder, "plan model.toml").run().exits(0);
    assert!(found.stdout.contains("quadratic_damping"), "{}", found.stdout);
    of(folder, "add quadratic_damping").run().exits(0);
    assert!(std::fs::read_to_string(&model).expect("a model").contains("[can]"));
}

/// A measured law is a truth that formulas are held to, within its range; that it can follow a formula
/// refutes neither.
#[test]
fn a_measured_law_is_a_rival_where_it_was_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let rig = "--natural-frequency 7 --damping 0.004 --amplitude-deg 12 --seconds 40 --rate-hz 200";
    let hidden = "--effect coulomb_friction:c=0.02 --out r.csv";
    of(folder, &format!("simulate {rig} {hidden}")).run().exits(0);
    of(folder, "fit r.csv").run().exits(0);
    let law = "--rival measured_law";
    of(folder, &format!("plan model.toml {law} --rival coulomb_friction"))
        .run()
        .exits(2)
        .says("add measured_law");
    of(folder, "plan model.toml --rival a --rival b").run().exits(2).says("\"a\"").helps();
    of(folder, "add measured_law").run().exits(0);
    let against = |formula: &str| {
        let planned = of(folder, &format!("plan model.toml {law} --rival {formula} --json"));
        let planned = planned.run().exits(0).json();
        let releases = planned["releases"].as_array().expect("releases").clone();
        assert!(releases.iter().all(|r| r["amplitude_deg"].as_f64() < Some(12.6)), "{planned}");
        assert!(planned["notes"][0].as_str().is_some_and(|n| n.contains("beyond its range")));
        releases[0]["chance_to_decide"].as_f64().expect("a chance")
    };
    assert!(against("coulomb_friction") < 0.01);
    assert!(against("quadratic_damping") > 0.99);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    of(folder, "plan none.toml").run().exits(3).helps();
    of(folder, "plan none.toml --rival free_play").run().exits(2).says("one --rival").helps();
}
