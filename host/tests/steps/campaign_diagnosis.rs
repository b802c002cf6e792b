//! Campaigns with a hidden effect, from the virtual rig's integrator, which is not the fit's. Every figure
//! asserted is printed: `cargo test --release -p yawrig --test steps campaign_diagnosis -- --nocapture`.

use crate::by_hand::{self, per_izz, Made, Planted, LENGTH_M};
use rayon::prelude::*;
use std::path::Path;
use std::process::Command;
use std::time::Instant;
use yawrig_campaign::simulated::{describe, plan, Planned};
use yawrig_core::derivatives::campaign::Campaign;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::Point;
use yawrig_core::derivatives::Computed;
use yawrig_core::diagnosis::diagnose::{diagnose, Diagnosis, Grouping, HeldOut, Options, Status};
use yawrig_core::diagnosis::origin::Origin;
use yawrig_core::effects::Effect;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;
use yawrig_rig::{Effects, End, Rig, Sensor, Spring, Start};

/// What is hidden at a wind speed in m/s: effects as the command line writes them.
pub type Hidden<'a> = &'a dyn Fn(f64) -> Vec<String>;

pub struct Wanted<'a> {
    pub springs: &'a [&'a str],
    /// 0: wind off.
    pub speeds_m_s: &'a [f64],
    pub repeats: u32,
    pub seconds: f64,
    pub rate_hz: f64,
    pub seed: u64,
    pub hidden: Hidden<'a>,
}

const NOTHING: Hidden = &|_| Vec::new();

impl Default for Wanted<'_> {
    fn default() -> Self {
        Self {
            springs: &["K2", "K5"],
            speeds_m_s: &[0.0, 10.0],
            repeats: 1,
            seconds: 25.0,
            rate_hz: 500.0,
            seed: 1,
            hidden: NOTHING,
        }
    }
}

/// The records, held a second and released from 12 deg on both axes, noise 0.05 deg.
pub fn planted(wanted: &Wanted) -> (Campaign, Vec<Record>) {
    let rig = Rig::default();
    let mut planned: Vec<Planned> = Vec::new();
    for &speed in wanted.speeds_m_s {
        let of_speed = plan(&rig, speed.max(1.0), wanted.repeats, wanted.seed ^ speed.to_bits());
        planned.extend(of_speed.unwrap().into_iter().filter(|record| {
            let c = &record.condition;
            c.wind_speed_m_s == speed && wanted.springs.contains(&c.spring.name)
        }));
    }
    for record in &mut planned {
        let hidden = (wanted.hidden)(record.condition.wind_speed_m_s);
        record.effects =
            Effects::new(hidden.iter().map(|text| text.parse().unwrap()).collect()).unwrap();
        record.file = format!("{}-{}", record.condition.wind_speed_m_s, record.file);
    }
    let start = Start { amplitude_deg: 12.0, hold_s: 1.0, end: End::After(wanted.seconds) };
    let sensor = Sensor { noise_deg: 0.05, rate_hz: wanted.rate_hz, ..Sensor::default() };
    let records = planned
        .par_iter()
        .map(|p| {
            let release = rig.release_with(&p.condition, &p.effects, &start, &sensor, p.seed);
            let samples = release.unwrap().samples;
            let (time_s, yaw_deg) = samples.map(|sample| (sample.time_s, sample.yaw_deg)).unzip();
            Record::new(p.file.clone(), time_s, yaw_deg)
        })
        .collect();
    (describe(&rig, &planned), records)
}

/// The derivatives of a campaign of which nothing is diagnosed.
fn undiagnosed(file: &Campaign, records: &[Record]) -> Option<Vec<Point>> {
    let one = |record| {
        let found = identify(record, &[Method::LeastSquares], &Settings::default());
        Identified::from_identification(found.unwrap()).unwrap()
    };
    let identified: Vec<Identified> = records.par_iter().map(one).collect();
    let computed = Computed::new(file, &identified).ok()?;
    Some(computed.table(Path::new("campaign.toml"), "least-squares").points)
}

