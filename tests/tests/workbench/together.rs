//! Several releases judged as one on the page.

use crate::bench::{pictures, Bench};
use crate::looks::nothing_is_cut_off;
use serde_json::{json, Value};
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

/// Two short releases of one rig that rubs, from other amplitudes.
const RELEASES: [&str; 2] = [
    "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05 --amplitude-deg 16 --seconds 20 --rate-hz 200 --seed 1 --out a.csv",
    "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05 --amplitude-deg 12 --seconds 20 --rate-hz 200 --seed 2 --out b.csv",
];

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn ticked_releases_are_judged_together_as_the_command_does() {
    let bench = Bench::start(&RELEASES, "a.csv b.csv");
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("!document.querySelector('#together-button').disabled");
    browser.click("#together-button");
    let answered = "document.getElementById('diagnosis').textContent.includes('2 ticked releases')";
    browser.wait(answered);
    browser.picture(&pictures().join("together.png"));
    nothing_is_cut_off(&mut browser, "releases judged together");
    let shown = browser.text("#diagnosis");
    let ended = yawrig("diagnose a.csv b.csv --json").in_folder(bench.folder.path()).run();
    let said: Value = serde_json::from_str(&ended.exits(0).stdout).expect("JSON");
    assert_eq!(said["effects"], json!(["coulomb_friction"]), "{said:#}");
    let sentence = &said["sentence"].as_str().expect("a sentence")[1..];
    assert!(shown.contains("explained by coulomb_friction") && shown.contains(sentence), "{shown}");

    // Of other ticks it is no answer, and of one release no question.
    let (status, _) = bench.act(&json!({"do": "tick", "releases": [1], "used": "out"}));
    assert_eq!(status, 200);
    browser.wait(&format!("!({answered}) && document.querySelector('#together-button').disabled"));
    let (status, _) = bench.act(&json!({"do": "together"}));
    assert_eq!(status, 200);
    let state = bench.wait("a refusal", |state| !state["ended"].is_null());
    assert!(state["ended"].to_string().contains("fewer than two"), "{state:#}");
    browser.is_clean(&bench.origin);
}
