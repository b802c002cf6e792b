//! A law measured on the page, and taken into the model.

use crate::bench::{pictures, Bench};
use crate::looks::nothing_is_cut_off;
use serde_json::Value;
use tempfile::TempDir;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

const WINDOW: Window = Window { width: 1280, height: 720, is_dark: false };

/// A free decay with a moment that no effect of the library is.
fn folder(moment: &str, parameters: &str, values: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!(
        "id = \"hidden\"\ntitle = \"Hidden\"\nmoment = \"{moment}\"\n[parameters]\n{parameters}"
    );
    std::fs::write(folder.path().join("hidden.toml"), text).expect("room");
    let command = format!(
        "simulate --natural-frequency 7 --damping 0.004 --effect hidden.toml:{values} --seconds 30 --out r.csv"
    );
    yawrig(&command).in_folder(folder.path()).run().exits(0);
    folder
}

fn steps_are(count: usize) -> String {
    format!("document.querySelectorAll('#steps button').length === {count}")
}

fn fallen(browser: &mut Browser) {
    let steps = browser
        .value("[...document.querySelectorAll('#steps button')].map(b => +b.dataset.overNoise)");
    let steps: Vec<f64> =
        steps.as_array().expect("steps").iter().filter_map(Value::as_f64).collect();
    assert!(steps[0] > 5.0 && steps[1] < 1.1, "{steps:?}");
}

