//! Many tabs of one page, and a folder that may only be read.

use super::bench::{Bench, RUBBING};
use serde_json::json;
use std::os::unix::fs::PermissionsExt;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig_as_anybody;

#[test]
fn eight_tabs_are_as_quick_as_one() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    for _ in 0..7 {
        let another = json!({"expression": "!!window.open(location.origin)", "userGesture": true});
        let opened = browser.call("Runtime.evaluate", another);
        assert_eq!(opened["result"]["value"], true, "{opened}");
    }
    // Each has opened what it opens, and shows it.
    browser.each_tab(&bench.origin, 8, |tab| {
        tab.wait("document.querySelector('.badge.structured')");
    });
    assert_eq!(browser.value("fetch('/api/state').then(r => r.status)"), json!(200));
    // News still comes to each: here a step that was taken elsewhere.
    yawrig_tests::process::yawrig("fit rubbing.csv").in_folder(bench.folder.path()).run().exits(0);
    let fitted = "document.getElementById('subtitle').textContent.includes('model.toml ·')";
    browser.each_tab(&bench.origin, 8, |tab| tab.wait(fitted));
}

#[test]
fn a_folder_that_may_only_be_read_is_opened_to_look() {
    let folder = tempfile::tempdir().expect("a folder");
    let mode = |bits| {
        std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(bits))
            .expect("ours")
    };
    yawrig_tests::process::yawrig(RUBBING).in_folder(folder.path()).run().exits(0);
    mode(0o555);
    let command = yawrig_as_anybody("workbench rubbing.csv").in_folder(folder.path());
    let mut running = command.start();
    running.says("opens for viewing only");
    let url = running.prints("http://");
    let (origin, token) = url.split_once("/?token=").expect("a token in the address");
    let bench = Bench {
        origin: origin.to_owned(),
        token: token.to_owned(),
        folder: tempfile::tempdir().expect("a folder"),
        running,
        url: url.clone(),
    };
    let state = bench.get("/api/state");
    assert!(state["model"]["read_only"].as_str().is_some_and(|why| why.contains("model.toml")));
    bench.act(&json!({"do": "fit"}));
    let state = bench.wait("the fit ends", |state| !state["ended"].is_null());
    assert!(state["ended"].to_string().contains("may not write"), "{state:#}");
    mode(0o755);
}
