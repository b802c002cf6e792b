//! A campaign.toml made by form and drag.

use crate::bench::{pictures, Bench};
use serde_json::{json, Value};
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

const PATTERN: &str = "{spring}_V{wind}_{axis}_run{n}.csv";

/// Records called as somebody calls them, and one that is not.
fn bench() -> Bench {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |arguments: &str| yawrig(arguments).in_folder(folder.path()).run().exits(0);
    run("simulate --campaign rig --seconds 20 --rate-hz 200");
    for (from, to) in [
        ("K3-mid-off", "K3_Voff_mid_run1"),
        ("K3-mid-on", "K3_V10_mid_run2"),
        ("K3-front-off", "K3_V0_front_run3"),
        ("K3-front-on", "one more"),
    ] {
        let from = folder.path().join(format!("rig/{from}.csv"));
        std::fs::rename(&from, folder.path().join(format!("{to}.csv"))).expect("room");
    }
    std::fs::remove_dir_all(folder.path().join("rig")).expect("it is there");
    Bench::start_in(folder, "")
}

fn wrong(browser: &mut Browser) -> Vec<String> {
    let lines = browser
        .value("[...document.querySelectorAll('#campaign-wrong li')].map(e => e.textContent)");
    lines.as_array().expect("lines").iter().filter_map(Value::as_str).map(str::to_owned).collect()
}

const MISSING: &str =
    "[...document.querySelectorAll('#campaign-wrong li')].some(e => e.textContent.includes('is missing'))";

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_campaign_is_made_by_names_drag_and_form() {
    let bench = bench();
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.querySelector('#release-list .empty')");
    browser.key("g");
    browser.wait("document.querySelector('#campaign-dialog').open");
    assert_eq!(browser.value("document.querySelectorAll('.pool .file').length"), 4);

    // By their names; the one that is not called so remains.
    browser.fill("[data-field=pattern]", "{spring");
    browser.click("#campaign-pattern");
    browser.wait("document.querySelector('#campaign-told.error')");
    browser.fill("[data-field=pattern]", PATTERN);
    browser.click("#campaign-pattern");
    browser.wait("document.querySelectorAll('.conditions .file').length === 3");
    browser.wait(MISSING);
    browser.picture(&pictures().join("campaign-form.png"));

    // What is wrong is what the command says of the file that the command writes.
    let folder = bench.folder.path();
    let run = |arguments: &str| yawrig(arguments).in_folder(folder).run();
    run(&format!("campaign init . --pattern {PATTERN}")).exits(0);
    let told = run("campaign check campaign.toml").exits(3).stdout;
    let missing = |lines: Vec<&str>| -> Vec<String> {
        lines.iter().filter(|l| l.contains("is missing")).map(|l| (*l).to_owned()).collect()
    };
    let shown = wrong(&mut browser);
    assert_eq!(
        missing(shown.iter().map(String::as_str).collect()),
        missing(told.lines().collect())
    );
    let by_command = bench.text("campaign.toml");
    browser.click("#campaign-write");
    browser.wait("document.querySelector('#campaign-told.error')");
    assert!(browser.text("#campaign-told").contains("is there already"));
    browser.complaints.retain(|complaint| !complaint.contains("409 (Conflict)"));
    std::fs::remove_file(bench.path("campaign.toml")).expect("it is there");
    browser.click("#campaign-write");
    browser.wait("document.querySelector('#campaign-told').textContent.includes('is written')");
    assert_eq!(bench.text("campaign.toml"), by_command);

    // The last one is dragged, onto a condition that is made for it.
    browser.value("document.querySelector('[data-field=new-axis]').value = 'front'");
    browser.fill("[data-field=new-wind]", "10,0");
    browser.click("#campaign-condition");
    browser.wait("document.querySelector('[data-cell=\"K3 front 10\"]')");
    browser.value(
        "(() => { const data = new DataTransfer(), to = document.querySelector('[data-cell=\"K3 front 10\"]'); \
         const fire = (e, kind) => e.dispatchEvent(new DragEvent(kind, { dataTransfer: data, bubbles: true, cancelable: true })); \
         fire(document.querySelector('[data-file=\"one more.csv\"]'), 'dragstart'); fire(to, 'dragover'); fire(to, 'drop'); })()",
    );
    browser.wait("document.querySelectorAll('.conditions .file').length === 4");

    // The numbers; then nothing is wrong, and the campaign is open.
    for (field, value) in [
        ("length_m", "0,625"),
        ("frontal_area_m2", "0.036"),
        ("density_kg_m3", "1.2"),
        ("spring_arm_m", "0.1"),
        ("axis_offset_m", "0.05"),
        ("stiffness K3", "306"),
    ] {
        browser.fill(&format!("[data-field='{field}']"), value);
    }
    browser.wait(&format!("!{MISSING}"));
    browser.click("#campaign-write");
    browser.wait("document.querySelector('#campaign-told').textContent.includes('and open')");
    browser.picture(&pictures().join("campaign-written.png"));
    run("campaign check campaign.toml").exits(0);
    let points = run("derivatives campaign.toml --json").exits(0).json();
    assert_eq!(points["points"].as_array().map(Vec::len), Some(1));
    browser.key("Escape");
    browser.wait("document.querySelectorAll('.release').length === 4");
    browser.is_clean(&bench.origin);
}

#[test]
fn a_form_writes_only_below_the_folder_it_was_started_in() {
    let bench = Bench::start_in(tempfile::tempdir().expect("a folder"), "");
    let form = |folder: &str| json!({"do": "write_campaign", "folder": folder, "placed": [], "given": {}, "over": false});
    for folder in ["..", "/tmp", "a/../..", "nowhere"] {
        let (status, answer) = bench.act(&form(folder));
        assert_eq!(status, 409, "{folder}: {answer}");
    }
}
