//! A device followed on the page.

use crate::bench::{pictures, Bench};
use crate::looks::nothing_is_cut_off;
use nix::sys::signal::Signal;
use serde_json::{json, Value};
use std::path::{Path, PathBuf};
use yawrig_rig::{Rig, Spring};
use yawrig_shared::axis::Axis;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

/// Files of the recordings' folder whose names end so, the releases' apart.
fn recorded(folder: &Path, end: &str) -> Vec<PathBuf> {
    let entries = folder.join("recordings").read_dir().expect("a folder of recordings").flatten();
    let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    entries
        .map(|entry| entry.path())
        .filter(|path| name(path).ends_with(end) && !name(path).contains("release"))
        .collect()
}

/// Milliseconds of the samples of a trace.
fn milliseconds(trace: &Path) -> Vec<i64> {
    let text = std::fs::read_to_string(trace).expect("a trace");
    let number = |line: &str| {
        let (time_s, yaw_deg) = line.split_once(',').expect("two columns");
        assert!(yaw_deg.parse::<f64>().expect("an angle").is_finite());
        (time_s.parse::<f64>().expect("a time") * 1e3).round() as i64
    };
    text.lines().skip(1).map(number).collect()
}

/// The trace has a line in the colour of a mark.
const MARK_IS_DRAWN: &str = "(() => { const c = document.querySelector('#plot-live canvas'); if (!c) return false; \
    const { data } = c.getContext('2d').getImageData(0, 0, c.width, c.height), is = [184, 74, 8]; let n = 0; \
    for (let k = 0; k < data.length; k += 4) if (is.every((x, i) => Math.abs(data[k + i] - x) < 4)) n++; return n > 100; })()";

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_minute_of_a_device_is_drawn_and_kept_whole() {
    let bench = Bench::start(&[], "");
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.querySelector('#verdict').textContent === 'No record is open.'");
    browser.key("l");
    browser.wait("document.querySelector('#live-device').value === 'emulated'");
    browser.click("#live-connect");
    let samples = "+document.querySelector('#live-count').dataset.samples";
    browser.wait(&format!("{samples} > 0"));
    browser.click("#live-record");
    browser.wait("document.querySelector('#live-record').textContent === 'Stop recording'");
    let from = browser.value(samples).as_u64().expect("a number");
    browser.fill("#live-note", "wind on");
    browser.click("#live-mark");
    browser.wait("document.querySelector('#live-log [data-event=mark]')");
    browser.wait(MARK_IS_DRAWN);
    assert!(browser.text("#verdict").starts_with("Live: "), "the header speaks of the device");
    browser.wait(&format!("{samples} > {}", from + 62_000));
    browser.wait("document.querySelectorAll('#live-log [data-event=window]').length > 2");
    browser.picture(&pictures().join("live.png"));
    nothing_is_cut_off(&mut browser, "the page");
    browser.click("#live-record");
    browser.wait("document.querySelector('#live-log [data-event=recorded]')");
    let said = browser.text("#live-log [data-event=recorded]");
    assert!(said.contains("none missing"), "{said}");
    assert_eq!(browser.value("+document.querySelector('#live-count').dataset.missing"), 0);
    let trace = recorded(bench.folder.path(), ".csv");
    assert_eq!(trace.len(), 1, "{trace:?}");
    let times = milliseconds(&trace[0]);
    println!("{said}");
    assert!(times.len() >= 60_000, "{}", times.len());
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 1), "a sample is missing");
    let log = recorded(bench.folder.path(), ".jsonl");
    assert!(std::fs::read_to_string(&log[0]).expect("a log").contains("\"wind on\""));
    browser.click("#live-connect");
    browser.wait("document.querySelector('#live-connect').textContent === 'Connect'");
    browser.key("l");
    browser.wait("!document.querySelector('#verdict').textContent.startsWith('Live: ')");
    browser.is_clean(&bench.origin);
}

