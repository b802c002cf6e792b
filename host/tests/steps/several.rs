//! `yawrig diagnose A.csv B.csv`: releases of one rig judged as one, as a user runs it.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn yawrig(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_yawrig")).current_dir(folder).args(arguments).output().unwrap()
}

/// Two releases of one spring with a rubbing cable, from 15 and from 8 deg.
fn releases(folder: &Path) {
    for (file, amplitude_deg, seed) in [("a.csv", "15", "1"), ("b.csv", "8", "2")] {
        let out = yawrig(
            folder,
            &[
                "simulate",
                "--spring",
                "K4",
                "--amplitude-deg",
                amplitude_deg,
                "--seed",
                seed,
                "--effect",
                "coulomb_friction:c=0.1",
                "--out",
                file,
            ],
        );
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
}

#[test]
fn two_releases_are_judged_as_one() {
    let folder = tempfile::tempdir().unwrap();
    releases(folder.path());
    let out = yawrig(folder.path(), &["diagnose", "a.csv", "b.csv", "--same-rig", "--json"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let said: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(said["schema_version"], 1);
    assert_eq!(said["effects"], serde_json::json!(["coulomb_friction"]));
    assert_eq!(said["records"].as_array().unwrap().len(), 2);
    let c = &said["steps"][1]["parameters"]["coulomb_friction.c"]["value"];
    assert!((c.as_f64().unwrap() - 0.1).abs() < 0.005, "{c}");
    assert_eq!(said["records"][0]["parameters"]["coulomb_friction.c"]["value"], *c);
    assert_eq!(
        said["records"][1]["modal"]["natural_frequency_rad_s"],
        said["modal"]["natural_frequency_rad_s"]
    );

    let text = yawrig(folder.path(), &["diagnose", "a.csv", "b.csv", "--own", "coulomb_friction"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("held out: releases, with"), "{text}");
    assert!(text.contains("b.csv: coulomb_friction.c"), "{text}");
}

/// A model beside several records is what they are judged from; one that is not there is an error.
#[test]
fn several_releases_are_judged_beside_a_model() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, file) in [("1", "a.csv"), ("2", "b.csv")] {
        let made = format!(
            "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.1 --seconds 20 --seed {seed} --out {file}"
        );
        let made: Vec<&str> = made.split(' ').collect();
        assert!(yawrig(folder.path(), &made).status.success());
    }
    let lost = yawrig(folder.path(), &["diagnose", "a.csv", "b.csv", "--model", "m.toml"]);
    assert_eq!(lost.status.code(), Some(3), "{}", String::from_utf8_lossy(&lost.stderr));
    assert!(String::from_utf8_lossy(&lost.stderr).contains("m.toml"));
    for words in [
        &["fit", "a.csv", "--model", "m.toml"][..],
        &["add", "coulomb_friction", "--model", "m.toml"],
    ] {
        let out = yawrig(folder.path(), words);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    let found =
        yawrig(folder.path(), &["diagnose", "a.csv", "b.csv", "--model", "m.toml", "--json"]);
    let said: Value = serde_json::from_slice(&found.stdout).unwrap();
    assert_eq!((&said["status"], &said["effects"]), (&"adequate".into(), &serde_json::json!([])));
}

#[test]
fn what_says_nothing_of_one_release_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        (&["diagnose", "a.csv", "--same-rig"][..], "a.csv alone"),
        (&["diagnose", "a.csv", "campaign.toml"], "campaign.toml among several records"),
        (&["diagnose", "a.csv", "b.csv", "--own", "rubbing"], "rubbing"),
        (
            &["diagnose", "a.csv", "b.csv", "--own", "hysteresis", "--share", "hysteresis"],
            "--own hysteresis and --share hysteresis",
        ),
    ] {
        let out = yawrig(folder.path(), arguments);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}");
        let message = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
}