fn diagnosed(wanted: &Wanted) -> Diagnosis {
    let (file, records) = planted(wanted);
    let found =
        diagnose(&records, &Grouping::Campaign(&file), &Options::default()).unwrap().diagnosis;
    let before = found.derivatives.as_ref().map(|d| &d.before);
    assert_eq!(before, undiagnosed(&file, &records).as_ref(), "as `derivatives` has them");
    let last = found.steps.last().unwrap();
    println!(
        "{:?} {:?}: {:.3} -> {:.3} times the noise, held out {:.3}; {:?} {:?}",
        found.status,
        found.effects,
        found.steps[0].residual_over_noise,
        last.residual_over_noise,
        last.held_out_over_noise,
        found.origin_reason,
        found.sharing
    );
    found
}

fn origin(found: &Diagnosis, effect: Effect) -> Option<Origin> {
    found.origin.get(effect.id()).copied()
}

/// Root mean square error of Cn_r, Cn_beta over the points.
fn errors(points: &[Point]) -> [f64; 2] {
    let rig = Rig::default();
    let rms = |error: &dyn Fn(&Point) -> f64| {
        (points.iter().map(|p| error(p).powi(2)).sum::<f64>() / points.len() as f64).sqrt()
    };
    let truth = |p: &Point| rig.truth(&Spring::named(&p.spring).unwrap());
    [rms(&|p| p.cn_r.value - truth(p).cn_r), rms(&|p| p.cn_beta.value - truth(p).cn_beta)]
}

#[test]
fn friction_in_every_release_is_mechanical_and_the_derivatives_come_right() {
    let hidden = |_| vec!["coulomb_friction:c=0.05".to_owned()];
    let found = diagnosed(&Wanted { hidden: &hidden, seed: 11, ..Wanted::default() });
    assert_eq!(found.status, Status::Explained);
    assert_eq!(found.effects, [Effect::CoulombFriction]);
    assert_eq!(origin(&found, Effect::CoulombFriction), Some(Origin::Mechanical));
    let last = found.steps.last().unwrap();
    assert!(last.residual_over_noise < 1.05 && last.held_out_over_noise < 1.10);
    let c = last.parameters["coulomb_friction.c"];
    println!("c {c}, truth 0.05");
    assert!((c.value / 0.05 - 1.0).abs() < 0.01, "{c}");
    let derivatives = found.derivatives.unwrap();
    let (before, after) = (errors(&derivatives.before), errors(&derivatives.after));
    println!(
        "rms error of Cn_r {:.5} -> {:.5}, of Cn_beta {:.5} -> {:.5}",
        before[0], after[0], before[1], after[1]
    );
    assert_eq!(derivatives.after.len(), 2);
    assert!(before[0] > 20.0 * after[0], "Cn_r must come at least twenty times closer");
    assert!(before[1] > after[1]);
    // And the intervals are right: an rms error of a coefficient is of the order of its uncertainty.
    assert!(derivatives.after.iter().all(|p| after[0] < 4.0 * p.cn_r.u), "{after:?}");
}

#[test]
fn drag_that_comes_with_the_wind_and_grows_is_aerodynamic() {
    let hidden = |v: f64| match v {
        0.0 => Vec::new(),
        v => vec![format!("quadratic_damping:d={}", 0.03 * v)],
    };
    let wanted =
        Wanted { speeds_m_s: &[0.0, 10.0, 14.0], hidden: &hidden, seed: 12, ..Wanted::default() };
    let found = diagnosed(&wanted);
    assert_eq!(found.effects, [Effect::QuadraticDamping]);
    assert_eq!(origin(&found, Effect::QuadraticDamping), Some(Origin::Aerodynamic));
    assert!(found.origin_reason["quadratic_damping"].contains("grows with speed"));
    let derivatives = found.derivatives.unwrap();
    let (before, after) = (errors(&derivatives.before), errors(&derivatives.after));
    println!("rms error of Cn_r {:.5} -> {:.5}", before[0], after[0]);
    assert_eq!(derivatives.after.len(), 4);
    assert!(before[0] > 20.0 * after[0], "Cn_r must come at least twenty times closer");
}