#[test]
fn ctrl_c_keeps_what_is_being_recorded() {
    let bench = Bench::start(&[], "--device emulated");
    let live = |state: &Value| state["live"].clone();
    bench.wait("samples", |state| live(state)["samples"].as_u64() > Some(0));
    // A second one is not begun beside it.
    let (status, refused) = bench.act(&json!({"do": "connect", "device": "emulated"}));
    assert_eq!(status, 409, "{refused}");
    assert_eq!(bench.act(&json!({"do": "record"})).0, 200);
    let begun = bench.wait("a recording", |state| !live(state)["recording"].is_null());
    let from = begun["live"]["samples"].as_u64().expect("a number");
    bench.wait("a second", |state| live(state)["samples"].as_u64() > Some(from + 1000));
    let folder = bench.folder;
    bench.running.signal(Signal::SIGINT);
    bench.running.ends().exits(130);
    assert!(recorded(folder.path(), ".partial").is_empty());
    let traces = recorded(folder.path(), ".csv");
    let times = milliseconds(&traces[0]);
    assert!(times.len() > 900, "{}", times.len());
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 1));
}

#[test]
fn a_device_that_is_not_there_is_said_to_be() {
    let bench = Bench::start(&[], "");
    assert_eq!(bench.act(&json!({"do": "connect", "device": "/dev/ttyNothing"})).0, 200);
    let state = bench.wait("a fault", |state| !state["live"]["fault"].is_null());
    let said = state["live"]["fault"]["message"].as_str().expect("why");
    assert!(said.contains("/dev/ttyNothing"), "{said}");
    assert_eq!(state["live"]["is_followed"], false);
    let (status, refused) = bench.act(&json!({"do": "record"}));
    assert_eq!(status, 409);
    assert!(refused["error"]["message"].as_str().expect("why").contains("no device"), "{refused}");
}

/// Samples of the one stored session in a folder, and whether it was ended.
fn stored(folder: &Path) -> Vec<(PathBuf, usize)> {
    let files = folder.read_dir().expect("a folder").flatten().map(|entry| entry.path());
    // `2026-...Z.csv`, and of those that go on `.csv.partial`.
    let is_trace = |path: &PathBuf| path.to_string_lossy().contains("Z.csv");
    let lines = |path: &Path| std::fs::read_to_string(path).expect("a trace").lines().count();
    files.filter(is_trace).map(|path| (path.clone(), lines(&path) - 1)).collect()
}

