//! `law` and `add measured_law`: what no effect of the library is, measured, named and taken into a model.

use serde_json::Value;
use tempfile::TempDir;
use yawrig_tests::process::{yawrig, Yawrig};

/// Planted by the rig's own integrator.
const EXPONENT: f64 = 1.5;

struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(tempfile::tempdir().expect("a folder"));
        let text = "id = \"odd_drag\"\ntitle = \"x\"\nmoment = \"-h * sign(r) * abs(r / 1.0)^n\"\n[parameters]\n\
            h = { unit = \"rad/s2\", start = 0.1, min = 0.0 }\nn = { unit = \"1\", start = 1.0, min = 0.0 }\n";
        std::fs::write(bench.0.path().join("odd.toml"), text).expect("room for it");
        bench
            .of("simulate --natural-frequency 7 --damping 0.004 --out r.csv --seed 3")
            .and("--effect")
            .and(format!("odd.toml:h=0.25,n={EXPONENT}"))
            .run()
            .exits(0);
        bench
    }

    fn of(&self, arguments: &str) -> Yawrig {
        yawrig(arguments).in_folder(self.0.path())
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("the folder");
        let name = |e: std::io::Result<std::fs::DirEntry>| e.expect("an entry").file_name();
        let mut names: Vec<String> = entries.map(|e| name(e).to_string_lossy().into()).collect();
        names.sort();
        names
    }

    fn json(&self, arguments: &str) -> Value {
        self.of(arguments).and("--json").run().exits(0).json()
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_law_is_measured_named_and_its_file_can_be_added() {
    let bench = Bench::new();
    let found = bench.json("law r.csv --out formulas");
    assert!(number(&found["residual_over_noise"]) < 1.1, "{}", found["residual_over_noise"]);
    assert!(number(&found["without"]["residual_over_noise"]) > 3.0, "{}", found["without"]);
    assert_eq!(found["memory"], false);
    let best = &found["names"][0];
    assert_eq!(best["form"], "power_law", "{}", found["names"]);
    let n = &best["parameters"]["n"];
    assert!((number(&n["value"]) - EXPONENT).abs() < 3.0 * number(&n["u"]), "{n}");
    for (law, at) in [("stiffness", "yaw_deg"), ("damping", "rate_deg_s")] {
        let points = found[law].as_array().expect("points");
        assert!(points.iter().all(|p| p[at].is_f64() && p["u"].is_f64()), "{law}");
    }
    assert_eq!(best["formula"], "-h * sign(r) * abs(r / 1.0)^n", "{best}");
    let file = best["file"].as_str().expect("a file");
    assert_eq!(file, "formulas/power_law.toml");
    bench.of("fit r.csv").run().exits(0);
    let added = bench.json(&format!("add {file}"));
    assert!(number(&added["residual_over_noise"]) < 1.1, "{added}");
}

/// A ripple in the angle, of which no formula is: the commands take the curve, not the formula that is nearest.
#[test]
fn where_no_formula_is_as_near_the_law_is_taken_as_it_was_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "id = \"ripple\"\ntitle = \"x\"\nmoment = \"-h * sin(n * b)\"\n[parameters]\n\
        h = { unit = \"rad/s2\", start = 0.1 }\nn = { unit = \"1\", start = 50.0 }\n";
    std::fs::write(folder.path().join("ripple.toml"), text).expect("room for it");
    let run = |arguments: &str| yawrig(arguments).in_folder(folder.path()).run().exits(0);
    run("simulate --natural-frequency 7 --damping 0.004 --out r.csv --seed 3 --effect ripple.toml:h=0.15,n=60");
    let found = run("law r.csv --json").json();
    assert!(number(&found["residual_over_noise"]) < 1.1, "{}", found["residual_over_noise"]);
    let best = number(&found["names"][0]["held_out_over_noise"]);
    assert!(best > 1.5 * number(&found["held_out_over_noise"]), "{best}");
    let last = serde_json::json!(["yawrig", "add", "measured_law"]);
    assert_eq!(found["commands"].as_array().and_then(|c| c.last()), Some(&last));
    let said = run("law r.csv").stdout;
    assert!(said.contains("no formula predicts as well as the law as it was measured"), "{said}");
}

