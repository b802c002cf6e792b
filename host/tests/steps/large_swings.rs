//! Swings as they are measured: large angles, a rest off the sensor's zero, steps of a coarse sensor, and
//! more than one loss at once. The truth is integrated by Runge-Kutta steps of its own, friction as a sign.

use serde_json::Value;
use std::process::Command;
use std::slice::from_ref;
use yawrig_core::diagnosis::diagnose::{diagnose, Grouping, Options, Status};
use yawrig_core::effects::Effect;
use yawrig_core::record::Record;
use yawrig_model::comparison::{compare, Comparison};
use yawrig_model::effects;

const WN: f64 = 5.5;
const FRICTION: f64 = 0.15;
const DRAG: f64 = 0.02;
const ZETA: f64 = 0.001;
const REST_DEG: f64 = 3.0;

fn losses(_: f64, r: f64) -> f64 {
    -DRAG * r.abs() * r - FRICTION * r.signum()
}

/// A pendulum let go at `release_deg`, read in steps of `step_deg` at 150 Hz until it rests.
fn pendulum(release_deg: f64, step_deg: f64, losses: impl Fn(f64, f64) -> f64) -> Record {
    let moment = |b: f64, r: f64| -WN * WN * b.sin() - 2.0 * ZETA * WN * r + losses(b, r);
    let h = 1.0 / 150.0 / 40.0;
    let (mut b, mut r) = (release_deg.to_radians(), 0.0_f64);
    let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
    for k in 0..6000 {
        time_s.push(f64::from(k) / 150.0);
        yaw_deg.push(((b.to_degrees() + REST_DEG) / step_deg).round() * step_deg);
        for _ in 0..40 {
            let at = |s: (f64, f64), w: f64| (b + w * s.0, r + w * s.1);
            let f = |(b, r): (f64, f64)| (r, moment(b, r));
            let k1 = f((b, r));
            let k2 = f(at(k1, 0.5 * h));
            let k3 = f(at(k2, 0.5 * h));
            let k4 = f(at(k3, h));
            b += h / 6.0 * (k1.0 + 2.0 * k2.0 + 2.0 * k3.0 + k4.0);
            r += h / 6.0 * (k1.1 + 2.0 * k2.1 + 2.0 * k3.1 + k4.1);
        }
        if b.abs() < 4f64.to_radians() && r.abs() < 4f64.to_radians() * WN {
            break;
        }
    }
    Record::new("pendulum.csv", time_s, yaw_deg)
}

#[test]
fn a_pendulum_from_120_deg_is_taken_apart() {
    let found = diagnose(
        from_ref(&pendulum(120.0, 0.18, losses)),
        &Grouping::default(),
        &Options::default(),
    )
    .expect("a swing")
    .diagnosis;
    println!("{:?} {:?} {:?}", found.status, found.effects, found.sentence);
    for effect in [Effect::PendulumGravity, Effect::CoulombFriction, Effect::QuadraticDamping] {
        assert!(found.effects.contains(&effect), "{effect}");
    }
    assert!(matches!(found.status, Status::Explained | Status::MostlyExplained));
    let last = found.steps.last().expect("a step");
    let near = |name: &str, truth: f64, share: f64| {
        let value = last.parameters[name].value;
        assert!((value / truth - 1.0).abs() < share, "{name}: {value} for {truth}");
    };
    near("coulomb_friction.c", FRICTION, 0.05);
    near("quadratic_damping.d", DRAG, 0.1);
    near("pendulum_gravity.g", WN * WN, 0.02);
    let wn = found.modal.unwrap().natural_frequency_rad_s.value;
    assert!((wn / WN - 1.0).abs() < 2e-3, "{wn}");
    let rest = found.only().unwrap().rest_angle_deg.expect("a rest angle").value;
    assert!((rest - REST_DEG).abs() < 0.05, "{rest}");
    let held: Vec<f64> = found.steps.iter().map(|s| s.held_out_over_noise).collect();
    println!("held out over noise {held:.3?}");
    assert!(held.windows(2).all(|h| h[1] <= h[0]));
}

