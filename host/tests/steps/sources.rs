//! From a campaign's diagnosis to the model by the printed commands alone: effects that know the wind.
//! Figures: `cargo test --release -p yawrig --test steps sources -- --nocapture`.

use crate::by_hand::{campaign, per_izz, Made, Planted, LENGTH_M};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

pub fn yawrig(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_yawrig"))
        .current_dir(folder)
        .args(words)
        .output()
        .expect("it starts")
}

pub fn json(folder: &Path, words: &[&str]) -> Value {
    let out = yawrig(folder, words);
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{words:?}: {said}");
    serde_json::from_slice(&out.stdout).expect("JSON")
}

/// Runs the commands of `found`; the answer of the last.
pub fn run(folder: &Path, found: &Value) -> Value {
    let mut last = Value::Null;
    for command in found["commands"].as_array().expect("commands") {
        let words: Vec<&str> =
            command.as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
        let out = yawrig(folder, &[&words[1..], &["--json"]].concat());
        println!("$ {}\n{}", words.join(" "), String::from_utf8_lossy(&out.stderr));
        assert!(out.status.success());
        last = serde_json::from_slice(&out.stdout).expect("JSON");
        println!(
            "  residual {:.3}, held out {:.3}",
            last["residual_over_noise"].as_f64().unwrap(),
            last["held_out_over_noise"].as_f64().unwrap()
        );
    }
    last
}

pub fn within(of: &Value, truth: f64, u: f64) -> bool {
    let (value, own) = (of["value"].as_f64().unwrap(), of["u"].as_f64().unwrap());
    println!("  {value:.5} +- {own:.5}, planted {truth:.5}");
    (value - truth).abs() <= u * own
}

const SPRINGS: [(&str, f64); 3] = [("K2", 214.0), ("K4", 806.0), ("K6", 1751.0)];
const CN_BETA3: f64 = -10.0;
const FRICTION: f64 = 0.012;

fn planted_in(folder: &Path) {
    let moment = |b: f64, r: f64, _: f64, v: f64| {
        let damping = if v > 0.0 { per_izz(v, 1) * -0.1 * r } else { 0.0 };
        per_izz(v, 2) * (0.5 * b + CN_BETA3 * b * b * b) + damping
    };
    let made = Made {
        springs: &SPRINGS,
        speeds_m_s: &[0.0, 10.0, 14.0],
        amplitude_deg: 14.0,
        seconds: 15.0,
        rate_hz: 500.0,
        noise_deg: 0.04,
        seed: 7,
    };
    let planted = Planted {
        moment: &moment,
        state: &|_, _, _, _| 0.0,
        friction_rad_s2: FRICTION,
        damping_ratio: 0.004,
    };
    campaign(folder, &made, &planted);
}

