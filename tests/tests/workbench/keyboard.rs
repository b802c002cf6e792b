//! The page without a mouse.

use crate::bench::{Bench, RUBBING};
use yawrig_tests::browser::{Browser, Window};

/// What has the focus, and whether that is seen.
const FOCUS: &str = "(() => { const e = document.activeElement, s = getComputedStyle(e); \
    return [e.id || e.dataset.focus || e.dataset.step || e.className, s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 1]; })()";

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_loop_with_keys_alone() {
    let second = "simulate --natural-frequency 9 --damping 0.01 --seed 2 --out calm.csv";
    let bench = Bench::start(&[RUBBING, second], "rubbing.csv calm.csv");
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    let status = |is: &str| format!("document.querySelector('#verdict').dataset.status === '{is}'");
    browser.wait(&status("structured"));
    browser.wait("document.querySelectorAll('.badge.pending').length === 0");
    // What is disabled or made anew is passed over or loses the focus.
    browser.wait("document.querySelector('.candidate') && !document.querySelector('#diagnose-button').disabled && !document.querySelector('#fit-button').disabled && document.body.dataset.busy === undefined");

    everything_is_come_to_in_order(&mut browser);

    // The list of keys.
    browser.value("document.activeElement.blur()");
    browser.key("?");
    browser.wait("document.querySelector('#help').open");
    let help = browser.text("#help");
    for words in ["next, previous release", "what is missing", "cancel", "zoom"] {
        assert!(help.contains(words), "{help}");
    }
    browser.key("Escape");
    browser.wait("!document.querySelector('#help').open");

    // The other release, out of the fit, and back.
    browser.key("j");
    browser.wait("document.querySelector('.release.selected').dataset.release === '1'");
    browser.key("f");
    browser.wait("!document.querySelector('[data-focus=fit-1]').checked");
    browser.key("k");
    browser.wait("document.querySelector('.release.selected').dataset.release === '0'");

    // Zoom.
    browser.wait("document.querySelector('#plot-overlay canvas')");
    browser.key("+");
    browser.key("z");

    // What is missing; the first of the list on trial, then into the model.
    browser.wait("!document.querySelector('#diagnose-button').disabled");
    browser.key("d");
    browser.wait("document.querySelector('#diagnosis').textContent.includes('coulomb_friction') && document.body.dataset.busy === undefined");
    browser.wait("document.querySelector('.candidate').dataset.effect === 'coulomb_friction'");
    while browser.value("document.querySelector('.candidate.current').dataset.effect")
        != "coulomb_friction"
    {
        browser.key("p");
    }
    browser.key("t");
    browser.wait(
        "document.querySelector('#message').textContent.includes('coulomb_friction tried in this release') && document.body.dataset.busy === undefined",
    );
    browser.key("a");
    browser.wait("document.querySelectorAll('#steps button').length === 2");
    browser.wait(&status("adequate"));
    assert!(bench.text("model.toml").contains("coulomb_friction"));
    assert!(!bench.text("model.toml").contains("calm.csv"), "it was not ticked");

    // Back.
    browser.wait("document.body.dataset.busy === undefined");
    browser.key("u");
    browser.wait("document.querySelectorAll('#steps button').length === 3");
    browser.wait(&status("structured"));
    browser.is_clean(&bench.origin);
}

/// From the top left to the bottom right, each seen.
fn everything_is_come_to_in_order(browser: &mut Browser) {
    browser.value("document.activeElement.blur()");
    let mut order = Vec::new();
    for _ in 0..60 {
        browser.key("Tab");
        let focus = browser.value(FOCUS);
        let name = focus[0].as_str().unwrap_or("").to_owned();
        if name.is_empty() || order.contains(&name) {
            break;
        }
        assert_eq!(focus[1], true, "the focus on {name} is not seen");
        order.push(name);
    }
    println!("{}", order.join(", "));
    let at = |name: &str| {
        order.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}: {order:?}"))
    };
    let path = [
        "help-button",
        "name-0",
        "fit-0",
        "fit-button",
        "panel-overlay",
        "tab-effects",
        "diagnose-button",
    ];
    assert!(path.windows(2).all(|pair| at(pair[0]) < at(pair[1])), "{order:?}");
}