/// The sensor's steps are the floor for every verb, and what acts about the angle of rest is fitted so by the
/// command that `diagnose` prints: it leaves what the diagnosis left, with its natural frequency.
#[test]
fn the_command_that_a_diagnosis_prints_fits_the_same_model() {
    let folder = tempfile::tempdir().unwrap();
    let record = pendulum(100.0, 0.3, losses);
    let rows = record.time_s.iter().zip(&record.yaw_deg);
    let rows: String = rows.map(|(t, y)| format!("{t},{y}\n")).collect();
    std::fs::write(folder.path().join("swing.csv"), format!("time_s,yaw_deg\n{rows}")).unwrap();
    let said = |arguments: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_yawrig"));
        let out = program.current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    let json = |arguments: &[&str]| -> Value { serde_json::from_str(&said(arguments)).unwrap() };
    let found = json(&["diagnose", "swing.csv", "--json"]);
    assert_eq!(found["about_rest"], true);
    let text = said(&["diagnose", "swing.csv"]);
    let command = text.lines().find_map(|line| line.split_once("the same model: yawrig "));
    let command = command.unwrap_or_else(|| panic!("no command in {text}")).1;
    let arguments: Vec<&str> = command.split(' ').chain(["--json"]).collect();
    let same = json(&arguments);
    let last = &found["steps"].as_array().unwrap().last().unwrap()["residual_over_noise"];
    let both = |left: &Value, right: &Value| [left, right].map(|x| x.as_f64().expect("a number"));
    let [diagnosed, compared] = both(last, &same["residual_over_noise"]);
    println!("{command}: {compared} times the noise, diagnosed {diagnosed}");
    assert!((compared / diagnosed - 1.0).abs() < 0.02);
    let wn = |said: &Value| said["modal"]["natural_frequency_rad_s"]["value"].clone();
    let [diagnosed, compared] = both(&wn(&found), &wn(&same));
    assert!((compared / diagnosed - 1.0).abs() < 1e-4, "{compared} {diagnosed}");
}

/// Nothing was recorded for two cycles: what lies before them and after is one rig's, and both are used.
#[test]
fn a_record_with_a_gap_is_judged_from_both_sides_of_it() {
    let mut record = pendulum(120.0, 0.18, losses);
    let (from, to) = (2 * record.len() / 5, 2 * record.len() / 5 + 350);
    record.time_s.drain(from..to);
    record.yaw_deg.drain(from..to);
    let diagnosed =
        diagnose(from_ref(&record), &Grouping::default(), &Options::default()).expect("a swing");
    let found = diagnosed.diagnosis;
    println!("{:?} {:?} {}", found.status, found.effects, found.sentence);
    for effect in [Effect::PendulumGravity, Effect::CoulombFriction, Effect::QuadraticDamping] {
        assert!(found.effects.contains(&effect), "{effect}");
    }
    let files: Vec<&str> = found.releases.iter().map(|r| r.file.as_str()).collect();
    let said = diagnosed.decays[0].warnings.iter().map(ToString::to_string).collect::<String>();
    println!("{files:?} {said}");
    assert!(matches!(&files[..], [a, b] if a.contains("(0.000 s to") && b.ends_with("s)")));
    assert!(said.contains("the 2 parts between them are judged as releases of one rig"));
    let wn = found.modal.expect("one rig").natural_frequency_rad_s.value;
    assert!((wn / WN - 1.0).abs() < 2e-3, "{wn}");
    // Released again after the gap it is two releases, of which one is judged.
    let again = pendulum(90.0, 0.18, losses);
    let mut two = pendulum(120.0, 0.18, losses);
    let later_s = two.time_s[two.len() - 1] + 5.0;
    two.time_s.extend(again.time_s.iter().map(|t| t + later_s));
    two.yaw_deg.extend(again.yaw_deg);
    let found = diagnose(from_ref(&two), &Grouping::default(), &Options::default());
    assert_eq!(found.expect("a swing").diagnosis.releases.len(), 1);
}