/// The model that the same commands make.
fn made_by(folder: &TempDir, commands: &[&str]) -> String {
    let other = tempfile::tempdir().expect("a folder");
    std::fs::copy(folder.path().join("r.csv"), other.path().join("r.csv")).expect("room");
    for command in commands {
        yawrig(command).in_folder(other.path()).run().exits(0);
    }
    std::fs::read_to_string(other.path().join("model.toml")).expect("a model")
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_law_is_offered_measured_named_and_its_name_added() {
    let stribeck = "-c * sign(r) * (1 + s * exp(-abs(r) / v))";
    let parameters = "c = { unit = \"rad/s2\", start = 0.05, min = 0.0 }\n\
        s = { unit = \"1\", start = 0.5, min = 0.0 }\nv = { unit = \"rad/s\", start = 0.1, min = 0.0 }\n";
    let bench = Bench::start_in(folder(stribeck, parameters, "c=0.06,s=2,v=0.3"), "r.csv");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    browser.wait("!document.querySelector('#diagnose-button').disabled && document.querySelector('.badge.structured')");

    // The diagnosis in the words of the command; what it leaves is drawn, and a law is offered.
    browser.click("#diagnose-button");
    browser.wait("document.querySelector('#diagnosis .verdict')");
    browser.wait("document.body.dataset.busy === undefined");
    let told = yawrig("diagnose r.csv --json").in_folder(bench.folder.path()).run().exits(0).json();
    assert_eq!(told["status"], "mostly_explained");
    let sentence = told["sentence"].as_str().expect("a sentence");
    let said = browser.text("#diagnosis");
    assert!(said.contains("mostly explained by") && said.contains(&sentence[1..]), "{said}");
    browser.wait(
        "document.querySelector('#residual-caption').textContent.includes('with coulomb_friction')",
    );
    browser.wait("document.querySelector('#law-button').classList.contains('primary')");
    browser.picture(&pictures().join("mostly-explained.png"));

    // The law, with the command's own numbers.
    browser.click("#law-button");
    browser.wait("!document.querySelector('#law').hidden");
    browser.wait("document.querySelector('#law li') && document.body.dataset.busy === undefined");
    let law = yawrig("law r.csv --json").in_folder(bench.folder.path());
    let law = law.run().exits(0).json();
    let names =
        browser.value("[...document.querySelectorAll('#law .name')].map(e => e.textContent)");
    let told = law["names"].as_array().expect("names").iter().map(|n| n["form"].clone());
    assert_eq!(names, Value::Array(told.take(5).collect()));
    assert_eq!(names[0], "stribeck_friction");
    assert!(!bench.path("found").exists(), "a formula is written when it is added");
    let drawn = bench.get("/api/law?release=0");
    let numbers = |of: &Value, name: &str| -> Vec<f64> {
        let cut = of["cuts"]["damping_law"][name].as_array().expect(name);
        cut.iter().filter_map(Value::as_f64).collect()
    };
    assert_eq!(numbers(&drawn, "u").len(), 41);
    // About zero rate it falls by twice the friction, less what the model has there already.
    let rate = numbers(&drawn, "rate_deg_s")[21].to_radians();
    let friction = 0.06 * (1.0 + 2.0 * f64::exp(-rate / 0.3));
    let modal = &bench.get("/api/view?release=0")["damping_ratio"]["value"];
    let linear = 2.0 * 7.0 * (modal.as_f64().expect("a damping ratio") - 0.004) * rate;
    let falls = |of: &Value| {
        let moment = numbers(of, "moment_rad_s2");
        0.5 * (moment[19] - moment[21]) / (friction - linear)
    };
    let (by_name, by_law) = (falls(&drawn["found"]["names"][0]), falls(&drawn));
    println!("friction about zero rate, of what was hidden: named {by_name:.3}, law {by_law:.3}");
    assert!((by_name - 1.0).abs() < 0.05 && (by_law - 1.0).abs() < 0.25);
    browser.value("document.querySelector('#law').scrollIntoView()");
    browser.picture(&pictures().join("law.png"));
    nothing_is_cut_off(&mut browser, "the page");

    // Its best name, into the model.
    browser.click("[data-focus='law-found/stribeck_friction.toml']");
    browser.wait(&steps_are(2));
    browser.wait("document.querySelector('#verdict').dataset.status === 'adequate'");
    fallen(&mut browser);
    let commands = ["fit r.csv", "law r.csv --out found", "add found/stribeck_friction.toml"];
    assert_eq!(bench.text("model.toml"), made_by(&bench.folder, &commands));
    assert!(bench.text("model.journal.jsonl").contains("yawrig add found/stribeck_friction.toml"));
    browser.is_clean(&bench.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_law_is_added_as_measured_by_keys() {
    let parameters =
        "h = { unit = \"rad/s2\", start = 0.1, min = 0.0 }\nn = { unit = \"1\", start = 1.0, min = 0.0 }\n";
    let drag = folder("-h * sign(r) * abs(r / 1.0)^n", parameters, "h=0.25,n=1.5");
    let bench = Bench::start_in(drag, "r.csv");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    browser.wait("!document.querySelector('#law-button').disabled && document.querySelector('.badge.structured')");
    browser.key("m");
    browser.wait("document.querySelector('#law li') && document.body.dataset.busy === undefined");
    assert!(!bench.path("model.toml").exists(), "measuring writes no model");
    // Where wind may put energy in, and back.
    browser.click("[data-focus=law-drive]");
    browser.wait("document.querySelector('[data-focus=law-drive]')?.textContent === 'Measure again, taking energy out' && document.body.dataset.busy === undefined");
    assert_eq!(bench.get("/api/law?release=0")["measured"]["may_drive"], true);
    browser.click("[data-focus=law-drive]");
    browser.wait("document.querySelector('[data-focus=law-drive]')?.textContent === 'Measure again, energy may come in' && document.body.dataset.busy === undefined");
    browser.click("[data-focus=law-measured_law]");
    browser.wait(&steps_are(2));
    browser.wait("document.querySelector('#verdict').dataset.status === 'adequate'");
    fallen(&mut browser);
    let commands = ["fit r.csv", "add measured_law"];
    assert_eq!(bench.text("model.toml"), made_by(&bench.folder, &commands));
    browser.is_clean(&bench.origin);
}

/// What no law of angle and rate holds: said, and drawn in the form that shows it.
#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn what_no_law_holds_is_drawn() {
    for (effect, label, lines) in [
        ("harmonic_forcing:f=0.15,w=11,phi=0.3", "share of power (%) over frequency (Hz)", 1),
        ("baseline_drift:d=0.0008", "beyond the law (deg) over time since the release (s)", 1),
        ("sensor_nonlinearity:s=0.8", "beyond the law (deg) over yaw shown (deg)", 1),
        ("hysteresis:h=4,y=0.02", "its moment (rad/s²) over yaw angle (deg)", 6),
    ] {
        let name = effect.split(':').next().expect("a name");
        let folder = tempfile::tempdir().expect("a folder");
        let rig =
            "simulate --natural-frequency 7 --damping 0.004 --seconds 20 --out r.csv --seed 3";
        yawrig(&format!("{rig} --effect {effect}")).in_folder(folder.path()).run().exits(0);
        let bench = Bench::start_in(folder, "r.csv");
        let mut browser = Browser::start(WINDOW);
        browser.open(&bench.url);
        browser.wait(
            "!document.querySelector('#law-button').disabled && document.querySelector('.badge')",
        );
        browser.click("#law-button");
        browser.wait("document.querySelector('#law .left canvas') && document.body.dataset.busy === undefined");
        assert_eq!(
            browser.value("document.querySelector('#law .left').ariaLabel"),
            label,
            "{effect}"
        );
        let left = bench.get("/api/law?release=0")["found"]["left"].clone();
        assert_eq!(left["lines"].as_array().map(Vec::len), Some(lines), "{effect}");
        if name == "harmonic_forcing" {
            let at = left["at"].as_f64().expect("a frequency");
            assert!((at * std::f64::consts::TAU - 11.0).abs() < 0.05, "{at}");
        }
        browser.value("document.querySelector('#law').scrollIntoView()");
        browser.picture(&pictures().join(format!("no-law-{name}.png")));
        browser.is_clean(&bench.origin);
    }
}
