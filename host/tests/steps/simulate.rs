//! `yawrig simulate` as a user runs it.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn yawrig(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_yawrig")).arg("simulate").args(arguments).output().unwrap()
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn one_record_with_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("k4.csv");
    let name = file.to_str().unwrap();
    let arguments =
        ["--spring", "K4", "--wind", "10", "--axis", "mid", "--offset-deg", "3", "--json"];
    let said = json(&yawrig(&[&arguments[..], &["--out", name]].concat()));
    assert_eq!(said["schema_version"], 1);
    assert_eq!(said["truth"]["cn_beta"], 0.5462);
    let record = yawrig_records::read(&file).unwrap();
    assert_eq!(record.len() as u64, said["samples"].as_u64().unwrap());
    assert!((record.timing().rate_hz - 1000.0).abs() < 1e-6);
    let held = record.yaw_deg[..2000].iter().sum::<f64>() / 2000.0;
    assert!((held - 18.0).abs() < 0.01, "{held}");

    let again = yawrig(&[&arguments[..], &["--out", name]].concat());
    assert_eq!(again.status.code(), Some(2), "does not overwrite");
    assert!(String::from_utf8_lossy(&again.stderr).contains("--force"));
    let before = std::fs::read(&file).unwrap();
    json(&yawrig(&[&arguments[..], &["--out", name, "--force"]].concat()));
    assert_eq!(std::fs::read(&file).unwrap(), before, "one seed, one record");
}

#[test]
fn a_campaign_with_repeats() {
    let folder = tempfile::tempdir().unwrap();
    let campaign = folder.path().join("c");
    let arguments =
        ["--campaign", campaign.to_str().unwrap(), "--repeats", "2", "--rate-hz", "100", "--json"];
    let said = json(&yawrig(&arguments));
    assert_eq!(said["points"].as_array().unwrap().len(), 8);
    assert_eq!(said["releases"].as_array().unwrap().len(), 64);
    let first = yawrig_records::read(&campaign.join("K1-mid-off.csv")).unwrap();
    let second = yawrig_records::read(&campaign.join("K1-mid-off-2.csv")).unwrap();
    assert_ne!(first.yaw_deg, second.yaw_deg, "repeats have noise of their own");
    assert_eq!(yawrig(&arguments).status.code(), Some(2));
}

#[test]
fn wrong_arguments_name_their_flag() {
    for (arguments, exit, words) in [
        (&["--out", "x.csv", "--spring", "K9"][..], 2, "K1 to K8"),
        (&["--out", "x.csv", "--spring", "K1", "--noise-deg", "nan"], 2, "--noise-deg"),
        (&["--out", "x.csv", "--spring", "K1", "--rate-hz", "5"], 2, "--rate-hz"),
        (&["--out", "x.csv", "--spring", "K1", "--wind", "40"], 2, "--wind"),
        (&["--out", "x.csv", "--spring", "K1", "--amplitude-deg", "0.5"], 2, "--amplitude-deg"),
        (&["--out", "x.csv", "--natural-frequency", "7"], 2, "--damping"),
        (&["--out", "x.csv", "--spring", "K1", "--effect", "rust:c=1"], 2, "stiffness_drift"),
        (&["--out", "x.csv", "--spring", "K1", "--effect", "free_play:c=1"], 2, "takes g (rad)"),
        (&["--out", "x.csv", "--spring", "K1", "--effect", "free_play"], 2, "g is missing"),
        (&["--out", "x.csv", "--spring", "K1", "--effect", "buffeting:q=-1"], 2, "q=-1"),
        (&["--out", "x.csv", "--spring", "K1", "--effect", "buffeting:q=inf"], 2, "q=inf"),
        (&["--out", "absent/x.csv", "--spring", "K1"], 3, "absent/x.csv"),
    ] {
        let output = yawrig(arguments);
        assert_eq!(output.status.code(), Some(exit), "{arguments:?}");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
    assert!(!Path::new("x.csv").exists());
}

/// FNV-1a of the 64-bit kind.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, byte| {
        (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// As written before there were effects. Without noise nothing but sums and products is in it, the same
/// anywhere.
#[test]
fn a_record_without_effects_is_what_it_always_was() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("x.csv");
    let said = json(&yawrig(&[
        "--natural-frequency",
        "7.5",
        "--damping",
        "0.012",
        "--noise-deg",
        "0",
        "--seconds",
        "20",
        "--json",
        "--out",
        file.to_str().unwrap(),
    ]));
    assert_eq!(checksum(&std::fs::read(&file).unwrap()), 0xc038_ab40_d46c_1ba8);
    assert_eq!(said["truth"]["effects"], serde_json::json!([]));
}

#[test]
fn hidden_effects_are_told_as_truth() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("x.csv");
    let arguments = [
        "--natural-frequency",
        "7.5",
        "--damping",
        "0.012",
        "--json",
        "--force",
        "--out",
        file.to_str().unwrap(),
        "--effect",
        "coulomb_friction:c=0.12",
        "--effect",
        "harmonic_forcing:f=0.02,w=11,phi=-0.5",
    ];
    let said = json(&yawrig(&arguments));
    let parameters = serde_json::json!({
        "coulomb_friction.c": 0.12,
        "harmonic_forcing.f": 0.02, "harmonic_forcing.w": 11.0, "harmonic_forcing.phi": -0.5,
    });
    assert_eq!(
        said["truth"]["effects"],
        serde_json::json!(["coulomb_friction", "harmonic_forcing"])
    );
    assert_eq!(said["truth"]["parameters"], parameters);
    let first = std::fs::read(&file).unwrap();
    json(&yawrig(&arguments));
    assert_eq!(std::fs::read(&file).unwrap(), first, "one seed, one record");
}