/// An aerodynamic cubic moment and dry friction in the bearing: nine releases on three springs at 0, 10 and 14
/// m/s.
#[test]
fn the_printed_commands_make_the_model_of_a_campaign_in_the_wind() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planted_in(folder);
    let found = json(folder, &["diagnose", "campaign.toml", "--json"]);
    println!("{} {} {}", found["status"], found["effects"], found["commands"]);
    let grows = &found["grows_as"]["cubic_stiffness"];
    println!("grows as {grows}");
    assert_eq!(grows["power"], 2.0);
    let (chi, degrees) =
        (grows["chi_squared"].as_f64().unwrap(), grows["degrees"].as_f64().unwrap());
    assert!(chi < degrees + 3.0 * (2.0 * degrees).sqrt());
    let cn = &found["dimensionless"]["cubic_stiffness"];
    assert_eq!(cn["name"], "Cn_beta3");
    assert!(within(cn, CN_BETA3, 2.0));
    let last = run(folder, &found);
    assert!(last["residual_over_noise"].as_f64().unwrap() <= 1.15);
    assert!(last["held_out_over_noise"].as_f64().unwrap() <= 1.3);
    let k3 = -CN_BETA3 * per_izz(10.0, 2);
    assert!(within(&last["parameters"]["cubic_stiffness.k3"], k3, 2.0));
    assert!(within(&last["parameters"]["coulomb_friction.c"], FRICTION, 2.0));
    // The derivatives after it are those that the diagnosis has printed: they come from the same wn and zeta.
    for release in found["releases"].as_array().unwrap() {
        let (spring, wind) = (&release["spring"], release["wind_speed_m_s"].as_f64().unwrap());
        let name = format!("{} mid {wind} m/s", spring.as_str().unwrap());
        let all = last["conditions"].as_array().unwrap();
        let condition = all.iter().find(|c| c["condition"] == name.as_str()).expect("it is there");
        for number in ["natural_frequency_rad_s", "damping_ratio"] {
            let [a, b] = [release, condition].map(|of| of[number]["value"].as_f64().unwrap());
            let u = release[number]["u"].as_f64().unwrap();
            assert!((a - b).abs() < u, "{name} {number}: {a} {b} {u}");
        }
    }
    let by_model = ["derivatives", "campaign.toml", "--model", "model.toml", "--json"];
    let by_model = json(folder, &by_model);
    let cn = &by_model["dimensionless"]["cubic_stiffness"];
    assert_eq!(cn["name"], "Cn_beta3");
    assert!(within(cn, CN_BETA3, 2.0));
    let points = by_model["points"].as_array().unwrap();
    let after = found["derivatives"]["after"].as_array().unwrap();
    assert_eq!(points.len(), after.len());
    for (point, after) in points.iter().zip(after) {
        for number in ["cn_beta", "cn_r"] {
            let [a, b] = [point, after].map(|of| of[number]["value"].as_f64().unwrap());
            let u = after[number]["u"].as_f64().unwrap();
            assert!((a - b).abs() < u, "{number}: {a} {b} {u}");
        }
    }
    // As it stands in the file, against one release, and as a program.
    let text = std::fs::read_to_string(folder.join("model.toml")).unwrap();
    assert!(text.contains("source = \"aerodynamic\"") && text.contains("source = \"mechanical\""));
    for file in ["K2-0.csv", "K4-14.csv"] {
        let against = json(folder, &["compare", file, "--model", "model.toml", "--json"]);
        let over = against["residual_over_noise"].as_f64().unwrap();
        assert!(over < 1.15, "{file}: {over}");
    }
    let refit = json(folder, &["fit", "--json"]);
    assert!(refit["residual_over_noise"].as_f64().unwrap() <= 1.15);
    // Derivatives are those of the model as it stands, or none.
    std::fs::write(folder.join("model.toml"), format!("{text}\n# edited\n")).unwrap();
    for (model, why) in [
        ("model.toml", "model.toml has changed since it was fitted"),
        ("nowhere.toml", "cannot read nowhere.toml"),
        ("K2-0.csv", "is a record, not a model"),
    ] {
        let out = yawrig(folder, &["derivatives", "campaign.toml", "--model", model]);
        let said = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(3) && said.contains(why), "{model}: {said}");
    }
}

/// The same effect as one coefficient for all winds, tried on releases with the wind off: refused with the command that
/// would do, kept only where that is asked for; by itself `add` takes the source that predicts best.
#[test]
fn an_effect_that_predicts_worse_is_said_first_and_not_kept() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planted_in(folder);
    let off = ["K2-0.csv", "K4-0.csv", "K6-0.csv"];
    let hold_out: Vec<&str> = off.iter().flat_map(|file| ["--hold-out", file]).collect();
    json(folder, &[&["fit", "campaign.toml", "--json"], &hold_out[..]].concat());
    let before = std::fs::read_to_string(folder.join("model.toml")).unwrap();
    let out = yawrig(folder, &["add", "cubic_stiffness", "--mechanical"]);
    let said = String::from_utf8_lossy(&out.stderr);
    println!("{said}");
    assert_eq!(out.status.code(), Some(6));
    assert!(said.contains("predicted worse") && said.contains("--keep"), "{said}");
    assert!(said.contains("add cubic_stiffness --aerodynamic"), "{said}");
    assert_eq!(std::fs::read_to_string(folder.join("model.toml")).unwrap(), before);
    let kept = yawrig(folder, &["add", "cubic_stiffness", "--mechanical", "--keep"]);
    let said = String::from_utf8_lossy(&kept.stderr);
    assert!(kept.status.success() && said.contains("predicted worse"), "{said}");
    json(folder, &["remove", "cubic_stiffness", "--json"]);
    let by_itself = json(folder, &["add", "cubic_stiffness", "--json"]);
    let k3 = -CN_BETA3 * per_izz(10.0, 2);
    assert!(within(&by_itself["parameters"]["cubic_stiffness.k3"], k3, 4.0));
}

