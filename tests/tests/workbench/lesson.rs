//! Records beside the page that needs no server: a link to it, or a frame around it, opens one.

use crate::bench::pictures;
use crate::still::{Served, IS_EMPTY, IS_FOUND, IS_IDLE, WINDOW};
use yawrig_tests::browser::Browser;

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_record_beside_the_page_is_opened_by_its_address() {
    let served = Served::start();
    std::fs::write(served.page().join("rubbing.csv"), served.read("rubbing.csv")).expect("room");
    let lesson = "<link rel=icon href='data:,'><h1>Lesson 1</h1><iframe src='index.html#record=rubbing.csv' width=1200 height=700></iframe>";
    std::fs::write(served.page().join("lesson.html"), lesson).expect("room");
    let mut browser = Browser::start(WINDOW);
    browser.open(&format!("{}/lesson.html", served.origin));
    let inside =
        |what: &str| what.replace("document.", "document.querySelector('iframe').contentDocument.");
    browser.wait(&inside(IS_FOUND));
    browser.wait(&inside("document.querySelector('#nothing-sent').textContent.includes('it stands within another page')"));
    browser.picture(&pictures().join("lesson.png"));

    // Nothing of the frame's session is left.
    browser.open(&format!("{}/", served.origin));
    browser.wait(IS_EMPTY);
    browser.value("location.hash = 'record=rubbing.csv'");
    // What is said once it has ended has been said.
    browser.wait(&format!("{IS_FOUND} && {IS_IDLE}"));
    browser.wait("location.hash === '#record=rubbing.csv'");
    browser.is_clean(&served.origin);

    // In the page's folder only, and only what is there.
    for missing in ["gone.csv", "../page/rubbing.csv"] {
        let asked = format!("location.hash = 'record=' + encodeURIComponent('{missing}')");
        browser.value(&asked);
        browser.wait(&format!("document.querySelector('#message').textContent.includes('the address is of {missing}, which is not in the list')"));
    }
    assert!(
        browser.requests.iter().all(|url| !url.contains("page%2Frubbing")),
        "{:?}",
        browser.requests
    );
}
