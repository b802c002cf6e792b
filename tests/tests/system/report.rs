//! Reports opened from disk with the network off: drawn whole, without an error, a word to any host, or five
//! megabytes.

use serde_json::{json, Value};
use std::path::Path;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

const MAX_BYTES: u64 = 5_000_000;
const WINDOWS: [Window; 4] = [
    Window { width: 390, height: 844, is_dark: false },
    Window { width: 800, height: 1000, is_dark: true },
    Window { width: 1280, height: 720, is_dark: false },
    Window { width: 1920, height: 1080, is_dark: true },
];

/// Opens the page at every size, in one colour or the other; pictures go where `YAWRIG_PICTURES` says, to be
/// looked at.
fn looked_at(page: &Path, words: &[&str], plots: u64) {
    let name = page.file_stem().expect("a name").to_string_lossy().into_owned();
    let bytes = page.metadata().expect("the page").len();
    println!("{name}: {bytes} bytes");
    assert!(bytes <= MAX_BYTES, "{bytes} bytes");
    let mut browser = Browser::start(WINDOWS[0]);
    let offline =
        json!({"offline": true, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0});
    browser.call("Network.emulateNetworkConditions", offline);
    let url = format!("file://{}", page.canonicalize().expect("a path").display());
    browser.open(&url);
    for window in WINDOWS {
        browser.resize(window);
        // Each overlay that is open is drawn by the page's own script, as wide as there is room for.
        browser.wait(&format!("document.querySelectorAll('.uplot canvas').length === {plots}"));
        browser.wait(
            "[...document.querySelectorAll('.plots')].filter(p => p.clientWidth)\
             .every(p => [...p.querySelectorAll('.uplot')].every(u => u.clientWidth === p.clientWidth))",
        );
        let cut_off = "document.documentElement.scrollWidth > document.documentElement.clientWidth";
        assert_eq!(browser.value(cut_off), json!(false), "{name} is wider than {window:?}");
        let text = browser.text("main");
        for word in words {
            assert!(text.contains(word), "{word:?} is missing from {name}");
        }
        let seen = browser.value("document.querySelector('main').innerText");
        assert!(!seen.as_str().expect("text").contains("NaN"), "{name}");
        // A drawing is no higher than a printed page has room for.
        let low = "[...document.querySelectorAll('figure svg')].every(s => s.viewBox.baseVal.height < s.viewBox.baseVal.width)";
        assert_eq!(browser.value(low), json!(true), "{name}");
        // Lettering is there: a word is wider than nothing.
        let width = "document.querySelector('figure svg text').getComputedTextLength() > 20";
        assert_eq!(browser.value(width), json!(true), "{name}");
        if let Some(folder) = std::env::var_os("YAWRIG_PICTURES") {
            let dark = if window.is_dark { "dark" } else { "light" };
            let file = format!("{name}-{}-{dark}.png", window.width);
            browser.picture(&Path::new(&folder).join(file));
        }
    }
    // A drawing is saved as an image, two pixels for each of its own.
    browser.value(
        "(() => { URL.createObjectURL = (blob) => { createImageBitmap(blob).then((i) => { window.saved = [blob.type, i.width]; }); \
         return '#'; }; document.querySelector('button.save').click(); })()",
    );
    browser.wait("!!window.saved");
    let width = "2 * document.querySelector('button.save').parentElement.querySelector('svg').viewBox.baseVal.width";
    let width = browser.value(width);
    assert_eq!(browser.value("window.saved"), json!(["image/png", width]), "{name}");
    browser.is_clean("file://");
}

fn run(folder: &Path, command: &str) -> Value {
    yawrig(command).in_folder(folder).run().exits(0).json()
}

/// What the page holds is what `--json` has printed.
fn holds(folder: &Path, page: &str, printed: &Value) {
    assert_eq!(&run(folder, &format!("report --data {page}")), printed);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn of_a_record() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let record =
        "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05";
    run(folder, &format!("{record} --json --out r.csv"));
    let printed = run(folder, "report r.csv --out record.html --json");
    holds(folder, "record.html", &printed);
    assert_eq!(printed["criticism"]["status"], "explained");
    let words = ["coulomb_friction", "least-squares", "yawrig report r.csv --out record.html"];
    looked_at(&folder.join("record.html"), &words, 2);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn of_a_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let record =
        "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05";
    run(folder, &format!("{record} --json --out r.csv"));
    run(folder, "fit r.csv --json");
    let why = yawrig("add coulomb_friction --json --why").and("<b>it</b> rubs & </script>");
    why.in_folder(folder).run().exits(0);
    let printed = run(folder, "report model.toml --json --out model.html");
    holds(folder, "model.html", &printed);
    let words = ["<b>it</b> rubs & </script>", "+ coulomb_friction"];
    looked_at(&folder.join("model.html"), &words, 2);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn of_a_campaign() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let effect = "--effect coulomb_friction:c=0.05";
    run(folder, &format!("simulate --campaign c --seconds 40 {effect} --json"));
    let printed = run(folder, "report c/campaign.toml --json --out campaign.html");
    holds(folder, "campaign.html", &printed);
    assert_eq!(printed["releases"].as_array().map(Vec::len), Some(32));
    assert_eq!(printed["points"].as_array().map(Vec::len), Some(8));
    let page = std::fs::read_to_string(folder.join("campaign.html")).expect("a page");
    // A picture of each condition.
    assert_eq!(page.matches("<b>K5, ").count(), 4);
    looked_at(&folder.join("campaign.html"), &["combined damping derivative", "mechanical"], 2);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn of_a_demo() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let demo = run(folder, "demo --json");
    assert_eq!(demo["report"], "yawrig-demo/report.html");
    // Made again from what the demo has kept, it is the same to the byte.
    let printed = run(folder, "report yawrig-demo --out demo.html --json");
    holds(folder, "yawrig-demo/report.html", &printed);
    let pages = ["yawrig-demo/report.html", "demo.html"].map(|p| std::fs::read(folder.join(p)));
    let [first, again] = pages.map(|page| page.expect("a page"));
    assert!(first == again);
    let words = ["Training of the network", "planted", "Cn_r - Cn_betadot", "yawrig demo --json"];
    looked_at(&folder.join("demo.html"), &words, 2);
}