/// In every release of a campaign; what suits not all of them is refused before anything is written.
#[test]
fn a_campaign_with_effects() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, effects: &[&str]| {
        let to = folder.path().join(name);
        let common = ["--campaign", to.to_str().unwrap(), "--rate-hz", "100", "--json"];
        yawrig(&[&common[..], effects].concat())
    };
    json(&write("plain", &[]));
    let said = json(&write("rough", &["--effect", "coulomb_friction:c=0.1"]));
    let releases = said["releases"].as_array().unwrap();
    assert_eq!(releases.len(), 32);
    for release in releases {
        assert_eq!(release["truth"]["parameters"]["coulomb_friction.c"], 0.1);
        let file = release["file"].as_str().unwrap();
        let length =
            |name| yawrig_records::read(&folder.path().join(name).join(file)).unwrap().len();
        assert!(length("rough") < length("plain"), "{file}");
    }
    let said = json(&write("windy", &["--effect", "coulomb_friction:c=0.1", "--aerodynamic"]));
    for release in said["releases"].as_array().unwrap() {
        let wind = release["wind_speed_m_s"].as_f64().unwrap() > 0.0;
        assert_eq!(release["truth"]["effects"].as_array().unwrap().len(), usize::from(wind));
        let file = release["file"].as_str().unwrap();
        let read = |name| std::fs::read(folder.path().join(name).join(file)).unwrap();
        assert!(read("windy") == read(if wind { "rough" } else { "plain" }), "{file}");
    }
    let refused = write("none", &["--effect", "harmonic_forcing:f=0.1,w=12,phi=0"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("K4-mid-off.csv"));
    assert!(!folder.path().join("none").exists());
}

/// Begins a campaign in `folder` and stops it once it has written a record.
fn interrupted(folder: &Path, more: &[&str]) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_yawrig"))
        .args(["simulate", "--repeats", "100", "--campaign", folder.to_str().unwrap()])
        .args(more)
        .spawn()
        .unwrap();
    while !folder.join("K1-mid-off.csv").exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended before it wrote anything");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let id = nix::unistd::Pid::from_raw(child.id() as i32);
    nix::sys::signal::kill(id, nix::sys::signal::Signal::SIGINT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn an_interrupted_campaign_is_gone_and_what_was_there_stays() {
    let folder = tempfile::tempdir().unwrap();
    let new = folder.path().join("new");
    interrupted(&new, &[]);
    assert!(!new.exists());
    let old = folder.path().join("old");
    std::fs::create_dir(&old).unwrap();
    std::fs::write(old.join("notes.txt"), "mine").unwrap();
    interrupted(&old, &[]);
    let left: Vec<_> = std::fs::read_dir(&old).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["notes.txt"]);
}

/// Stopped while it writes over others, it leaves whole records, and no temporary file.
#[test]
fn an_interrupted_campaign_leaves_no_half_written_file() {
    let folder = tempfile::tempdir().unwrap();
    let campaign = folder.path().join("c");
    interrupted(&campaign, &["--force"]);
    assert!(!campaign.join("campaign.toml").exists());
    for entry in std::fs::read_dir(&campaign).unwrap() {
        let file = entry.unwrap().path();
        assert_eq!(file.extension().unwrap(), "csv", "{}", file.display());
        let amplitude = yawrig_records::read(&file)
            .unwrap()
            .yaw_deg
            .iter()
            .rev()
            .take(200)
            .fold(0.0f64, |a, y| a.max(y.abs()));
        assert!(amplitude < 1.5, "{} is cut short", file.display());
    }
}
