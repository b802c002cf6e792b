//! A stored session shown again on the page.

use crate::bench::{pictures, Bench};
use crate::looks::nothing_is_cut_off;
use serde_json::{json, Value};
use std::path::Path;
use tempfile::TempDir;
use yawrig_link::live::item::Item;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

/// A folder with a session of two releases and a mark, `session.csv` and `session.jsonl`.
fn recorded() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let command = "monitor --speed 20 --releases 2 --record session.csv";
    yawrig(command).in_folder(folder.path()).run().exits(0);
    // As if somebody had typed it when the first window came.
    let file = folder.path().join("session.jsonl");
    let log = std::fs::read_to_string(&file).expect("a log");
    let mut lines: Vec<String> = log.lines().map(str::to_owned).collect();
    let is_window = |line: &String| line.contains("\"event\":\"window\"");
    let place = lines.iter().position(is_window).expect("a window");
    let window = Item::from_json(&serde_json::from_str(&lines[place]).expect("JSON"));
    let mark = Item::Mark { at: window.expect("a window").at(), text: "wind on".to_owned() };
    lines.insert(place + 1, mark.to_json().to_string());
    std::fs::write(&file, lines.join("\n") + "\n").expect("room");
    folder
}

/// Times of the trace's first and last sample, s, and how many there are.
fn trace(folder: &Path) -> (f64, f64, u64) {
    let text = std::fs::read_to_string(folder.join("session.csv")).expect("a trace");
    let time_s = |line: &str| line.split(',').next().expect("a time").parse().expect("a number");
    let rows: Vec<&str> = text.lines().skip(1).collect();
    (time_s(rows[0]), time_s(rows[rows.len() - 1]), rows.len() as u64)
}

/// Samples of the trace up to a time.
fn rows_until(folder: &Path, time_s: f64) -> u64 {
    let text = std::fs::read_to_string(folder.join("session.csv")).expect("a trace");
    let until = |line: &&str| {
        let (at_s, _) = line.split_once(',').expect("two columns");
        at_s.parse::<f64>().expect("a time") <= time_s
    };
    text.lines().skip(1).take_while(until).count() as u64
}

/// What the session's log holds of one kind, as the terminal shows it.
fn logged(folder: &Path, kind: &str) -> Vec<Value> {
    let again = yawrig("monitor --speed 1e6 --jsonl --replay session").in_folder(folder).run();
    let lines = again.exits(0).json_lines();
    lines.into_iter().filter(|line| line["event"] == kind).collect()
}

fn replay(state: &Value) -> Value {
    state["live"]["replay"].clone()
}

/// What the page holds of one kind.
fn lines(live: &Value, kind: &str) -> Vec<Value> {
    let all = live["lines"].as_array().expect("lines").iter();
    all.filter(|line| line["event"] == kind).cloned().collect()
}

#[test]
fn a_session_is_listed_played_and_gone_through() {
    let bench = Bench::start_in(recorded(), "");
    let folder = bench.folder.path().to_owned();
    let (first_s, last_s, count) = trace(&folder);

    the_older_ones_are_listed(&bench, last_s - first_s + 1e-3);
    what_cannot_be_shown_is_said(&bench);

    // Played to its end: all that is in it.
    let go = |what: Value| assert_eq!(bench.act(&what).0, 200, "{what}");
    go(json!({"do": "replay", "session": "session"}));
    let state = bench.wait("it begins", |state| !replay(state).is_null());
    assert_eq!(state["live"]["is_followed"], false);
    assert!(replay(&state)["to_s"].as_f64() >= Some(last_s), "{state}");
    let (status, refused) = bench.act(&json!({"do": "record"}));
    assert_eq!(status, 409, "{refused}");
    assert_eq!(bench.act(&json!({"do": "connect", "device": "emulated"})).0, 409);
    go(json!({"do": "speed", "times": 100}));
    bench.wait("its end", |state| replay(state)["is_playing"] == false);
    let whole = bench.get("/api/live");
    assert_eq!(whole["samples"], count);
    all_that_was_logged_is_shown(&folder, &whole);

    // To the mark: what was before, and not what comes after.
    let places = whole["places"].as_array().expect("places");
    let mark = places.iter().find(|p| p["text"] == "mark: wind on").expect("the mark");
    assert_eq!(places.iter().filter(|p| p["text"] != "mark: wind on").count(), 2, "{places:?}");
    let at_s = mark["time_s"].as_f64().expect("a time");
    let epoch = whole["epoch"].as_u64();
    go(json!({"do": "jump", "time_s": at_s}));
    bench.wait("the mark", |state| state["live"]["epoch"].as_u64() > epoch);
    let now = bench.get("/api/live");
    assert_eq!(now["replay"]["is_playing"], false, "it stands still as it did");
    assert_eq!(lines(&now, "mark").len(), 1);
    assert!(lines(&now, "window").iter().all(|w| w["time_s"].as_f64() <= Some(at_s)));
    // All that the trace has up to there, and the rest of the message of fifty samples that has begun.
    let shown = now["samples"].as_u64().expect("samples");
    let there = rows_until(&folder, at_s);
    assert!(there <= shown && shown < there + 50, "{shown} of {there} at {at_s}, from {first_s}");
    let times = now["trace"]["time_s"].as_array().expect("times").clone();
    assert!(times.iter().all(|t| t.as_f64() <= Some(at_s + 0.05)));

    // It goes on from there, and before the beginning there is nothing.
    go(json!({"do": "speed", "times": 1}));
    go(json!({"do": "play"}));
    bench.wait("it goes on", |s| replay(s)["at_s"].as_f64() > Some(at_s + 0.2));
    go(json!({"do": "pause"}));
    bench.wait("it stands", |s| replay(s)["is_playing"] == false);
    go(json!({"do": "jump", "time_s": -5}));
    bench.wait("the beginning", |s| replay(s)["at_s"] == replay(s)["from_s"]);
    go(json!({"do": "disconnect"}));
    bench.wait("it is left", |s| replay(s).is_null());
}