#[test]
fn what_does_not_grow_with_the_wind_is_undecided() {
    let hidden = |v: f64| if v > 0.0 { vec!["cubic_damping:c=3".to_owned()] } else { Vec::new() };
    let speeds_m_s = &[0.0, 10.0, 14.0];
    let found =
        diagnosed(&Wanted { springs: &["K5"], speeds_m_s, hidden: &hidden, ..Wanted::default() });
    assert_eq!(found.effects, [Effect::CubicDamping]);
    assert_eq!(origin(&found, Effect::CubicDamping), Some(Origin::Undecided));
}

#[test]
fn without_wind_the_origin_is_undecided_and_there_are_no_derivatives() {
    let hidden = |_| vec!["coulomb_friction:c=0.05".to_owned()];
    let (springs, speeds_m_s) = (&["K5"], &[0.0]);
    let wanted = Wanted { springs, speeds_m_s, hidden: &hidden, seed: 13, ..Wanted::default() };
    let found = diagnosed(&wanted);
    assert_eq!(found.effects, [Effect::CoulombFriction]);
    assert_eq!(origin(&found, Effect::CoulombFriction), Some(Origin::Undecided));
    assert!(found.derivatives.is_none());
}

#[test]
fn nothing_hidden_is_adequate_and_the_derivatives_stay() {
    let found = diagnosed(&Wanted { seed: 14, ..Wanted::default() });
    assert_eq!((found.status, found.effects.len()), (Status::Adequate, 0));
    assert!(found.origin.is_empty());
    let derivatives = found.derivatives.unwrap();
    assert_eq!(derivatives.before, derivatives.after);
}

/// A spring's hardening with friction, released twice: both are named, nothing else, and hold in the repeats.
#[test]
fn two_effects_are_both_named_and_hold_in_repeats_left_out() {
    let hidden = |_| vec!["coulomb_friction:c=0.06".to_owned(), "cubic_stiffness:k3=60".to_owned()];
    let springs = &["K3"];
    let found =
        diagnosed(&Wanted { springs, repeats: 2, hidden: &hidden, seed: 15, ..Wanted::default() });
    let mut names = found.effects.clone();
    names.sort();
    assert_eq!(names, [Effect::CoulombFriction, Effect::CubicStiffness]);
    for effect in names {
        assert_eq!(origin(&found, effect.clone()), Some(Origin::Mechanical), "{effect}");
    }
    assert_eq!(found.held_out, HeldOut::Releases);
    assert!(found.steps.last().unwrap().held_out_over_noise < 1.10);
    assert!(found.steps[0].held_out_over_noise > 10.0);
    assert!(found.steps[1].held_out_over_noise > 2.0);
}

/// Each effect once in every release and once with the wind on only: named alone, its origin named. The few
/// by default; all twelve and buffeting:
/// `YAWRIG_ORIGIN=1 cargo test --release -p yawrig --test steps it_is_told -- --nocapture`.
#[test]
fn it_is_told_whether_an_effect_comes_with_the_wind() {
    let all = [
        "static_offset:m=0.3",
        "harmonic_forcing:f=0.2,w=10,phi=0.3",
        "free_play:g=0.003",
        "coulomb_friction:c=0.03",
        "quadratic_damping:d=0.1",
        "cubic_damping:c=1.5",
        "cubic_stiffness:k3=-20",
        "quadratic_stiffness:k2=6",
        "stiffness_drift:e=0.0004",
        "second_mode:amplitude=0.01,phase=0.5,w2=27,zeta2=0.01",
        "sensor_nonlinearity:s=0.1",
        "baseline_drift:d=0.0004",
        "buffeting:q=0.0005",
    ];
    let count = if std::env::var_os("YAWRIG_ORIGIN").is_some() { all.len() } else { 2 };
    let (mut right, mut judged) = (0, 0);
    for (k, text) in all[..count].iter().enumerate() {
        for (always, expected) in [(true, Origin::Mechanical), (false, Origin::Aerodynamic)] {
            let hidden =
                |v: f64| if always || v > 0.0 { vec![(*text).to_owned()] } else { Vec::new() };
            // The origin is told by the wind, which one spring has off and on, too.
            let (springs, seed) = (&["K5"], 51 + k as u64);
            let found = diagnosed(&Wanted { springs, hidden: &hidden, seed, ..Wanted::default() });
            let effect = Effect::from_id(text.split(':').next().unwrap()).unwrap();
            let is_right =
                found.effects == [effect.clone()] && origin(&found, effect) == Some(expected);
            println!("  {text} {expected}: {}", if is_right { "right" } else { "WRONG" });
            right += usize::from(is_right);
            judged += 1;
        }
    }
    println!("named alone, with its origin: {right} of {judged}");
    assert!(10 * right >= 9 * judged);
}

