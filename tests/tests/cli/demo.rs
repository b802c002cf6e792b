//! `yawrig demo`: the main job against the contract and against the rig's truth.

use serde_json::{json, Value};
use std::sync::OnceLock;
use yawrig_tests::process::{yawrig, Ended};

pub fn demo(arguments: &str) -> Ended {
    yawrig(&format!("demo --json --no-report {arguments}")).run()
}

/// `demo --seed 1`, run once for all tests; that it is the same again to the last bit, `qemu.rs` sees.
pub fn of_seed_1() -> &'static Ended {
    static ENDED: OnceLock<Ended> = OnceLock::new();
    ENDED.get_or_init(|| demo("--seed 1").exits(0))
}

/// Shares by which the table misses the truth, sorted. What is printed has the truth by name, what is kept in order.
fn misses(points: &[Value], field: &str) -> Vec<f64> {
    let mut misses: Vec<f64> = points
        .iter()
        .map(|point| {
            let found = point[field]["value"].as_f64().expect("a quantity");
            let place = usize::from(field == "cn_r");
            let truth = point["truth"][field].as_f64().or_else(|| point["truth"][place].as_f64());
            (found / truth.expect("a number") - 1.0).abs()
        })
        .collect();
    misses.sort_by(f64::total_cmp);
    misses
}

fn within(misses: &[f64], median: f64, worst: f64) {
    let middle = misses.len() / 2;
    let found = 0.5 * (misses[middle - 1] + misses[middle]);
    assert!(found <= median, "median {found} of {misses:?}");
    assert!(misses[misses.len() - 1] <= worst, "{misses:?}");
}

#[test]
fn the_main_job_finds_the_planted_derivatives() {
    let ended = of_seed_1();
    // Results on stdout, one object and nothing else; what goes on meanwhile on stderr.
    ended.says_in_order(&["trained 41-6-2", "device: emulated at /dev/", "flashed and verified"]);
    let object = ended.json();
    assert_eq!(object["device"], "emulated");
    assert!(object["seconds"].as_f64().is_some_and(|seconds| seconds > 0.0));
    assert!(object["report"].is_null());

    let points = object["points"].as_array().expect("points");
    assert_eq!(points.len(), 8);
    for (index, point) in points.iter().enumerate() {
        assert_eq!(point["spring"], format!("K{}", index + 1));
        assert_eq!(point["wind_speed_m_s"], 10.0);
        assert!(point["reduced_frequency"].as_f64().is_some_and(|km| km > 0.0));
        for field in ["cn_beta", "cn_r", "cy_beta", "cy_r"] {
            assert!(point["truth"][field].is_f64(), "{field} of {point}");
            assert!(point[field]["value"].is_f64(), "{field} of {point}");
            assert!(point[field]["u"].as_f64().is_some_and(|u| u > 0.0), "{field} of {point}");
        }
    }
    within(&misses(points, "cn_beta"), 0.02, 0.06);
    within(&misses(points, "cn_r"), 0.04, 0.12);

    let releases = object["releases"].as_array().expect("releases");
    // Eight springs, two axes, wind off and on.
    assert_eq!(releases.len(), 32);
    for release in releases {
        assert!(release["spring"].is_string());
        assert!(["mid", "front"].contains(&release["axis"].as_str().expect("an axis")));
        assert!(release["wind_speed_m_s"].is_f64());
        for field in ["natural_frequency_rad_s", "damping_ratio"] {
            let found = release[field]["value"].as_f64().expect("a quantity");
            let truth = release["truth"][field].as_f64().expect("a number");
            assert!((found / truth - 1.0).abs() < 0.2, "{field} of {release}");
        }
        let windows = release["windows"].as_array().expect("windows");
        assert!(windows.len() >= 2, "{release}");
        for window in windows {
            assert!(window["amplitude_deg"].is_f64() && window["damping_ratio"].is_f64());
            assert!(window["natural_frequency_rad_s"].is_f64());
        }
    }
}