/// A coefficient for each wind speed, beside friction; read back, exported and refused where it is not known.
#[test]
fn a_coefficient_for_each_wind_is_that_of_each_wind() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    planted_in(folder);
    json(folder, &["fit", "campaign.toml", "--json"]);
    json(folder, &["add", "cubic_stiffness", "--each-wind", "--json"]);
    let found = json(folder, &["add", "coulomb_friction", "--mechanical", "--json"]);
    for (speed, v) in [("0", 0.0), ("10", 10.0), ("14", 14.0)] {
        let name = format!("cubic_stiffness.k3_at_{speed}");
        assert!(within(&found["parameters"][name], -CN_BETA3 * per_izz(v, 2), 3.0));
    }
    assert!(found["residual_over_noise"].as_f64().unwrap() < 1.15);
    let text = std::fs::read_to_string(folder.join("model.toml")).unwrap();
    assert!(text.contains("wind_speeds_m_s = [0.0, 10.0, 14.0]"), "{text}");
    json(folder, &["compare", "K4-10.csv", "--model", "model.toml", "--json"]);
    let out = yawrig(folder, &["export", "model.toml", "--to", "c", "--out", "model.h"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let out = yawrig(folder, &["add", "free_play", "--aerodynamic"]);
    assert_eq!(out.status.code(), Some(2));
}

/// The campaign of two springs at 0, 10 and 14 m/s, its diagnosis, and the model by the printed commands.
fn walked(folder: &Path, planted: &Planted, seed: u64) -> [Value; 2] {
    let made = Made {
        springs: &SPRINGS[..2],
        speeds_m_s: &[0.0, 10.0, 14.0],
        amplitude_deg: 14.0,
        seconds: 15.0,
        rate_hz: 500.0,
        noise_deg: 0.04,
        seed,
    };
    campaign(folder, &made, planted);
    let found = json(folder, &["diagnose", "campaign.toml", "--json"]);
    println!("{} {} {}", found["status"], found["origin_reason"], found["grows_as"]);
    let last = run(folder, &found);
    assert!(last["residual_over_noise"].as_f64().unwrap() <= 1.15);
    assert!(last["held_out_over_noise"].as_f64().unwrap() <= 1.3);
    [found, last]
}

/// A cubic moment of springs and air, a damping of the air and friction: with the wind off the cubic moment is a
/// twelfth of what it is at 14 m/s, and needed; damping without friction predicts worse than neither.
#[test]
fn what_springs_and_air_make_together_is_neither_s_alone() {
    let (springs, cn_beta3, cn_betabeta_r) = (20.0, -10.0, -2.0);
    let moment = |b: f64, r: f64, _: f64, v: f64| {
        let blown = match v > 0.0 {
            true => per_izz(v, 1) * (-0.1 + cn_betabeta_r * b * b) * r,
            false => 0.0,
        };
        per_izz(v, 2) * (0.5 * b + cn_beta3 * b.powi(3)) - springs * b.powi(3) + blown
    };
    let planted = Planted {
        moment: &moment,
        state: &|_, _, _, _| 0.0,
        friction_rad_s2: FRICTION,
        damping_ratio: 0.004,
    };
    let folder = tempfile::tempdir().unwrap();
    let [found, last] = walked(folder.path(), &planted, 8);
    let mut named: Vec<&str> =
        found["effects"].as_array().unwrap().iter().map(|e| e.as_str().unwrap()).collect();
    named.sort_unstable();
    assert_eq!(named, ["coulomb_friction", "cubic_damping", "cubic_stiffness"]);
    assert_eq!(found["origin"]["cubic_stiffness"], "undecided");
    assert_eq!(found["origin"]["cubic_damping"], "aerodynamic");
    assert_eq!(found["origin"]["coulomb_friction"], "mechanical");
    let parameters = &last["parameters"];
    for (speed, v) in [("0", 0.0), ("10", 10.0), ("14", 14.0)] {
        let name = format!("cubic_stiffness.k3_at_{speed}");
        assert!(within(&parameters[name], springs - cn_beta3 * per_izz(v, 2), 3.0));
    }
    assert!(within(&parameters["cubic_damping.c"], -cn_betabeta_r * per_izz(10.0, 1), 3.0));
    assert!(within(&parameters["coulomb_friction.c"], FRICTION, 3.0));
}

/// A moment of the wake, x' = r - (b V/l) x: its size goes with the square of the speed, its rate with the speed.
fn wake(folder: &Path, friction_rad_s2: f64, seed: u64) {
    let (a2, b) = (0.15, 0.4);
    let moment = |yaw: f64, r: f64, x: f64, v: f64| {
        let damping = if v > 0.0 { per_izz(v, 1) * -0.1 * r } else { 0.0 };
        per_izz(v, 2) * (0.4 * yaw + a2 * x) + damping
    };
    let planted = Planted {
        moment: &moment,
        state: &|_, r, x, v| r - b * v / LENGTH_M * x,
        friction_rad_s2,
        damping_ratio: 0.004,
    };
    let [found, last] = walked(folder, &planted, seed);
    assert_eq!(found["origin"]["first_order_lag"], "aerodynamic");
    assert_eq!(found["source"]["first_order_lag"], "aerodynamic");
    assert_eq!(found["grows_as"]["first_order_lag"]["power"], 2.0);
    assert!(within(&last["parameters"]["first_order_lag.a"], -a2 * per_izz(10.0, 2), 3.0));
    assert!(within(&last["parameters"]["first_order_lag.rate"], b * 10.0 / LENGTH_M, 3.0));
    let friction = last["parameters"].get("coulomb_friction.c");
    assert_eq!(friction.is_some(), friction_rad_s2 > 0.0, "{}", found["effects"]);
    assert!(friction.is_none_or(|c| within(c, friction_rad_s2, 3.0)));
}

/// Each release by itself confuses size with rate; from far out on that valley the fit has to come back, and by the
/// releases together it is told which way the rate goes.
#[test]
fn a_wake_s_lag_is_the_air_s_beside_friction() {
    wake(tempfile::tempdir().unwrap().path(), 0.02, 10);
}

#[test]
fn a_wake_s_lag_is_of_the_air_size_and_rate() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    wake(folder, 0.0, 9);
    // Against releases at another speed and without wind, and as a program.
    for file in ["K4-14.csv", "K4-0.csv"] {
        let against = json(folder, &["compare", file, "--model", "model.toml", "--json"]);
        assert!(against["residual_over_noise"].as_f64().unwrap() < 1.15, "{file}");
    }
    json(folder, &["history", "--json"]);
    for (language, out) in [("c", "model.h"), ("python", "model.py"), ("csv", "table.csv")] {
        let out = yawrig(folder, &["export", "model.toml", "--to", language, "--out", out]);
        assert!(out.status.success(), "{language}: {}", String::from_utf8_lossy(&out.stderr));
    }
    // A release without wind remembers nothing, and begins with that.
    let program = std::fs::read_to_string(folder.join("model.py")).unwrap();
    assert_eq!(program.matches("\"z\": ").count(), 6, "one for each release");
}
