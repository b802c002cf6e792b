//! Where the analysis of a record begins and ends: said on the page, moved by the mouse and by keys.

use crate::bench::{pictures, Bench, RUBBING};
use serde_json::{json, Value};
use yawrig_tests::browser::{Browser, Window};

const WINDOW: Window = Window { width: 1280, height: 720, is_dark: false };

fn pair(curves: &Value, name: &str) -> [f64; 2] {
    [0, 1].map(|k| curves[name][k].as_f64().unwrap_or(f64::NAN))
}

#[test]
fn a_part_of_a_record_is_analysed_and_what_is_none_is_refused() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let is_judged = |state: &Value| !state["releases"][0]["over_noise"].is_null();
    bench.wait("the release is judged", is_judged);
    let before = bench.get("/api/curves?release=0");
    let [begin_s, end_s] = pair(&before, "analysed_s");
    assert!(before["cut_s"].is_null() && begin_s < end_s, "{before}");
    assert_eq!(before["analysed"][0], "let go from a hold");

    let cut = |from_s: Option<f64>, to_s: Option<f64>| {
        bench.act(&json!({"do": "between", "release": 0, "from_s": from_s, "to_s": to_s}))
    };
    let middle_s = 0.5 * (begin_s + end_s);
    let (status, said) = cut(Some(begin_s), Some(begin_s + 0.2));
    assert_eq!(status, 409, "{said}");
    let message = said["error"]["message"].as_str().expect("a message");
    assert!(message.contains("cycles") || message.contains("oscillation"), "{said}");
    assert!(bench.get("/api/curves?release=0")["cut_s"].is_null());

    let (status, said) = cut(None, Some(middle_s));
    assert_eq!(status, 200, "{said}");
    let name = |state: &Value| state["releases"][0]["file"].as_str().unwrap_or("").to_owned();
    bench.wait("the part is judged", |s| name(s).contains("#0s..") && is_judged(s));
    let part = bench.get("/api/curves?release=0");
    // All of the record is still to be seen.
    assert_eq!(part["whole_s"], before["whole_s"]);
    assert!((pair(&part, "analysed_s")[1] - middle_s).abs() < 0.1, "{}", part["analysed_s"]);
    // It is the same as the command line's part of it.
    let view = bench.get("/api/view?release=0");
    let file = bench.path("rubbing.csv").display().to_string();
    let theirs = yawrig_tests::process::yawrig("fit --json")
        .and(format!("{file}#..{middle_s}s"))
        .in_folder(bench.folder.path())
        .run()
        .exits(0)
        .json();
    let wn = theirs["conditions"][0]["natural_frequency_rad_s"]["value"].as_f64();
    assert_eq!(view["natural_frequency_rad_s"]["value"].as_f64(), wn, "{theirs}");
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn both_ends_are_dragged() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    let caption = "document.querySelector('#overlay-caption').title";
    let is_cut = "!document.querySelector('#uncut-button').hidden";
    browser.wait(&format!("{caption}.includes('(let go from a hold)')"));
    let curves = bench.get("/api/curves?release=0");
    let [first_s, last_s] = pair(&curves, "whole_s");
    let [begin_s, end_s] = pair(&curves, "analysed_s");
    let over = browser.value(
        "(() => { const r = document.querySelector('#plot-overlay .u-over').getBoundingClientRect(); return [r.left, r.top + r.height / 2, r.width]; })()",
    );
    let [left, y, width] = [0, 1, 2].map(|k| over[k].as_f64().expect("a number"));
    let at = |time_s: f64| [left + width * (time_s - first_s) / (last_s - first_s), y];

    // The end, to the left.
    let to_s = begin_s + 0.6 * (end_s - begin_s);
    browser.drag(at(end_s), at(to_s));
    browser.wait(is_cut);
    // Without its fit nothing can be taken hold of.
    browser.wait(&format!("{caption}.includes('the record ends there')"));
    let now = pair(&bench.get("/api/curves?release=0"), "analysed_s");
    assert!((now[1] - to_s).abs() < 0.02 * (last_s - first_s), "{now:?}, {to_s}");
    assert!((now[0] - begin_s).abs() < 1e-6, "{now:?}, {begin_s}");
    // The beginning, to the right; the other end stays where it was put.
    let from_s = begin_s + 0.2 * (end_s - begin_s);
    browser.drag(at(begin_s), at(from_s));
    browser.wait(&format!("{caption}.includes('the record begins')"));
    let now = pair(&bench.get("/api/curves?release=0"), "analysed_s");
    assert!((now[0] - from_s).abs() < 0.02 * (last_s - first_s), "{now:?}, {from_s}");
    assert!((now[1] - to_s).abs() < 0.02 * (last_s - first_s), "{now:?}, {to_s}");
    browser.picture(&pictures().join("ends.png"));
    browser.click("#uncut-button");
    browser.wait(&format!("{caption}.includes('(let go from a hold)')"));
    browser.wait("document.querySelector('#uncut-button').hidden");

    // By keys: what is in view, and all again.
    browser.value("document.activeElement.blur()");
    browser.key("+");
    browser.wait("document.querySelector('#plot-overlay .u-over')");
    browser.key("x");
    browser.wait(is_cut);
    browser.key("x");
    browser.wait("document.querySelector('#uncut-button').hidden");
    browser.is_clean(&bench.origin);
}
