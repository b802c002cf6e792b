//! The circle closed: friction hidden in the virtual rig's releases, found by the fit, learnt by a network, and gone
//! from the device's damping ratio.
//!
//! The releases are the rig's own integration through its sensor; the network's windows are of another integrator.

use serde_json::Value;
use std::path::Path;
use yawrig_tests::process::yawrig;

/// Springs with friction of c / wn^2 from 0.1 to 0.2 deg with the wind off, c in rad/s2.
const SPRINGS: [(&str, f64); 4] = [("K1", 0.042), ("K3", 0.159), ("K5", 0.724), ("K8", 1.35)];

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// What the device makes of a record.
struct Estimate {
    damping_ratio: f64,
    windows: usize,
    trends: usize,
}

fn device(folder: &Path, record: &str, network: &str) -> Estimate {
    let replay = yawrig("replay --json --network").in_folder(folder).and(network).and(record);
    let object = replay.run().exits(0).json();
    let estimate = &object["records"][0]["estimates"][0];
    let count = |field: &str| estimate[field].as_array().expect("a list").len();
    for window in estimate["windows"].as_array().expect("windows") {
        for field in ["amplitude_deg", "natural_frequency_rad_s", "damping_ratio"] {
            assert!(number(&window[field]) > 0.0, "{window}");
        }
    }
    Estimate {
        damping_ratio: number(&estimate["damping_ratio"]["value"]),
        windows: count("windows"),
        trends: count("trends"),
    }
}

#[test]
fn a_network_that_has_learnt_the_friction_is_five_times_nearer_the_damping() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let train = "train --samples 3000 --epochs 200";
    let run = |command: &str| yawrig(command).in_folder(folder).run().exits(0);
    run(&format!("{train} --out plain.yrn"));
    let (mut plain_square, mut learnt_square, mut count) = (0.0, 0.0, 0);
    println!("spring wind    wn     zeta     c/wn2    plain error  learnt error  windows");
    for (seed, (spring, c)) in (1..).zip(SPRINGS) {
        let mut truths = Vec::new();
        for wind in [0, 10] {
            let object = run(&format!(
                "simulate --json --spring {spring} --wind {wind} --effect coulomb_friction:c={c} \
                 --seed {} --out {spring}-{wind}.csv",
                10 * seed + wind
            ))
            .json();
            truths.push((wind, object));
        }
        // Only the wind-off release is fitted; the other is to be measured.
        run(&format!("fit {spring}-0.csv --model {spring}.toml"));
        run(&format!("add coulomb_friction --model {spring}.toml"));
        run(&format!("{train} --model {spring}.toml --out {spring}.yrn"));
        for (wind, truth) in truths {
            let wn = number(&truth["truth"]["natural_frequency_rad_s"]);
            let zeta = number(&truth["truth"]["damping_ratio"]);
            let record = format!("{spring}-{wind}.csv");
            let plain = device(folder, &record, "plain.yrn");
            let learnt = device(folder, &record, &format!("{spring}.yrn"));
            let errors = [&plain, &learnt].map(|e| e.damping_ratio - zeta);
            println!(
                "{spring:6} {wind:4} {wn:7.3} {zeta:8.5} {:7.3} deg  {:+.6}    {:+.6}     {}",
                (c / (wn * wn)).to_degrees(),
                errors[0],
                errors[1],
                plain.windows
            );
            assert!(plain.damping_ratio > zeta, "friction damps");
            assert!(errors[1].abs() * 5.0 <= errors[0].abs(), "{spring} at {wind} m/s");
            assert!(plain.windows < 4 || plain.trends > 0, "{spring} at {wind} m/s: no trend seen");
            plain_square += errors[0] * errors[0];
            learnt_square += errors[1] * errors[1];
            count += 1;
        }
    }
    let rms = |square: f64| (square / f64::from(count)).sqrt();
    let (plain, learnt) = (rms(plain_square), rms(learnt_square));
    println!(
        "rms error of the damping ratio over {count} releases: {plain:.6} with the network of the plain model, \
         {learnt:.6} with those of the model with friction: {:.0} times less",
        plain / learnt
    );
    assert!(learnt * 5.0 <= plain);
}