/// Of another seed, which is another noise and as good.
#[test]
fn without_json_a_table_is_printed_as_the_releases_come() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = yawrig("demo --seed 20").in_folder(folder.path()).run().exits(0);
    // It ends with its report, and another demo does not write over it.
    let last = ended.stdout.lines().last().expect("a line");
    assert_eq!(last, "report: yawrig-demo/report.html");
    for kept in ["demo.json", "network.yrn", "report.html"] {
        assert!(folder.path().join("yawrig-demo").join(kept).is_file(), "{kept}");
    }
    let text = std::fs::read_to_string(folder.path().join("yawrig-demo/demo.json")).expect("text");
    let object: Value = serde_json::from_str(&text).expect("JSON");
    let points = object["points"].as_array().expect("points");
    within(&misses(points, "cn_beta"), 0.02, 0.06);
    within(&misses(points, "cn_r"), 0.04, 0.12);
    let again = yawrig("demo --out yawrig-demo").in_folder(folder.path()).run().exits(2).helps();
    assert!(!again.stderr.contains("trained"), "{}", again.report());
    assert!(!ended.stdout.contains("± 0.0000000 ") && !ended.stdout.contains("± 0.00000 "));
    for words in ["K1 mid   wind off", "K8 front wind on", "Cn_beta", "truth", "per radian"] {
        assert!(ended.stdout.contains(words), "{words:?} is missing from {}", ended.report());
    }
}

#[test]
fn a_release_without_an_estimate_gives_no_table_and_says_so() {
    // Spring K1 is all but too weak for this wind: its damping ratio is 0.45, and nothing is to be fitted.
    let ended = demo("--wind 18.54").exits(6).helps();
    let ended = ended.says("no table").says("K1 mid   wind on (too_few_cycles");
    let object = ended.json();
    assert_eq!(object["points"], json!([]));
    let releases = object["releases"].as_array().expect("releases");
    assert_eq!(releases.len(), 32);
    let empty: Vec<_> = releases.iter().filter(|r| r["windows"] == json!([])).collect();
    assert!(!empty.is_empty());
    for release in empty {
        assert!(release["natural_frequency_rad_s"].is_null(), "{release}");
        assert!(release["damping_ratio"].is_null(), "{release}");
        assert!(!release["flags"].as_array().expect("flags").is_empty(), "{release}");
        assert!(!release["flags"].to_string().contains("out_of_trained_range"), "{release}");
    }
}

#[test]
fn a_release_without_windows_counts_by_its_refined_estimate() {
    // Spring K1 is too weak for the network in this wind: three cycles last longer than the device remembers.
    let object = demo("--wind 18").exits(0).json();
    let releases = object["releases"].as_array().expect("releases");
    let empty: Vec<_> = releases.iter().filter(|r| r["windows"] == json!([])).collect();
    assert!(!empty.is_empty());
    for release in empty {
        assert!(release["natural_frequency_rad_s"].is_null(), "{release}");
        assert_eq!(release["refined"]["usable"], true, "{release}");
    }
    let points = object["points"].as_array().expect("points");
    assert_eq!(points.len(), 8);
    within(&misses(points, "cn_beta"), 0.02, 0.06);
    within(&misses(points, "cn_r"), 0.04, 0.12);
}

#[test]
fn a_table_too_far_from_the_truth_is_printed_and_ends_with_6() {
    // Noise alone is no reason: at 10 m/s the refined estimates get by with 1 deg. At 1 m/s the wind's share
    // is 1/100.
    let ended = demo("--noise-deg 1 --wind 1").exits(6).says("miss the rig's truth").helps();
    assert_eq!(ended.json()["points"].as_array().map(Vec::len), Some(8));
}

#[test]
fn what_makes_no_sense_is_refused_before_the_training() {
    for arguments in ["--wind 0", "--wind=-5", "--wind nan", "--wind 1e9", "--noise-deg 2"] {
        let ended = demo(arguments).exits(2).helps();
        assert!(!ended.stderr.contains("trained"), "{}", ended.report());
        assert_eq!(ended.stdout, "");
    }
}