/// A flexible support is the rig's, whatever the wind; a periodic moment may follow the wind's speed, which
/// leaves each release its own.
#[test]
fn releases_share_a_line_s_frequency_where_they_have_the_same() {
    let mode = |_| vec!["second_mode:amplitude=0.01,phase=0.5,w2=27,zeta2=0.01".to_owned()];
    let springs = &["K5"];
    let found = diagnosed(&Wanted { springs, hidden: &mode, seed: 71, ..Wanted::default() });
    assert_eq!((found.status, &found.effects[..]), (Status::Explained, &[Effect::SecondMode][..]));
    assert_eq!(found.sharing["second_mode"], "one for all releases");
    let w2_rad_s = found.steps[1].parameters["second_mode.w2"];
    assert!(w2_rad_s.holds(27.0, 2.0), "{w2_rad_s}");
    let shedding = |v: f64| vec![format!("harmonic_forcing:f=0.2,w={},phi=0.3", 9.5 + 0.1 * v)];
    let found = diagnosed(&Wanted { springs, hidden: &shedding, seed: 72, ..Wanted::default() });
    assert_eq!(found.effects, [Effect::HarmonicForcing]);
    assert_eq!(found.sharing["harmonic_forcing"], "each release its own");
}

/// Prints how long 32 releases of 40 s at 1 kHz take:
/// `YAWRIG_CAMPAIGN_TIME=1 cargo test --release -p yawrig --test steps takes -- --nocapture`.
#[test]
fn a_full_campaign_takes() {
    if std::env::var_os("YAWRIG_CAMPAIGN_TIME").is_none() {
        return;
    }
    let springs = &["K1", "K2", "K3", "K4", "K5", "K6", "K7", "K8"];
    let coulomb = |_| vec!["coulomb_friction:c=0.05".to_owned()];
    for hidden in [NOTHING, &coulomb] {
        let wanted =
            Wanted { springs, seconds: 40.0, rate_hz: 1000.0, hidden, ..Wanted::default() };
        let (file, records) = planted(&wanted);
        let begun = Instant::now();
        let found =
            diagnose(&records, &Grouping::Campaign(&file), &Options::default()).unwrap().diagnosis;
        let seconds = begun.elapsed().as_secs_f64();
        println!("{} releases, {:?}: {seconds:.1} s", records.len(), found.effects);
        assert_eq!(records.len(), 32);
    }
}

