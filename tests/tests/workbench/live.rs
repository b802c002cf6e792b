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