#[test]
fn a_campaign_s_recording_ends_with_its_last_release() {
    let bench = Bench::start(&["simulate --campaign plan --rate-hz 20"], "");
    let whole = bench.text("plan/campaign.toml");
    let blocks: Vec<&str> = whole.split("[[release]]").collect();
    std::fs::write(bench.path("plan/campaign.toml"), blocks[..4].join("[[release]]"))
        .expect("room");
    let done = |what: Value| assert_eq!(bench.act(&what).0, 200, "{what}");
    let live = |state: &Value| state["live"].clone();
    assert!(live(&bench.get("/api/state"))["disk"].is_null());
    done(json!({"do": "connect", "device": "emulated", "speed": 50}));
    // Before it begins: what it takes, and what is run, for every page.
    let before = live(&bench.wait("a device", |state| !live(state)["disk"].is_null()));
    assert_eq!((&before["speed"], &before["measuring"]), (&json!(50.0), &Value::Null));
    let hour = before["disk"]["bytes_an_hour"].as_f64().expect("bytes");
    assert!(hour > 50.0 * 3.6e6 * 19.0, "{hour}");
    assert!(before["disk"]["free_bytes"].as_u64() > Some(0), "{before}");

    done(json!({"do": "measure", "wanted": {"campaign": "plan/campaign.toml"}}));
    let begun = live(&bench.wait("it begins", |state| !live(state)["measuring"].is_null()));
    assert_eq!(begun["measuring"]["wanted"]["campaign"], "plan/campaign.toml");
    let ends = |state: &Value| live(state)["measuring"]["has_ended"] == true;
    let over = |state: &Value| ends(state) && live(state)["recording"].is_null();
    let state = live(&bench.wait("its end", over));
    let folder = bench.path("recordings/plan-campaign");
    let ended = stored(&folder);
    assert_eq!(ended.len(), 1, "{ended:?}");
    assert!(ended[0].0.extension().is_some_and(|end| end == "csv"), "{ended:?}");
    // An hour's bytes hold for what was recorded, the records of its releases with it.
    let bytes: u64 = (folder.read_dir().expect("a folder").flatten())
        .filter(|entry| entry.path().extension().is_some_and(|end| end == "csv"))
        .map(|entry| entry.metadata().expect("a file").len())
        .sum();
    let by_hour = hour / 50.0 / 3.6e6 * ended[0].1 as f64;
    println!("{bytes} bytes of {} samples, {by_hour} by what is said", ended[0].1);
    assert!((bytes as f64) < 1.05 * by_hour && bytes as f64 > 0.4 * by_hour);
    // The device goes on, and nothing is written any more.
    let from = state["samples"].as_u64().expect("a number");
    bench.wait("a hundred seconds more", |s| live(s)["samples"].as_u64() > Some(from + 100_000));
    assert_eq!(stored(&folder), ended);

    // Its last release once more is recorded, and ends as well: a busy machine may have looked too late.
    done(json!({"do": "back"}));
    bench.wait("it is recorded", |state| {
        !live(state)["recording"].is_null() || stored(&folder).len() > 1
    });
    bench.wait("its end", over);
    assert_eq!(stored(&folder).len(), 2);
    // What is begun by hand after that goes on.
    done(json!({"do": "record"}));
    let begun = live(&bench.wait("it is recorded", |state| !live(state)["recording"].is_null()));
    let from = begun["samples"].as_u64().expect("a number");
    bench.wait("a while", |s| live(s)["samples"].as_u64() > Some(from + 10_000));
    assert!(!live(&bench.get("/api/state"))["recording"].is_null());
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_campaign_is_measured_through_the_page() {
    let bench = Bench::start(&[], "");
    let command = "simulate --campaign plan --rate-hz 20";
    yawrig(command).in_folder(bench.folder.path()).run().exits(0);
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.querySelector('#verdict').textContent === 'No record is open.'");
    browser.key("l");
    browser.wait("document.querySelector('#live-device').value === 'emulated'");
    browser.value("document.querySelector('#live-speed').value = '100'");
    browser.click("#live-connect");
    browser.wait("!document.querySelector('#live-measure').hidden");
    // One is made before the campaign begins: of no condition, it is told from others by its number and time.
    browser.click("#live-record");
    browser.wait("[...document.querySelectorAll('.release button')].some((b) => /^no\\. \\d+, \\d\\d:\\d\\d:\\d\\d$/.test(b.textContent))");
    browser.fill("#measure-file", "plan/campaign.toml");
    browser.click("#measure-begin");
    // Which of them it is by now, depends on how quick this machine is.
    browser.wait("/release \\d+ of 32/.test(document.querySelector('#measure-next').textContent)");
    browser.wait("document.querySelectorAll('#measure-points tbody tr').length >= 5");
    let points = browser.text("#measure-points tbody");
    assert!(points.contains("10 m/s"), "{points} {}", browser.text("#live-log"));
    browser.picture(&pictures().join("measure.png"));
    nothing_is_cut_off(&mut browser, "the page");
    browser.wait("document.querySelector('#live-log [data-event=derivatives]')");
    browser.wait("document.querySelectorAll('#measure-points tbody tr').length === 16");
    browser.picture(&pictures().join("measured.png"));
    let rows = "[...document.querySelectorAll('#measure-points tbody tr')].map((tr) => \
        [...tr.querySelectorAll('td')].map((td) => td.textContent))";
    let rows = browser.value(rows);
    // The newest one first, and as a whole.
    assert_eq!(rows[0][0], "K8 front, 10 m/s");
    let panel = "(() => { const e = document.querySelector('#measure-panel'); return e.scrollWidth - e.clientWidth; })()";
    assert_eq!(browser.value(panel), 0);
    its_record_begins_with_the_first_condition(&bench);
    the_derivatives_are_those_planted(&rows);
    another_page_shows_the_same(&bench, &mut browser);
    // What cannot be is said, and nothing is begun. The rig rests: nothing else comes to the log.
    let next = browser.text("#measure-next");
    browser.fill("#measure-file", "nothing.toml");
    browser.click("#measure-begin");
    browser.wait("document.querySelector('#live-log [data-event=refused]')");
    assert!(browser.text("#live-log [data-event=refused]").contains("nothing.toml"));
    assert_eq!(browser.text("#measure-next"), next);
    // One condition by itself, and one that cannot be.
    browser.value("(() => { const e = document.querySelector('#measure-what'); e.value = 'condition'; e.dispatchEvent(new Event('change')); })()");
    browser.fill("#measure-file", "");
    browser.fill("#measure-spring", "K4");
    browser.fill("#measure-wind", "500");
    browser.click("#measure-begin");
    browser.wait("document.querySelector('#live-log').textContent.includes('wind speed 500 m/s')");
    browser.fill("#measure-wind", "10");
    browser.click("#measure-begin");
    browser.wait(
        "document.querySelector('#measure-next').textContent.includes('K4 mid, wind 10 m/s')",
    );
    browser.click("#live-connect");
    browser.wait("document.querySelector('#live-connect').textContent === 'Connect'");
    browser.is_clean(&bench.origin);
    let table = "derivatives recordings/plan-campaign/campaign.toml";
    yawrig(table).in_folder(bench.folder.path()).run().exits(0);
}

/// That what runs was begun on another one.
fn another_page_shows_the_same(bench: &Bench, browser: &mut Browser) {
    browser.open(&bench.origin);
    browser.wait("document.querySelectorAll('#measure-points tbody tr').length === 16");
    let value = |id: &str| format!("document.querySelector('#{id}').value");
    browser.wait(&format!("{} === '100'", value("live-speed")));
    browser.wait(&format!("{} === 'plan/campaign.toml'", value("measure-file")));
    assert_eq!(browser.value(&value("measure-what")), "campaign");
    assert_eq!(browser.value(&value("live-device")), "emulated");
    assert_eq!(browser.text("#live-connect"), "Disconnect");
    assert_eq!(browser.text("#live-record"), "Record", "it ended with the last release");
    assert!(browser.text("#measure-next").contains("all releases are made"));
    assert!(browser.text("#live-disk").contains("GB an hour"), "{}", browser.text("#live-disk"));
    nothing_is_cut_off(browser, "another page");
}

fn its_record_begins_with_the_first_condition(bench: &Bench) {
    let log =
        std::fs::read_dir(bench.path("recordings/plan-campaign")).expect("a folder").flatten();
    let log =
        log.map(|entry| entry.path()).find(|file| file.extension().is_some_and(|e| e == "jsonl"));
    let log = std::fs::read_to_string(log.expect("a log")).expect("a log");
    let lines = log.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let first = lines.into_iter().find(|line| line["event"] == "condition").expect("a condition");
    assert_eq!(
        (&first["spring"], &first["wind_speed_m_s"]),
        (&json!("K1"), &json!(0.0)),
        "{first}"
    );
}

fn the_derivatives_are_those_planted(rows: &Value) {
    let truth = Rig::default();
    for row in rows.as_array().expect("rows") {
        println!("{row}");
        let [condition, cn_beta, cn_r] = [0, 1, 2].map(|at| row[at].as_str().expect("a cell"));
        let mut words = condition.split([' ', ',']);
        let mut word = || words.next().unwrap_or_else(|| panic!("{row}"));
        let spring = Spring::named(word()).expect("a spring");
        let axis: Axis = word().parse().expect("an axis");
        let value = |cell: &str| {
            let text = cell.replace('−', "-");
            text.split(' ').next().expect("a value").parse::<f64>().expect("a number")
        };
        let planted = truth.derivatives(&spring, axis);
        assert!((value(cn_beta) / planted.cn_beta - 1.0).abs() < 1e-3, "{row}");
        assert!((value(cn_r) / planted.cn_r - 1.0).abs() < 5e-3, "{row}");
    }
}
