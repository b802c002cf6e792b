//! Reports opened from disk in a browser: drawn whole, without an error, a word to any other host, or five megabytes.

use serde_json::Value;
use std::path::Path;
use yawrig_tests::browser::Look;
use yawrig_tests::process::yawrig;

const MOST_BYTES: u64 = 5_000_000;

/// Opens the page at every size and in both colours.
fn looked_at(page: &Path, words: &[&str], plots: usize) {
    let bytes = page.metadata().expect("the page").len();
    println!("{}: {bytes} bytes", page.file_name().expect("a name").to_string_lossy());
    assert!(bytes <= MOST_BYTES, "{bytes} bytes");
    for (width, height, dark) in [(1280, 720, false), (1920, 1080, true)] {
        let seen = Look { page, width, height, dark }.see();
        assert_eq!(seen.console, Vec::<String>::new(), "{}", page.display());
        assert_eq!(seen.requests, Vec::<String>::new(), "{}", page.display());
        assert!(seen.screenshot.len() > 10_000, "an empty picture");
        for word in words {
            assert!(seen.dom.contains(word), "{word:?} is missing from {}", page.display());
        }
        // Each overlay that is open has been drawn by the page's own script.
        assert_eq!(seen.dom.matches("class=\"uplot").count(), plots, "{}", page.display());
        assert!(!seen.dom.contains("NaN"), "{}", page.display());
    }
}

fn run(folder: &Path, command: &str) -> Value {
    yawrig(command).in_folder(folder).with_patience(600).run().exits(0).json()
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
    let printed = run(folder, "report r.csv --out r.html --json");
    holds(folder, "r.html", &printed);
    assert_eq!(printed["criticism"]["status"], "explained");
    let words = ["coulomb_friction", "least-squares", "yawrig report r.csv --out r.html", "<svg"];
    looked_at(&folder.join("r.html"), &words, 2);
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
    let why = yawrig("add coulomb_friction --json --why").and("<b>it</b> rubs & squeaks");
    why.in_folder(folder).run().exits(0);
    let printed = run(folder, "report model.toml --json");
    holds(folder, "report.html", &printed);
    let words = ["&lt;b&gt;it&lt;/b&gt; rubs &amp; squeaks", "+ coulomb_friction"];
    looked_at(&folder.join("report.html"), &words, 2);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn of_a_campaign() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let effect = "--effect coulomb_friction:c=0.05";
    run(folder, &format!("simulate --campaign c --seconds 20 --rate-hz 200 {effect} --json"));
    let printed = run(folder, "report c/campaign.toml --json");
    holds(folder, "report.html", &printed);
    assert_eq!(printed["releases"].as_array().map(Vec::len), Some(32));
    assert_eq!(printed["points"].as_array().map(Vec::len), Some(8));
    looked_at(&folder.join("report.html"), &["combined damping derivative", "mechanical"], 2);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn of_a_demo() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let demo = run(folder, "demo --json");
    assert_eq!(demo["report"], "yawrig-demo/report.html");
    // Made again from what the demo has kept, it is the same to the byte.
    let printed = run(folder, "report yawrig-demo --out again.html --json");
    holds(folder, "yawrig-demo/report.html", &printed);
    let pages = ["yawrig-demo/report.html", "again.html"].map(|p| std::fs::read(folder.join(p)));
    let [first, again] = pages.map(|page| page.expect("a page"));
    assert!(first == again);
    let words = ["Training of the network", "planted", "Cn_r - Cn_betadot", "yawrig demo --json"];
    looked_at(&folder.join("again.html"), &words, 2);
}
