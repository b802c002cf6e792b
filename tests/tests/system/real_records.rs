//! Records that other people measured, read from the folder YAWRIG_RECORDS where that is set; skipped
//! elsewhere.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{identify, Estimate, Identification, Method, Settings};
use yawrig_tests::process::yawrig;

fn found(name: &str) -> Option<Identification> {
    let Some(folder) = std::env::var_os("YAWRIG_RECORDS") else {
        eprintln!("YAWRIG_RECORDS is not set: {name} skipped");
        return None;
    };
    let record = yawrig_records::read(&PathBuf::from(folder).join(name)).unwrap();
    Some(identify(&record, &[Method::LeastSquares], &Settings::default()).unwrap())
}

fn check(e: &Estimate, wn: RangeInclusive<f64>, zeta: RangeInclusive<f64>) {
    assert!(wn.contains(&e.natural_frequency_rad_s.value), "{e:?}");
    assert!(zeta.contains(&e.damping_ratio.value), "{e:?}");
}

#[test]
fn ship_roll_decay() {
    let Some(found) = found("kvlcc2_21338.csv") else { return };
    let e = &found.estimates[0];
    check(e, 2.45..=2.49, 0.0042..=0.0067);
    assert!(e.flags.contains(&Flag::AmplitudeDependentDamping));
    // Damping large, small, a little larger again.
    let at = |from: f64, to: f64| {
        let inside: Vec<f64> = e
            .windows
            .iter()
            .filter(|w| (to..from).contains(&w.amplitude_deg))
            .map(|w| w.damping_ratio)
            .collect();
        inside.iter().sum::<f64>() / inside.len() as f64
    };
    let (large, middle, small) = (at(9.0, 6.0), at(4.0, 2.4), at(1.8, 1.0));
    println!("zeta {large:.4} {middle:.4} {small:.4}");
    assert!((large - 0.0067).abs() < 0.0004 && (middle - 0.0042).abs() < 0.0002);
    assert!((small - 0.0046).abs() < 0.0002);
}

#[test]
fn rotary_pendulum_pushed_at_the_start() {
    let Some(found) = found("jensen_1.csv") else { return };
    let e = &found.estimates[0];
    check(e, 8.8..=10.6, 0.02..=0.04);
    for flag in
        [Flag::PushedAtStart, Flag::AmplitudeOutsideWindow, Flag::AmplitudeDependentFrequency]
    {
        assert!(e.flags.contains(&flag), "{:?}", e.flags);
    }
    assert!(e.windows.iter().all(|w| (8.8..=10.6).contains(&w.natural_frequency_rad_s)));
    assert!(e
        .windows
        .windows(2)
        .all(|w| w[0].natural_frequency_rad_s < w[1].natural_frequency_rad_s));
}

#[test]
fn wheel_on_a_torsion_rod() {
    let Some(found) = found("wheel_torsion.csv") else { return };
    let e = &found.estimates[0];
    check(e, 14.905..=14.915, 0.0145..=0.0155);
    assert!((found.window.cycles - 4.75).abs() < 0.3, "{:?}", found.window);
}

#[test]
fn bicycle_fork_with_offset_and_friction() {
    let Some(found) = found("bike_fork.csv") else { return };
    let e = &found.estimates[0];
    check(e, 3.94..=3.96, 0.0069..=0.0133);
    assert!(e.flags.contains(&Flag::AmplitudeDependentDamping));
    assert!(e.windows.windows(2).all(|w| w[0].damping_ratio < w[1].damping_ratio));
    assert!((e.windows[0].damping_ratio - 0.0069).abs() < 0.0005);
}

