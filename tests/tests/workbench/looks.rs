//! Readable, nothing cut off, in both sizes and colours; and how long the first picture takes.

use crate::bench::{pictures, Bench};
use crate::refusals::campaign_with_a_gap;
use std::time::{Duration, Instant};
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::PATIENCE;

/// Elements of the page's frame that stick out of the window or of each other, or hide part of their own
/// text.
const CUT_OFF: &str = "(() => { const out = [], w = innerWidth, h = innerHeight; \
    if (document.documentElement.scrollWidth > w || document.documentElement.scrollHeight > h) out.push('the page scrolls'); \
    for (const e of document.querySelectorAll('#top, #releases, #panels, .live-top, .panel, #side, #steps-panel, #foot, .pane:not([hidden])')) { \
      if (!e.offsetParent) continue; \
      const r = e.getBoundingClientRect(); \
      if (r.left < -0.5 || r.top < -0.5 || r.right > w + 0.5 || r.bottom > h + 0.5 || r.width < 60 || r.height < 18) out.push(`${e.id}: ${r.left} ${r.top} ${r.right} ${r.bottom}`); } \
    const side = document.querySelector('#side').getBoundingClientRect().left; \
    for (const e of document.querySelectorAll('#panels, #live, .live-top, .live-head > *, .panel')) if (e.offsetParent && e.getBoundingClientRect().right > side - 0.5) out.push(`under the side: ${e.id || e.className}`); \
    const panels = [...document.querySelectorAll('.panel')].filter(e => e.offsetParent).map(e => [e.id, e.getBoundingClientRect()]); \
    for (const [a, p] of panels) for (const [b, q] of panels) if (a < b && p.left < q.right - 1 && q.left < p.right - 1 && p.top < q.bottom - 1 && q.top < p.bottom - 1) out.push(`${a} over ${b}`); \
    for (const e of document.querySelectorAll('.panel h3, .live-head, .live-head button, #figures dd, #figures dt, #top button, .nav-foot button, .tabs button, .candidate button, .chip strong, #steps .which, #verdict, #left-out')) \
      if (e.offsetParent && (e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX !== 'visible' || e.scrollHeight > e.clientHeight + 2 && getComputedStyle(e).overflowY !== 'visible')) out.push(`cut off: ${e.id || e.className} ${e.textContent}`); \
    for (const e of document.querySelectorAll('.plot')) { if (!e.offsetParent) continue; const c = e.querySelector('canvas'); if (!c) out.push(`nothing drawn: ${e.id}`); \
      else { const p = e.getBoundingClientRect(), q = c.getBoundingClientRect(); if (q.right > p.right + 1 || q.bottom > p.bottom + 1) out.push(`the plot is larger than its place: ${e.id}`); } } \
    return out; })()";