#[test]
fn the_command_tells_origin_and_derivatives_as_one_json_object() {
    let folder = tempfile::tempdir().unwrap();
    let yawrig = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_yawrig"))
            .current_dir(folder.path())
            .args(arguments)
            .output()
            .unwrap()
    };
    let (file, _) = planted(&Wanted { springs: &["K5"], seconds: 8.0, ..Wanted::default() });
    // The same four conditions as records on disk.
    for release in &file.release {
        let speed = release.wind_speed_m_s.to_string();
        let axis = release.axis.to_string();
        let out = yawrig(&[
            "simulate",
            "--spring",
            "K5",
            "--axis",
            &axis,
            "--wind",
            &speed,
            "--seconds",
            "8",
            "--out",
            &release.file,
            "--rate-hz",
            "500",
            "--effect",
            "coulomb_friction:c=0.1",
        ]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    std::fs::write(folder.path().join("campaign.toml"), toml::to_string(&file).unwrap()).unwrap();
    let out = yawrig(&["diagnose", "campaign.toml", "--json"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(json["schema_version"], 1);
    assert_eq!(json["status"], "explained");
    assert_eq!(json["effects"], serde_json::json!(["coulomb_friction"]));
    assert_eq!(json["origin"]["coulomb_friction"], "mechanical");
    assert_eq!(json["derivatives"]["before"][0]["spring"], "K5");
    assert_eq!(json["derivatives"]["after"].as_array().unwrap().len(), 1);
    assert_eq!(json["releases"].as_array().unwrap().len(), 4);
    for key in ["noise_rms_deg", "indistinguishable", "modal", "steps", "candidates", "where"] {
        assert!(json.get(key).is_some(), "{key}");
    }
    let out = yawrig(&["diagnose", "campaign.toml"]);
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(text.contains("coulomb_friction is mechanical") && text.contains("after"), "{text}");
    let out = yawrig(&["diagnose", "no.toml"]);
    assert_eq!(out.status.code(), Some(3));
    std::fs::remove_file(folder.path().join(&file.release[2].file)).unwrap();
    let out = yawrig(&["diagnose", "campaign.toml"]);
    assert_eq!(out.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&out.stderr).contains("campaign.toml, line"));
}

/// A first-order lag of the wind's moment, x' = r - (b V/l) x, at two speeds of it and none: nothing but the lag is
/// named, at each speed with its numbers and without wind none, and nothing where the second-order model explains each
/// release.
#[test]
fn a_campaign_of_linear_rigs_whose_wind_lags_names_the_lag_or_nothing() {
    let (a0, a1, a2, b) = (0.50, -0.125, -0.09, 0.55);
    let moment = |yaw: f64, rate: f64, x: f64, v: f64| {
        let damping = if v > 0.0 { per_izz(v, 1) * a1 * rate } else { 0.0 };
        per_izz(v, 2) * (a0 * yaw + a2 * x) + damping
    };
    let state = |_: f64, rate: f64, x: f64, v: f64| rate - b * v / LENGTH_M * x;
    let planted =
        Planted { moment: &moment, state: &state, friction_rad_s2: 0.0, damping_ratio: 0.004 };
    let (soft, mixed) =
        ([("K1", 119.0), ("K3", 306.0), ("K5", 1051.0)], [("K2", 214.0), ("K4", 806.0)]);
    for (springs, speeds_m_s, noise_deg, seed, status) in [
        (&soft[..], &[0.0, 10.0][..], 0.01, 11, "explained"),
        (&mixed[..], &[0.0, 10.0, 14.0], 0.005, 12, "explained"),
        (&mixed[..], &[0.0, 10.0, 14.0], 0.05, 13, "adequate"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let made = Made {
            springs,
            speeds_m_s,
            amplitude_deg: 15.0,
            seconds: 15.0,
            rate_hz: 500.0,
            noise_deg,
            seed,
        };
        by_hand::campaign(folder.path(), &made, &planted);
        let out = Command::new(env!("CARGO_BIN_EXE_yawrig"))
            .current_dir(folder.path())
            .args(["diagnose", "campaign.toml", "--json"])
            .output()
            .unwrap();
        let found: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        println!("{} {} {}", found["status"], found["effects"], found["sentence"]);
        assert_eq!(found["status"], status, "noise {noise_deg}");
        let named: &[&str] = if status == "explained" { &["first_order_lag"] } else { &[] };
        assert_eq!(found["effects"], serde_json::json!(named), "noise {noise_deg}");
        for release in found["releases"].as_array().unwrap() {
            let numbers = &release["parameters"];
            let v = release["wind_speed_m_s"].as_f64().unwrap();
            if named.is_empty() || v == 0.0 {
                assert!(numbers["first_order_lag.a"].is_null());
                continue;
            }
            for (number, truth) in [("a", -a2 * per_izz(v, 2)), ("rate", b * v / LENGTH_M)] {
                let number = &numbers[format!("first_order_lag.{number}")];
                let [value, u] = ["value", "u"].map(|key| number[key].as_f64().unwrap());
                println!("  {v} m/s: {value:.3} ± {u:.3}, off by {:.1} u", (value - truth) / u);
                assert!((value - truth).abs() < 3.0 * u);
            }
        }
    }
}
