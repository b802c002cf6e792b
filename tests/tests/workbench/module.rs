//! The module of the page that needs no server: how large it is, and that it is said where it cannot be run.

use crate::still::{Served, WINDOW};
use std::fs::metadata;
use std::path::Path;
use yawrig_tests::browser::Browser;
use yawrig_tests::process::yawrig;

/// The most that the module may have, and all other files of the page, bytes.
const MODULE: u64 = 1_450_000;
const ELSE: u64 = 310_000;

/// What a browser cannot run, for it is of before 2023 or the file is not whole.
#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_module_that_cannot_be_run_is_said() {
    let served = Served::start();
    let module = served.page().join("yawrig.lzma");
    let mut bytes = std::fs::read(&module).expect("the module");
    let half = bytes.len() / 2;
    bytes[half..].fill(0);
    std::fs::write(&module, bytes).expect("room");
    let mut browser = Browser::start(WINDOW);
    browser.open(&format!("{}/", served.origin));
    browser.wait("document.querySelector('#message').textContent.startsWith('yawrig cannot be loaded in this browser')");
}

/// As a server sends it that compresses nothing.
#[test]
#[ignore = "builds the module, which takes minutes: tests/run runs it"]
fn the_page_is_small() {
    let folder = tempfile::tempdir().expect("a folder");
    yawrig("workbench --static page").in_folder(folder.path()).run().exits(0);
    let page = folder.path().join("page");
    let length = |file: &Path| metadata(file).expect("a file").len();
    let files = std::fs::read_dir(&page).expect("a folder");
    let files = files.map(|file| file.expect("a file").path()).filter(|file| file.is_file());
    let all: u64 = files.map(|file| length(&file)).sum();
    let module = length(&page.join("yawrig.lzma"));
    assert!(module <= MODULE, "the module: {module} bytes");
    assert!(all - module <= ELSE, "all else: {} bytes", all - module);
}