#[test]
fn a_measured_law_is_added_kept_in_the_file_and_removed() {
    let bench = Bench::new();
    bench.of("fit r.csv").run().exits(0);
    let added = bench.json("add measured_law --why drag");
    let after = number(&added["residual_over_noise"]);
    assert!(after < 1.1, "{after}");
    // What stands in the file is the model.
    let compared = bench.json("compare");
    assert!((number(&compared["residual_over_noise"]) / after - 1.0).abs() < 0.02, "{compared}");
    let fitted = bench.json("fit");
    assert!(number(&fitted["residual_over_noise"]) < 1.1);
    // What its curves bend to is not tried beside it, and it is said.
    let said = bench.of("diagnose --model model.toml r.csv").run().exits(0).stdout;
    assert!(
        said.contains("not tried: the measured law in the model accounts for all they do"),
        "{said}"
    );
    let held = &bench.json("diagnose --model model.toml r.csv")["held_by_law"];
    assert!(
        held.as_array().is_some_and(|held| held.contains(&"quadratic_damping".into())),
        "{held}"
    );
    // A file of before, which holds weights alone, is not taken for this one.
    let path = bench.0.path().join("model.toml");
    let text = std::fs::read_to_string(&path).expect("a model");
    let is_curve = |line: &&str| line.contains("{ weight = ");
    let curve = text.lines().find(is_curve).expect("a curve");
    let (name, _) = curve.split_once(" =").expect("an entry");
    std::fs::write(&path, text.replace(curve, &format!("{name} = 0.001"))).expect("room for it");
    bench.of("compare").run().exits(3).says("is to be measured again");
    std::fs::write(&path, &text).expect("room for it");
    let removed = bench.json("remove measured_law");
    assert!(number(&removed["residual_over_noise"]) > 3.0);
    bench.of("history --return 2").run().exits(0);
    let again = bench.json("compare");
    assert!(number(&again["residual_over_noise"]) < 1.1);
}

/// Two springs: each has its natural frequency, the law is one, and known better than from the larger release
/// alone.
#[test]
fn releases_on_several_springs_measure_one_law() {
    let bench = Bench::new();
    bench
        .of("simulate --natural-frequency 10 --damping 0.003 --amplitude-deg 10 --out stiff.csv --seed 4")
        .and("--effect")
        .and(format!("odd.toml:h=0.25,n={EXPONENT}"))
        .run()
        .exits(0);
    let (alone, both) = (bench.json("law r.csv"), bench.json("law r.csv stiff.csv"));
    assert_eq!((number(&alone["records"]), number(&both["records"])), (1.0, 2.0));
    assert!(number(&both["residual_over_noise"]) < 1.1, "{}", both["residual_over_noise"]);
    let best = &both["names"][0];
    assert_eq!(best["form"], "power_law", "{}", both["names"]);
    let n = |of: &Value| of["names"][0]["parameters"]["n"].clone();
    let u = |of: &Value| number(&n(of)["u"]);
    assert!((number(&n(&both)["value"]) - EXPONENT).abs() < 3.0 * u(&both), "{}", n(&both));
    assert!(u(&both) < u(&alone), "{} {}", n(&both), n(&alone));
    bench.of("fit r.csv stiff.csv").run().exits(0);
    let added = bench.json("add measured_law");
    assert!(number(&added["residual_over_noise"]) < 1.1, "{added}");
}