/// Friction that grows with the square of the angle, which the library has not.
#[test]
fn an_effect_of_ones_own_is_named_where_the_library_has_none() {
    let record = pendulum(120.0, 0.18, |b, r| -FRICTION * (0.2 + 4.0 * b * b) * (r / 0.2).tanh());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rubbing.toml");
    let text =
        "id = \"rubbing\"\ntitle = \"Rubbing\"\nmoment = \"-c * (a + b^2) * tanh(r / 0.2)\"\n\
                [parameters]\nc = { unit = \"rad/s2\", start = 0.1, min = 0.0 }\n\
                a = { unit = \"1\", start = 0.1, min = 0.0 }\n";
    std::fs::write(&file, text).unwrap();
    let own = effects::load(&file).unwrap_or_else(|e| panic!("{e}"));
    let options = Options { own: vec![own.clone()], ..Options::default() };
    let (without, with) = (Options::default(), options);
    let left = |options: &Options| {
        let found =
            diagnose(from_ref(&record), &Grouping::default(), options).expect("a swing").diagnosis;
        println!("{:?} {:?} {:?}", found.status, found.effects, found.sentence);
        (found.effects, found.left.rms_deg)
    };
    let (library, library_deg) = left(&without);
    let (effects, left_deg) = left(&with);
    assert!(!library.contains(&own) && effects.contains(&own), "{effects:?}");
    assert!(effects.contains(&Effect::PendulumGravity) && effects.len() <= library.len());
    assert!(left_deg < 0.5 * library_deg, "{left_deg} and {library_deg}");
}

#[test]
fn the_order_in_which_effects_are_asked_for_changes_nothing() {
    let record = pendulum(120.0, 0.18, losses);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pendulum.csv");
    let rows = record.time_s.iter().zip(&record.yaw_deg).map(|(t, y)| format!("{t},{y}\n"));
    std::fs::write(&file, format!("time_s,yaw_deg\n{}", rows.collect::<String>())).unwrap();
    let (sine, rubs, drag) =
        (Effect::PendulumGravity, Effect::CoulombFriction, Effect::QuadraticDamping);
    let orders = [
        [&sine, &rubs, &drag],
        [&sine, &drag, &rubs],
        [&rubs, &sine, &drag],
        [&rubs, &drag, &sine],
        [&drag, &sine, &rubs],
        [&drag, &rubs, &sine],
    ];
    let residuals = orders.map(|order| {
        let effects = order.into_iter().cloned().collect();
        let files = vec![file.clone()];
        let asked = Comparison { files, effects, unknown_zero: true, ..Comparison::default() };
        let found = compare(&asked).unwrap_or_else(|e| panic!("{order:?}: {e}"));
        found.appraisal.residuals.residual_over_noise
    });
    println!("{residuals:.4?}");
    assert!(residuals.iter().all(|r| (r / residuals[0] - 1.0).abs() < 0.01), "{residuals:?}");
}

/// Two modes 12 % apart, and 15 % below: one second mode, though the first is near.
#[test]
fn two_modes_that_beat_are_told_apart() {
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;
    for (seed, ratio) in [(1, 1.12), (2, 0.85), (3, 1.25)] {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let decaying = |a: f64, w: f64, t: f64| a * (-0.004 * w * t).exp() * (w * t).cos();
        let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) / 240.0).collect();
        let yaw_deg = time_s
            .iter()
            .map(|t| {
                let noise: f64 = rng.sample(StandardNormal);
                decaying(8.0, 6.0, *t) + decaying(3.0, ratio * 6.0, *t) + 0.04 * noise
            })
            .collect();
        let record = Record::new("beats.csv", time_s, yaw_deg);
        let found = diagnose(from_ref(&record), &Grouping::default(), &Options::default())
            .expect("a swing")
            .diagnosis;
        println!("{ratio}: {:?} {:?}", found.status, found.effects);
        assert_eq!(found.effects, [Effect::SecondMode]);
        assert_eq!(found.status, Status::Explained);
        let w2_rad_s = found.steps[1].parameters["second_mode.w2"];
        assert!((w2_rad_s.value - ratio * 6.0).abs() < 4.0 * w2_rad_s.u, "{w2_rad_s}");
    }
}
