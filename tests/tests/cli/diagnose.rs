//! What `diagnose` finds missing in the model that there is.

use crate::model::{number, Bench};
use serde_json::{json, Value};

#[test]
fn diagnose_looks_for_what_the_present_model_lacks() {
    let bench = Bench { folder: tempfile::tempdir().expect("a folder") };
    let both = "--effect coulomb_friction:c=0.06 --effect cubic_stiffness:k3=-12 --seed 8";
    bench.simulate("r.csv", both);
    bench.refuses("diagnose", 3).says("model.toml");
    bench.of("fit r.csv").run().exits(0);
    bench.of("add coulomb_friction").run().exits(0);
    let found = bench.json("diagnose");
    assert_eq!(found["status"], "explained");
    assert_eq!(found["effects"], json!(["cubic_stiffness"]));
    let timeless = |mut answer: Value| {
        assert!(answer["seconds"].take().is_number());
        answer
    };
    assert_eq!(timeless(bench.json("diagnose model.toml")), timeless(found.clone()));
    // The first step is the model that is there; the last holds its effect, too.
    let steps = found["steps"].as_array().expect("steps");
    assert_eq!(steps.len(), 2);
    assert!(number(&steps[0]["parameters"]["coulomb_friction.c"], "value") > 0.0);
    let c = number(&steps[1]["parameters"]["coulomb_friction.c"], "value");
    assert!((c / 0.06 - 1.0).abs() < 0.02, "{c}");
    let candidates = found["candidates"].as_array().expect("candidates");
    assert!(candidates.iter().all(|c| c["effect"] != "coulomb_friction"));
    bench.of("add cubic_stiffness").run().exits(0);
    let ended = bench.of("diagnose r.csv --model model.toml").run().exits(0);
    assert!(ended.stdout.contains("adequate: the present model"), "{}", ended.report());
    // From a file alone it begins with the second-order model, whatever stands beside it.
    let found = bench.json("diagnose r.csv");
    assert_eq!(found["effects"].as_array().map(Vec::len), Some(2));
    bench.refuses("diagnose campaign.toml --model model.toml", 2).says("--model");
}

/// What mostly explains a record is named beside its first effect, too, once that is in the model.
#[test]
fn diagnose_goes_on_from_the_present_model_far_from_the_noise() {
    let bench = Bench::new();
    // A ripple of the spring, which no effects of the library add up to.
    let ripple = "id = \"ripple\"\ntitle = \"Ripple\"\nmoment = \"-h * sin(15 * b)\"\n\
                  [parameters]\nh = { unit = \"rad/s2\", start = 0.1 }\n";
    std::fs::write(bench.path("ripple.toml"), ripple).expect("room for it");
    let rig = "--natural-frequency 4 --damping 0.002 --amplitude-deg 60 --seconds 60 --rate-hz 100 --noise-deg 0.005";
    let hidden =
        "--effect pendulum_gravity:g=9 --effect coulomb_friction:c=0.02 --effect ripple.toml:h=0.05";
    bench.of(&format!("simulate {rig} {hidden} --out far.csv")).run().exits(0);
    let first = bench.json("diagnose far.csv");
    assert_eq!(first["status"], "mostly_explained", "{first}");
    let mut effects = first["effects"].as_array().expect("effects").clone();
    assert!(effects.len() > 1, "{first}");
    bench.of("fit far.csv").run().exits(0);
    bench.of(&format!("add {}", effects.remove(0).as_str().expect("an id"))).run().exits(0);
    let then = bench.json("diagnose --model model.toml");
    assert_eq!(then["status"], "mostly_explained", "{then}");
    assert_eq!(then["effects"].as_array(), Some(&effects), "{then}");
    assert!(then["sentence"].as_str().is_some_and(|s| s.contains("the present model")), "{then}");
}

/// A sensor that hardly rustles asks for the numbers of the equation, not those of a simulation's step.
#[test]
fn diagnose_has_the_numbers_of_compare_however_quiet_the_sensor() {
    let bench = Bench { folder: tempfile::tempdir().expect("a folder") };
    let rig = "--natural-frequency 12.34 --damping 0.006 --noise-deg 0.002 --adc-step-deg 0";
    let stop = "--effect end_stop:k=60,g=0.2";
    bench.of(&format!("simulate {rig} {stop} --out quiet.csv")).run().exits(0);
    let found = bench.json("diagnose quiet.csv");
    assert_eq!(found["status"], "explained", "{found}");
    assert_eq!(found["effects"], json!(["end_stop"]));
    let parameters = &found["steps"][1]["parameters"];
    let compared = bench.json("compare quiet.csv --effect end_stop");
    for (name, truth) in [("end_stop.k", 60.0), ("end_stop.g", 0.2)] {
        let [k, u] = ["value", "u"].map(|part| number(&parameters[name], part));
        assert!((k - truth).abs() < 2.0 * u, "{name} {k} +- {u}");
        let same = number(&compared["parameters"][name], "value");
        assert!((k - same).abs() < 0.1 * u, "{name} {k} {same}");
    }
}