#[test]
fn what_no_law_of_angle_and_rate_holds_is_told_from_it() {
    let bench = Bench::new();
    for (name, effect, kind, of) in [
        ("line", "harmonic_forcing:f=0.15,w=11,phi=0.3", "second_frequency", "harmonic_forcing"),
        ("drift", "baseline_drift:d=0.0008", "time", "baseline_drift"),
        ("sensor", "sensor_nonlinearity:s=0.8", "sensor", "sensor_nonlinearity"),
        ("random", "buffeting:q=0.0005", "randomness", "buffeting"),
    ] {
        bench
            .of(&format!("simulate --natural-frequency 7 --damping 0.004 --seconds 20 --out {name}.csv --seed 3"))
            .and("--effect")
            .and(format!("odd.toml:h=0.25,n={EXPONENT}"))
            .and("--effect")
            .and(effect)
            .run()
            .exits(0);
        let found = bench.json(&format!("law {name}.csv"));
        let beside = &found["beside"];
        println!("{effect}: {beside}, alone {}", found["held_out_over_noise"]);
        assert_eq!((&beside["kind"], &beside["effect"]), (&kind.into(), &of.into()), "{effect}");
        assert_eq!(found["memory"], false, "{effect}");
        if name == "line" {
            assert!((number(&beside["frequency_rad_s"]) - 11.0).abs() < 0.05, "{beside}");
        }
        if kind != "randomness" {
            let (alone, with) = (&found["held_out_over_noise"], &beside["held_out_over_noise"]);
            assert!(number(with) < 0.9 * number(alone), "{effect}: {alone} {with}");
        }
    }
    let before = bench.files();
    let found = bench.json("law r.csv");
    assert!(found["beside"].is_null() && found["memory"] == false, "{}", found["beside"]);
    let names = found["names"].as_array().expect("names");
    assert!(names.iter().all(|n| n["file"].is_null()), "{}", found["names"]);
    assert_eq!(bench.files(), before, "nothing is written unless it is asked for");
}

/// Mean damping ratio that the device finds in the whole of a release.
fn on_the_device(bench: &Bench, arguments: &str) -> f64 {
    let said = bench.json(&format!("replay {arguments}"));
    let estimates = said["records"][0]["estimates"].as_array().expect("estimates");
    let own = estimates.iter().find(|e| e["method"] == "device").expect("the device's own");
    number(&own["damping_ratio"]["value"])
}

/// On a release that the model has not seen.
#[test]
fn a_device_that_learnt_a_measured_law_is_five_times_nearer() {
    let bench = Bench::new();
    for (effect, n) in
        [(format!("odd.toml:h=0.25,n={EXPONENT}"), 1), ("odd.toml:h=0.05,n=0.5".into(), 2)]
    {
        for (file, seed) in [("seen", 5), ("fresh", 6)] {
            bench
                .of("simulate --natural-frequency 7 --damping 0.004")
                .and("--effect")
                .and(&effect)
                .and("--seed")
                .and(seed.to_string())
                .and("--out")
                .and(format!("{file}{n}.csv"))
                .run()
                .exits(0);
        }
        bench.of(&format!("fit seen{n}.csv --model m{n}.toml")).run().exits(0);
        bench.of(&format!("add measured_law --model m{n}.toml")).run().exits(0);
        let train = format!("train --samples 1500 --epochs 100 --model m{n}.toml --out m{n}.yrn");
        bench.of(&train).run().exits(0);
        let before = on_the_device(&bench, &format!("fresh{n}.csv"));
        let after = on_the_device(&bench, &format!("fresh{n}.csv --network m{n}.yrn"));
        println!("{effect}: zeta 0.00400, the device {before:.5}, taught {after:.5}");
        assert!(5.0 * (after - 0.004).abs() < (before - 0.004).abs(), "{effect} {before} {after}");
    }
}

#[test]
fn a_measured_law_wants_a_model() {
    let bench = Bench::new();
    let ended = bench.of("compare r.csv --no-model --effect measured_law").run().exits(2);
    assert!(ended.stderr.contains("yawrig add measured_law"), "{}", ended.stderr);
}