/// Asserts that nothing is cut off, once the page has been laid out anew; `what` is looked at.
#[track_caller]
pub fn nothing_is_cut_off(browser: &mut Browser, what: &str) {
    let until = Instant::now() + PATIENCE;
    loop {
        let found = browser.value(CUT_OFF);
        if found == serde_json::json!([]) {
            return;
        }
        assert!(Instant::now() < until, "{what}: {found}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Elements beside the panels that have moved since the page was opened, and how far, px.
const MOVED: &str = "new Promise(done => { const out = []; \
    new PerformanceObserver(list => { for (const shift of list.getEntries()) for (const s of shift.sources) \
      if (s.node && document.querySelector('#side').contains(s.node)) out.push(`${s.node.id || s.node.textContent}: ${s.currentRect.top - s.previousRect.top}`); \
    }).observe({type: 'layout-shift', buffered: true}); setTimeout(() => done(out), 200); })";

/// Contrast of each text colour on each ground, as WCAG has it.
const CONTRAST: &str = "(() => { const s = getComputedStyle(document.documentElement), out = {}; \
    const light = n => { const v = s.getPropertyValue('--' + n).trim(); const c = [1, 3, 5].map(k => parseInt(v.slice(k, k + 2), 16) / 255) \
      .map(x => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4); return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }; \
    for (const a of ['ink', 'soft', 'good', 'warn', 'bad', 'model', 'ghost', 'own', 'measured']) for (const b of ['card', 'paper']) { \
      const [x, y] = [light(a), light(b)].sort((p, q) => q - p); out[a + ' on ' + b] = (x + 0.05) / (y + 0.05); } return out; })()";

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn nothing_moves_from_under_the_mouse_as_the_page_opens() {
    let bench = Bench::start(
        &["simulate --spring K1 --out r.csv --effect coulomb_friction:c=0.05"],
        "r.csv",
    );
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("!document.querySelector('#law-button').disabled && document.querySelector('.badge.structured') && document.querySelector('.candidate')");
    assert_eq!(browser.value(MOVED), serde_json::json!([]));
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn sizes_and_colours_with_thirty_two_releases() {
    let bench = Bench::start(
        &["simulate --campaign rig --seconds 40 --effect coulomb_friction:c=0.05"],
        "rig/campaign.toml",
    );
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.documentElement.dataset.firstPicture");
    let first = browser.value("+document.documentElement.dataset.firstPicture");
    println!("first picture after {first} ms: 32 releases of 40 s at 1 kHz");
    browser.wait("document.querySelectorAll('.release').length === 32");
    browser.wait("document.querySelectorAll('.badge.pending').length === 0");
    let mut clicks = Vec::new();
    for id in [7, 20, 31, 3, 12, 0] {
        browser.value("delete document.documentElement.dataset.lastClick");
        browser.click(&format!("[data-focus=name-{id}]"));
        browser.wait("document.documentElement.dataset.lastClick");
        clicks.push(browser.value("+document.documentElement.dataset.lastClick").to_string());
    }
    println!("clicks on releases answered after {} ms", clicks.join(", "));
    for (width, height) in [(1024, 768), (1280, 720), (1920, 1080)] {
        for is_dark in [false, true] {
            browser.resize(Window { width, height, is_dark });
            browser.wait(&format!("innerWidth === {width}"));
            std::thread::sleep(Duration::from_millis(300));
            let name = format!("{width}x{height}-{}", if is_dark { "dark" } else { "light" });
            browser.picture(&pictures().join(format!("{name}.png")));
            nothing_is_cut_off(&mut browser, &name);
            let contrast = browser.value(CONTRAST);
            for (pair, value) in contrast.as_object().expect("pairs") {
                assert!(value.as_f64().expect("a number") >= 4.5, "{name}: {pair} {value}");
            }
        }
    }
    browser.is_clean(&bench.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_record_that_is_missing_is_said_to_be_left_out() {
    let (folder, place) = campaign_with_a_gap();
    let bench = Bench::start_in(folder, "rig/campaign.toml");
    let mut browser = Browser::start(Window { width: 1280, height: 720, is_dark: false });
    browser.open(&bench.url);
    browser.wait("document.querySelectorAll('.release').length === 8");
    browser.wait("document.querySelectorAll('.badge.pending').length === 0");
    let said = "document.querySelector('#left-out').textContent === 'K1 mid wind off is bad data and left out.'";
    browser.wait(said);
    // Another is looked at first; its ticks are not to be had.
    browser.wait("document.querySelector('.release.selected').dataset.badge === 'structured'");
    let bad = "[data-badge=bad]";
    assert_eq!(
        browser.value(&format!(
            "document.querySelectorAll('{bad} input:disabled:not(:checked)').length"
        )),
        2
    );
    for (width, height) in [(1280, 720), (1920, 1080)] {
        browser.resize(Window { width, height, is_dark: height > 1000 });
        browser.wait(&format!("innerWidth === {width}"));
        std::thread::sleep(Duration::from_millis(300));
        browser.picture(&pictures().join(format!("left-out-{width}x{height}.png")));
        nothing_is_cut_off(&mut browser, &width.to_string());
    }
    browser.click(&format!("{bad} button"));
    browser.wait(&format!("document.querySelector('#verdict').textContent.includes('{place}')"));
    browser.wait(
        "document.querySelector('#plot-overlay').textContent.includes('relative to the campaign')",
    );
    browser.picture(&pictures().join("bad-data.png"));
    browser.is_clean(&bench.origin);
}