#[test]
fn string_pendulum_at_20_hz_with_jitter() {
    let Some(found) = found("tyler_lab1.csv") else { return };
    let e = &found.estimates[0];
    check(e, 3.73..=3.85, 0.002..=0.006);
    for flag in
        [Flag::IrregularTimeStamps, Flag::AmplitudeOutsideWindow, Flag::AmplitudeDependentDamping]
    {
        assert!(e.flags.contains(&flag), "{:?}", e.flags);
    }
    assert!((found.window.from_deg - 40.0).abs() < 2.0 && (found.window.to_deg - 10.5).abs() < 1.0);
}

/// None where there are none beside the project.
fn records() -> Vec<PathBuf> {
    let Some(folder) = std::env::var_os("YAWRIG_RECORDS") else {
        eprintln!("YAWRIG_RECORDS is not set: skipped");
        return Vec::new();
    };
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "csv"));
    files.sort();
    assert!(!files.is_empty(), "no records in YAWRIG_RECORDS");
    files
}

fn name(file: &std::path::Path) -> String {
    file.file_name().unwrap().to_string_lossy().into_owned()
}

/// The first three effects that `diagnose` names, in all six orders: the residual is the same to 1 %.
#[test]
fn effects_added_in_any_order_fit_alike_at_full_size() {
    const ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [2, 0, 1], [2, 1, 0], [0, 2, 1], [1, 0, 2], [1, 2, 0]];
    let mut apart = Vec::new();
    for file in records() {
        let found = yawrig("diagnose --json").and(&file).run().json();
        let effects = found["effects"].as_array().expect("effects").iter();
        let effects: Vec<&str> = effects.filter_map(|e| e.as_str()).collect();
        let of_rest = effects.contains(&"static_offset");
        let named: Vec<&str> =
            effects.into_iter().filter(|e| *e != "static_offset").take(3).collect();
        let residual = |order: &[usize; 3]| {
            let mut compared = yawrig("compare --json").and(&file);
            if of_rest {
                compared = compared.and("--unknown-zero");
            }
            for &k in order.iter().filter(|k| **k < named.len()) {
                compared = compared.and("--effect").and(named[k]);
            }
            let said = compared.run().exits(0).json();
            said["residual_over_noise"].as_f64().expect("a residual")
        };
        let all: Vec<f64> = ORDERS.iter().map(residual).collect();
        let (least, most) = all.iter().fold((f64::MAX, 0.0f64), |m, r| (m.0.min(*r), m.1.max(*r)));
        println!("{}: {}, {least:.4} to {most:.4}", name(&file), named.join(" "));
        if most > 1.01 * least {
            apart.push(format!("{}: {all:.3?}", name(&file)));
        }
    }
    assert!(apart.is_empty(), "{}", apart.join("\n"));
}

/// Residual and held out over the noise of each record: second order, the best formula, the law as it was
/// measured.
/// `YAWRIG_RECORDS=... YAWRIG_TABLES=1 cargo test --release -p yawrig-tests --test system plain_named -- --nocapture`.
#[test]
fn plain_named_and_measured() {
    if std::env::var_os("YAWRIG_TABLES").is_none() {
        eprintln!("a table to be looked at, minutes: set YAWRIG_TABLES for it");
        return;
    }
    let out = tempfile::tempdir().expect("a folder");
    println!("record: second order, best formula, measured; each residual and held out");
    for file in records() {
        let name = name(&file);
        let ended = yawrig("law --json").and(&file).in_folder(out.path()).run();
        if ended.code != 0 {
            println!("{name}: {}", ended.stderr.lines().next().unwrap_or_default());
            continue;
        }
        let found = ended.json();
        let both = |of: &serde_json::Value| {
            let number = |key: &str| of[key].as_f64().unwrap_or(f64::NAN);
            format!("{:.2} {:.2}", number("residual_over_noise"), number("held_out_over_noise"))
        };
        let best = &found["names"][0];
        let (form, memory) = (best["form"].as_str().unwrap_or("none"), &found["memory"]);
        let [plain, named, measured] = [&found["without"], best, &found].map(both);
        println!("{name}: {plain}; {form} {named}; {measured}; memory {memory}");
    }
}