#[test]
fn diagnose_measures_the_law_of_what_is_unexplained_and_writes_nothing_unless_asked() {
    let bench = Bench::new();
    let text = "id = \"tones\"\ntitle = \"x\"\n\
        moment = \"a * (cos(1.7 * t) + cos(2.9 * t + 1) + cos(13 * t + 2) + cos(19.3 * t))\"\n\
        [parameters]\na = { unit = \"rad/s2\", start = 0.1 }\n";
    std::fs::write(bench.0.path().join("tones.toml"), text).expect("room for it");
    bench
        .of("simulate --natural-frequency 7 --damping 0.006 --seconds 30 --out s.csv")
        .and("--effect")
        .and("tones.toml:a=0.5")
        .run()
        .exits(0);
    let before = bench.files();
    let judged = bench.json("diagnose s.csv");
    assert_eq!(judged["status"], "unexplained");
    let name = &judged["law"]["names"][0];
    assert!(name["file"].is_null(), "{}", judged["law"]);
    let form = name["form"].as_str().expect("a name");
    let said = bench.of("diagnose s.csv").run().exits(0).stdout;
    let adding = format!("yawrig law s.csv --out found, then yawrig add found/{form}.toml");
    assert!(said.contains(&adding), "{said}");
    assert_eq!(bench.files(), before, "nothing is written unless it is asked for");
    let said = bench.of("diagnose s.csv --out formulas").run().exits(0).stdout;
    assert!(said.contains(&format!("yawrig add formulas/{form}.toml")), "{said}");
    assert!(bench.0.path().join(format!("formulas/{form}.toml")).is_file());
}

#[test]
fn friction_that_falls_with_the_rate_is_pointed_to_by_diagnose_measured_named_and_added() {
    let bench = Bench::new();
    let text = "id = \"falling\"\ntitle = \"x\"\nmoment = \"-c * tanh(r / 0.002) * (1 + s * exp(-abs(r) / v))\"\n[parameters]\n\
        c = { unit = \"rad/s2\", start = 0.05, min = 0.0 }\ns = { unit = \"1\", start = 0.5, min = 0.0 }\n\
        v = { unit = \"rad/s\", start = 0.1, min = 0.0 }\n";
    std::fs::write(bench.0.path().join("falling.toml"), text).expect("room for it");
    bench
        .of("simulate --natural-frequency 7 --damping 0.006 --seconds 30 --out s.csv")
        .and("--effect")
        .and("falling.toml:c=0.03,s=2,v=0.1")
        .run()
        .exits(0);
    let said = bench.of("diagnose s.csv").run().exits(0).stdout;
    assert!(said.contains("mostly explained by coulomb_friction"), "{said}");
    assert!(
        said.contains("what is left may be a law that can be measured: yawrig law s.csv"),
        "{said}"
    );
    let said = bench.of("law s.csv --out found").run().exits(0).stdout;
    assert!(said.contains("yawrig add found/stribeck_friction.toml"), "{said}");
    bench.of("fit s.csv").run().exits(0);
    let added = bench.json("add measured_law");
    assert!(number(&added["residual_over_noise"]) < 1.1, "{added}");
    let fitted = bench.json("fit");
    assert!(number(&fitted["residual_over_noise"]) < 1.1, "{fitted}");
}

/// Where the library holds the effect a law bends to its noise too: the name wins.
#[test]
fn the_right_formula_predicts_as_well_as_the_measured_law_or_better() {
    let bench = Bench::new();
    for (effect, form, amplitude_deg) in [
        ("coulomb_friction:c=0.02", "dry_friction", 12),
        ("quadratic_damping:d=0.03", "drag", 12),
        ("cubic_damping:c=1.5", "square_angle_damping", 20),
        ("cubic_stiffness:k3=40", "cubic", 12),
        ("quadratic_stiffness:k2=8", "quadratic", 12),
        ("odd_quadratic_stiffness:k=8", "odd_quadratic", 12),
        ("quintic_stiffness:k5=800", "quintic", 12),
        ("pendulum_gravity:g=20", "sine", 50),
    ] {
        let rig = format!(
            "--natural-frequency 7 --damping 0.004 --amplitude-deg {amplitude_deg} --seconds 30 --rate-hz 200 \
             --noise-deg 0.04 --seed 41"
        );
        bench.of(&format!("simulate {rig} --effect {effect} --out l.csv --force")).run().exits(0);
        let found = bench.json("law l.csv");
        let by_law = number(&found["held_out_over_noise"]);
        let names = found["names"].as_array().expect("names");
        let named = names.iter().find(|n| n["form"] == form);
        let named = named.unwrap_or_else(|| panic!("{effect}: {names:?}"));
        let by_name = number(&named["held_out_over_noise"]);
        println!("{effect}: law {by_law:.4}, {form} {by_name:.4}");
        assert!(by_name < 1.001 * by_law, "{effect}: law {by_law}, {form} {by_name}");
    }
}
