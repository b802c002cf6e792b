//! A file dropped on the page: opened where it says what it holds, asked about where it does not.

use crate::bench::{pictures, Bench, Reply, RUBBING};
use serde_json::{json, Value};
use std::fmt::Write as _;
use yawrig_tests::browser::{Browser, Window};

/// A gyroscope's and a motor's course without units, times in the first column.
fn phone() -> String {
    let mut text = "t,x,z\n".to_owned();
    for k in 0..3000 {
        let t = f64::from(k) / 200.0;
        let noise = 0.002 * (f64::from(k * 7919 % 1009) / 504.0 - 1.0);
        let rate = -1.5 * (-0.1 * t).exp() * (7.5 * t).sin() + noise;
        let _ = writeln!(text, "{t:.4},{:.5},{rate:.6}", (5.0 * t).sin());
    }
    text
}

impl Bench {
    fn posted(&self, path: &str, kind: &str, body: &str) -> Reply {
        let mut lines = self.ours();
        lines.push(format!("Content-Type: {kind}"));
        self.ask(&format!("POST {path}"), &lines, body)
    }
}

fn parsed(reply: &Reply) -> Value {
    serde_json::from_str(&reply.body).unwrap_or_else(|_| panic!("{}", reply.body))
}

#[test]
fn a_file_that_is_dropped_is_asked_about_and_opened() {
    let bench = Bench::start(&[RUBBING], "");
    let drop = |name: &str, text: &str| {
        bench.posted(&format!("/api/drop?name={name}"), "application/octet-stream", text)
    };
    // One that says it itself, and is in the folder already.
    let reply = drop("rubbing.csv", &bench.text("rubbing.csv"));
    assert_eq!(parsed(&reply), json!({"file": "rubbing.csv", "is_clear": true}));
    // Another of that name is not written over it.
    let reply = drop("rubbing.csv", &bench.text("rubbing.csv").replace("15.", "14."));
    assert_eq!(parsed(&reply)["file"], "rubbing-2.csv", "{}", reply.body);

    let asked = parsed(&drop("phone.csv", &phone()));
    assert_eq!((&asked["is_clear"], &asked["file"]), (&json!(false), &json!("phone.csv")));
    let channels = asked["channels"].as_array().expect("channels");
    let names: Vec<&str> = channels.iter().filter_map(|c| c["name"].as_str()).collect();
    assert_eq!(names, ["t", "x", "z"]);
    assert!(channels.iter().all(|c| c["sketch"].as_array().is_some_and(|s| s.len() > 100)));
    let as_read = |reading: Value| {
        let body = json!({"file": "phone.csv", "reading": reading}).to_string();
        parsed(&bench.posted("/api/as_read", "application/json", &body))
    };
    let unclear = as_read(json!({"yaw": "z"}));
    assert!(unclear["why"].as_str().is_some_and(|why| why.contains("unit")), "{unclear}");
    let reading = json!({"yaw": "z", "quantity": "rate", "unit": "rad/s"});
    assert_eq!(as_read(reading.clone())["is_clear"], true);

    let (status, opened) =
        bench.act(&json!({"do": "open", "file": "phone.csv", "reading": reading}));
    assert_eq!(status, 200, "{opened}");
    let id = opened["release"].as_u64().expect("a release");
    let is_judged = |state: &Value| {
        let all = state["releases"].as_array().cloned().unwrap_or_default();
        all.iter().any(|r| r["id"] == id && !r["over_noise"].is_null())
    };
    bench.wait("the release is judged", is_judged);
    let curves = bench.get(&format!("/api/curves?release={id}"));
    assert_eq!(
        (&curves["units"]["unit"], &curves["units"]["of"]),
        (&json!("deg/s"), &json!("deg"))
    );
    let view = bench.get(&format!("/api/view?release={id}"));
    let wn = view["natural_frequency_rad_s"]["value"].as_f64().expect("wn");
    assert!((wn - 7.5f64.hypot(0.1)).abs() < 5e-3, "{wn}");
    // Nothing but names of files of the folder.
    for name in ["..%2Fa.csv", "a%2Fb.csv", ".bashrc"] {
        assert_eq!(drop(name, "x").status, 409, "{name}");
    }
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_file_is_dropped_on_the_page() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.querySelector('#verdict').dataset.status === 'structured'");
    let text = serde_json::to_string(&phone()).expect("text");
    browser.value(&format!(
        "(() => {{ const held = new DataTransfer(); held.items.add(new File([{text}], 'phone.csv')); \
         document.dispatchEvent(new DragEvent('drop', {{ dataTransfer: held, bubbles: true, cancelable: true }})); return 1; }})()"
    ));
    browser.wait("document.querySelector('#drop-dialog').open");
    assert!(browser.text("#drop-dialog").contains("which of its channels swings?"));
    browser.value("document.querySelector('#drop-dialog input[value=z]').click()");
    browser.value(
        "(() => { const [quantity] = document.querySelectorAll('#drop-dialog select'); quantity.value = 'rate'; return 1; })()",
    );
    browser.picture(&pictures().join("dropped.png"));
    browser.click("#drop-open");
    browser.wait("document.querySelector('#drop-dialog .error').textContent.includes('unit')");
    browser.value(
        "(() => { document.querySelector('#drop-dialog input[placeholder]').value = 'rad/s'; return 1; })()",
    );
    browser.click("#drop-open");
    browser.wait("!document.querySelector('#drop-dialog').open");
    browser
        .wait("document.querySelector('.release.selected button').textContent.includes('phone')");
    browser.wait("document.querySelector('#figure-wn').textContent.startsWith('7.5')");
    browser.picture(&pictures().join("rate.png"));
}