/// One never ended and one of a campaign that is damaged, newest first; other logs are none.
fn the_older_ones_are_listed(bench: &Bench, whole_s: f64) {
    let folder = bench.folder.path();
    let inside = folder.join("recordings");
    let of_rig = inside.join("rig");
    std::fs::create_dir_all(&of_rig).expect("room");
    let log = std::fs::read_to_string(folder.join("session.jsonl")).expect("a log");
    let begun = log.lines().next().expect("a line");
    let old = begun.replacen("\"started\":\"202", "\"started\":\"201", 1);
    std::fs::write(inside.join("old.jsonl"), format!("{old}\n")).expect("room");
    let rows = "time_s,yaw_deg\n1.000,0.5\n1.001,0.5\n1.002,0";
    std::fs::write(inside.join("old.csv.partial"), rows).expect("room");
    std::fs::write(of_rig.join("torn.jsonl"), format!("{old}\nnothing\n")).expect("room");
    std::fs::write(of_rig.join("torn.csv"), "time_s,yaw_deg\n0.000,1.0\n").expect("room");
    std::fs::write(folder.join("results.jsonl"), "{\"file\":\"a.csv\"}\n").expect("room");
    std::fs::write(folder.join("named-alike.jsonl"), "{\"file\":\"a.csv\"}\n").expect("room");
    std::fs::write(folder.join("named-alike.csv"), rows).expect("room");
    let listed = bench.get("/api/sessions")["sessions"].clone();
    let names: Vec<&str> = listed
        .as_array()
        .expect("a list")
        .iter()
        .map(|s| s["session"].as_str().expect("a name"))
        .collect();
    assert_eq!(names, ["session", "recordings/rig/torn", "recordings/old"], "{listed:#}");
    assert!((listed[0]["duration_s"].as_f64().expect("s") - whole_s).abs() < 1e-6, "{listed:#}");
    let about = |k: usize| {
        ["releases", "marks", "is_finished", "is_damaged"].map(|key| listed[k][key].clone())
    };
    assert_eq!(about(0), [json!(2), json!(1), json!(true), json!(false)]);
    assert_eq!(about(1), [json!(0), json!(0), json!(true), json!(true)]);
    assert_eq!(about(2), [json!(0), json!(0), json!(false), json!(false)]);
}

/// And nothing else is.
fn what_cannot_be_shown_is_said(bench: &Bench) {
    let of_rig = bench.path("recordings/rig");
    let old = std::fs::read_to_string(bench.path("recordings/old.jsonl")).expect("a log");
    let old = old.trim_end();
    let refused = |session: &str| {
        let (status, answer) = bench.act(&json!({"do": "replay", "session": session}));
        assert_eq!(status, 409, "{session}");
        assert!(!answer["error"]["help"].as_str().expect("help").is_empty(), "{answer}");
        answer["error"]["message"].as_str().expect("why").to_owned()
    };
    assert!(refused("recordings/rig/torn").contains("torn.jsonl, line 2"));
    assert!(refused("recordings/gone").contains("gone.jsonl"));
    std::fs::remove_file(of_rig.join("torn.csv")).expect("it is there");
    assert!(refused("recordings/rig/torn").contains("torn.csv: the trace"));
    std::fs::write(of_rig.join("torn.jsonl"), format!("{old}\n")).expect("room");
    std::fs::write(of_rig.join("torn.csv"), "time_s,yaw_deg\n0.500,1.0\n0.400,1.0\n")
        .expect("room");
    let said = refused("recordings/rig/torn");
    assert!(said.contains("torn.csv, line 3") && said.contains("backwards"), "{said}");
    let (_, none) = bench.act(&json!({"do": "play"}));
    assert!(none["error"]["message"].as_str().expect("why").contains("no device"), "{none}");
}

