//! The difference of BIC is one number under one name, whichever command prints it.

use serde_json::Value;
use yawrig_tests::process::yawrig;

#[test]
fn compare_and_diagnose_print_the_same_difference_for_the_same_effect() {
    let folder = tempfile::tempdir().expect("a folder");
    let record = folder.path().join("r.csv");
    let rig = "simulate --natural-frequency 7.5 --damping 0.008 --seconds 30 --seed 5 --effect coulomb_friction:c=0.05";
    yawrig(rig).and("--out").and(&record).run().exits(0);
    let diagnosed = yawrig("diagnose --json").and(&record).run().exits(0).json();
    let candidates = diagnosed["candidates"].as_array().expect("a list");
    let of = |effect: &str| {
        let named = |c: &&Value| c["effect"] == effect;
        let found = candidates.iter().find(named).expect("a candidate");
        found["evidence"].as_f64().expect("a number")
    };
    // The best, and one that leaves much that is correlated.
    for effect in ["coulomb_friction", "cubic_damping"] {
        let compared =
            yawrig(&format!("compare --json --effect {effect}")).and(&record).run().exits(0);
        let there = compared.json()["evidence"].as_f64().expect("a number");
        let here = of(effect);
        assert!((here - there).abs() < 0.01 * there.abs(), "{effect}: {here}, {there}");
        let text = yawrig(&format!("compare --effect {effect}")).and(&record).run().exits(0);
        assert!(
            text.stdout.contains(&format!("difference of BIC {there:.1}")),
            "{}",
            text.report()
        );
    }
    let text = yawrig("diagnose").and(&record).run().exits(0);
    assert!(text.stdout.contains("as `compare --effect` prints it"), "{}", text.report());
}

/// A rest angle off the sensor's zero looks like an even law where the zero is taken as known.
#[test]
fn compare_says_where_a_free_zero_does_as_much_as_an_effect() {
    let folder = tempfile::tempdir().unwrap();
    let of = |command: &str| yawrig(command).in_folder(folder.path()).run().exits(0);
    of("simulate --natural-frequency 7.5 --damping 0.008 --effect static_offset:m=0.2 --seconds 20 --out off.csv");
    of("simulate --natural-frequency 7.5 --damping 0.008 --effect quadratic_stiffness:k2=20 --seconds 20 --out even.csv");
    let said = "the model rests at";
    of("compare off.csv --effect quadratic_stiffness").says(said);
    for right in [
        "compare off.csv --effect static_offset",
        "compare off.csv --effect quadratic_stiffness --unknown-zero",
        "compare even.csv --effect quadratic_stiffness",
    ] {
        let ended = of(right);
        assert!(!ended.stderr.contains(said), "{}", ended.report());
    }
}

/// It may be another than the data ask for, as drag is where more would be taken away: what is fitted then is
/// the model without it, and its number is zero with an uncertainty.
#[test]
fn an_effect_that_the_record_does_not_show_is_no_reason_to_refuse() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = "simulate --natural-frequency 5.44 --damping 0.008 --amplitude-deg 38 --noise-deg 0.04 --rate-hz 30 \
               --effect cubic_stiffness:k3=-4.6 --effect coulomb_friction:c=0.04 --effect quadratic_stiffness:k2=0.35";
    let shown = "--effect cubic_stiffness --effect coulomb_friction --effect quadratic_stiffness";
    for seed in [1, 3, 7, 8] {
        let record = folder.path().join(format!("{seed}.csv"));
        yawrig(&format!("{rig} --seed {seed} --out")).and(&record).run().exits(0);
        let with = format!("compare --json {shown} --effect quadratic_damping");
        let with = yawrig(&with).and(&record).run().exits(0).json();
        // Of a number that explains nothing the difference of BIC is less ln n: the residual has not grown.
        let samples = std::fs::read_to_string(&record).expect("a record").lines().count() as f64;
        let difference = with["evidence"].as_f64().expect("a number");
        assert!((-samples.ln()..0.0).contains(&difference), "{seed}: {difference}");
        let number = &with["parameters"]["quadratic_damping.d"];
        let [value, u] = ["value", "u"].map(|name| number[name].as_f64().expect("a number"));
        assert!(value.abs() < 3.0 * u, "{seed}: {number}");
    }
}