fn all_that_was_logged_is_shown(folder: &Path, whole: &Value) {
    for kind in ["window", "release", "refined", "mark", "record", "device"] {
        let (there, here) = (logged(folder, kind), lines(whole, kind));
        assert!(!there.is_empty(), "{kind}");
        assert_eq!(there.len(), here.len(), "{kind}");
        for (mut there, mut here) in there.into_iter().zip(here) {
            // Its own text is part of the line's.
            if let Some(note) = there.as_object_mut().and_then(|line| line.remove("text")) {
                let line = here["text"].as_str().expect("a text");
                assert!(line.ends_with(note.as_str().expect("a note")), "{line}");
            }
            for own in ["text", "number"] {
                here.as_object_mut().expect("a line").remove(own).expect(own);
            }
            assert_eq!(there, here);
        }
    }
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_session_is_shown_again_on_the_page() {
    let bench = Bench::start_in(recorded(), "");
    let windows = logged(bench.folder.path(), "window").len();
    let (_, _, count) = trace(bench.folder.path());
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.querySelector('#verdict').textContent === 'No record is open.'");
    browser.key("l");
    // From here on with keys alone: the source's list, the session's, and the button.
    browser.wait("document.activeElement.id === 'live-connect'");
    browser.value("document.querySelector('#live-source').focus()");
    browser.key("ArrowDown");
    browser.wait("!document.querySelector('#live-session').hidden && document.querySelector('#live-session').value === 'session'");
    browser.key("Tab");
    assert_eq!(browser.value("document.activeElement.id"), "live-session");
    browser.key("Tab");
    browser.wait("document.querySelector('#live-connect').textContent === 'Show'");
    browser.key("Enter");
    browser.wait("document.querySelector('#live-replay').dataset.playing === 'true'");
    for id in ["replay-play", "replay-speed"] {
        while browser.value("document.activeElement.id") != id {
            browser.key("Tab");
        }
    }
    browser.key("ArrowDown");
    browser.key("ArrowDown");
    browser.wait("document.querySelector('#live-replay').dataset.speed === '100'");
    browser.wait("document.querySelector('#live-replay').dataset.playing === 'false'");
    let log =
        |kind: &str| format!("document.querySelectorAll('#live-log [data-event={kind}]').length");
    assert_eq!(browser.value(&log("window")), windows);
    assert_eq!(browser.value(&log("release")), 2);
    assert_eq!(browser.value("+document.querySelector('#live-count').dataset.samples"), count);

    // The marks: before and after with the brackets, play and pause with the space bar.
    browser.value("document.activeElement.blur()");
    let at = "+document.querySelector('#live-replay').dataset.at";
    browser.key("[");
    browser.wait(&format!("{at} < {}", count as f64 / 1e3 - 2.0));
    browser.key("[");
    browser.key("[");
    browser.key("[");
    browser.wait(&format!("{} === 0", log("release")));
    browser.key("]");
    browser.wait(&format!("{} === 1 || {at} > 1", log("mark")));
    // As slowly as it was, so that it still plays when that is looked at.
    browser.value("document.querySelector('#replay-speed').focus()");
    browser.key("ArrowUp");
    browser.key("ArrowUp");
    browser.wait("document.querySelector('#live-replay').dataset.speed === '1'");
    browser.value("document.activeElement.blur()");
    browser.key(" ");
    browser.wait("document.querySelector('#live-replay').dataset.playing === 'true'");
    browser.key(" ");
    browser.wait("document.querySelector('#live-replay').dataset.playing === 'false'");
    // A time with the slider, in the middle of the first release.
    browser.value(
        "(() => { const e = document.querySelector('#replay-time'); e.focus(); e.value = 30; e.dispatchEvent(new Event('input')); })()",
    );
    browser.wait(&format!("Math.abs({at} - 30) < 0.01"));
    browser.wait(&format!("{} > 0", log("window")));
    nothing_is_cut_off_at_any_size(&mut browser);
    // A page that is opened later sees the same.
    browser.open(&bench.origin);
    browser.wait("!document.querySelector('#live').hidden");
    browser.wait(&format!("Math.abs({at} - 30) < 0.01 && {} > 0", log("window")));
    a_damaged_session_says_so(&bench, &mut browser);
    // Back to devices.
    browser.click("#live-connect");
    browser.wait("document.querySelector('#live-connect').textContent === 'Show'");
    browser.wait("document.querySelector('#live-replay').hidden");
    browser.is_clean(&bench.origin);
}

fn nothing_is_cut_off_at_any_size(browser: &mut Browser) {
    for (width, height) in [(1280, 720), (1920, 1080)] {
        for is_dark in [false, true] {
            browser.resize(Window { width, height, is_dark });
            browser.wait(&format!("innerWidth === {width}"));
            std::thread::sleep(std::time::Duration::from_millis(300));
            let name =
                format!("replay-{width}x{height}-{}", if is_dark { "dark" } else { "light" });
            browser.picture(&pictures().join(format!("{name}.png")));
            nothing_is_cut_off(browser, &name);
        }
    }
}

/// Where its trace would be.
fn a_damaged_session_says_so(bench: &Bench, browser: &mut Browser) {
    browser.click("#live-connect");
    browser.wait("document.querySelector('#live-connect').textContent === 'Show'");
    let log = bench.text("session.jsonl");
    std::fs::write(bench.path("session.jsonl"), log.replacen('\n', "\nnothing\n", 1))
        .expect("room");
    browser.click("#live-connect");
    browser
        .wait("document.querySelector('#message').textContent.includes('session.jsonl, line 2')");
    browser.wait(
        "document.querySelector('#plot-live .no-data').textContent.includes('leave this line out')",
    );
    browser.picture(&pictures().join("replay-damaged.png"));
    std::fs::write(bench.path("session.jsonl"), log).expect("room");
    browser.complaints.retain(|complaint| !complaint.contains("409"));
    browser.click("#live-connect");
    browser.wait("!document.querySelector('#live-replay').hidden");
}

/// The same session as a network would have told it that says the friction, too.
fn with_friction(folder: &Path) {
    let file = folder.join("session.jsonl");
    let log = std::fs::read_to_string(&file).expect("a log");
    let told = |line: &str| {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        let number = json!({"name": "coulomb_friction.c", "unit": "rad/s2", "value": 0.125});
        if line["event"] == "window" || line["event"] == "release" {
            line["numbers"] = json!([number]);
        }
        if line["event"] == "release" {
            line["numbers"][0]["u"] = json!(0.01);
        }
        line.to_string() + "\n"
    };
    std::fs::write(&file, log.lines().map(told).collect::<String>()).expect("room");
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_number_of_an_effect_is_drawn_by_window_with_the_releases() {
    let folder = recorded();
    with_friction(folder.path());
    let bench = Bench::start_in(folder, "");
    assert_eq!(bench.act(&json!({"do": "replay", "session": "session"})).0, 200, "it is shown");
    bench.act(&json!({"do": "speed", "times": 100}));
    bench.wait("its end", |state| replay(state)["is_playing"] == false);
    let lines = bench.get("/api/live")["lines"].clone();
    let release = lines.as_array().expect("lines").iter().find(|l| l["event"] == "release");
    let text = release.expect("a release")["text"].as_str().expect("a text").to_owned();
    assert!(text.contains("\n  coulomb_friction.c 0.125 ± 0.010 rad/s2"), "{text}");
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.querySelector('#live-numbers').offsetParent !== null");
    browser.wait("document.querySelector('#plot-live-number-0 canvas') !== null");
    assert_eq!(browser.value("document.querySelector('#plot-live-number-1').hidden"), true);
    assert_eq!(
        browser.value("document.querySelector('#plot-live-number-0').title"),
        "coulomb_friction.c"
    );
    for (width, height) in [(1280, 720), (1920, 1080)] {
        for is_dark in [false, true] {
            browser.resize(Window { width, height, is_dark });
            browser.wait(&format!("innerWidth === {width}"));
            let shade = if is_dark { "dark" } else { "light" };
            let name = format!("numbers-{width}x{height}-{shade}");
            nothing_is_cut_off(&mut browser, &name);
            browser.picture(&pictures().join(format!("{name}.png")));
        }
    }
    browser.is_clean(&bench.origin);
}
