//! Each page in each of its states as axe sees it: by WCAG 2 to level AA and by best practice nothing is found.

use crate::bench::{Bench, RUBBING};
use crate::refusals::campaign_with_a_gap;
use crate::still::{dropped, Served};
use serde_json::Value;
use std::path::Path;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

const WINDOW: Window = Window { width: 1280, height: 800, is_dark: false };
const AXE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../target/page/node_modules/axe-core/axe.min.js");
/// Laid out anew, or, where no frame comes, a second later.
const IS_DRAWN: &str = "new Promise(done => { requestAnimationFrame(() => requestAnimationFrame(done)); setTimeout(done, 1000); })";
const RUN: &str = "axe.run({ runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'], resultTypes: ['violations'] })\
    .then(({ violations }) => violations.flatMap(v => v.nodes.map(n => `${v.id}: ${n.target.join(' ')}: ${n.failureSummary}`)))";

/// A browser, and what was found on what it showed.
struct Seen {
    browser: Browser,
    axe: String,
    found: Vec<String>,
}

impl Seen {
    fn by(browser: Browser) -> Self {
        let axe = std::fs::read_to_string(AXE);
        let axe = axe.unwrap_or_else(|_| panic!("axe is missing: run tests/page/check --install"));
        Self { browser, axe: axe + "; true", found: Vec::new() }
    }

    fn opened(url: &str) -> Self {
        let mut browser = Browser::start(WINDOW);
        browser.open(url);
        Self::by(browser)
    }

    /// Looks at the page as it is: wide and narrow, light and dark.
    #[track_caller]
    fn look(&mut self, state: &str) {
        println!("{state}");
        if self.browser.value("typeof axe") == "undefined" {
            // Evaluated, not put into the page: its policy lets no other script in.
            assert_eq!(self.browser.value(&self.axe), true);
        }
        // As a desk at last, where the test goes on.
        for (width, height, is_dark) in
            [(390, 844, true), (390, 844, false), (1280, 800, true), (1280, 800, false)]
        {
            self.browser.resize(Window { width, height, is_dark });
            self.browser.wait(&format!("innerWidth === {width}"));
            self.browser.value(IS_DRAWN);
            let at = format!("{state}, {width} px, {}", if is_dark { "dark" } else { "light" });
            let found = self.browser.value(RUN);
            let found = found.as_array().expect("findings").iter().filter_map(Value::as_str);
            self.found.extend(found.map(|what| format!("{at}: {what}")));
        }
    }

    #[track_caller]
    fn wait(&mut self, selector: &str) {
        let is_idle = "document.body.dataset.busy === undefined";
        self.browser.wait(&format!("{is_idle} && document.querySelector({selector:?})"));
    }

    /// Clicks, waits until that is on the page, and looks.
    #[track_caller]
    fn click(&mut self, selector: &str, until: &str, state: &str) {
        self.browser.click(selector);
        self.wait(until);
        self.look(state);
    }

    /// A dialog, which is closed again.
    #[track_caller]
    fn dialog(&mut self, button: &str, id: &str) {
        self.click(button, &format!("#{id}[open]"), id);
        self.browser.value(&format!("document.querySelector('#{id}').close()"));
    }

    #[track_caller]
    fn found_nothing(mut self, origin: &str) {
        assert!(self.found.is_empty(), "{}", self.found.join("\n"));
        self.browser.is_clean(origin);
    }
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_workbench_of_a_record() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let mut seen = Seen::opened(&bench.url);
    seen.wait("body:has(.badge.structured, .candidate) #law-button:enabled");
    seen.look("opened");
    seen.click("#diagnose-button", "#diagnosis .verdict", "diagnosed");
    seen.click("#law-button", "#law li", "the law");
    seen.click("[data-focus=add-coulomb_friction]", "#steps li:nth-child(2)", "an effect added");
    seen.browser.click("[data-focus=reject-cubic_damping]");
    seen.browser.fill("[data-focus=note-cubic_damping]", "the wind was off");
    seen.browser.key("Enter");
    seen.wait("#steps li:nth-child(3)");
    seen.look("an effect rejected, with its card");
    seen.click("#tab-own", "#pane-own:not([hidden])", "an own effect");
    seen.browser.fill("[data-field=moment]", "-c * sgn(r)");
    seen.click("#own-more-states", "[data-field=moment][aria-invalid]", "an own effect, wrong");
    seen.click("#tab-derivatives", "#pane-derivatives p", "no derivatives");
    seen.browser.click("#tab-effects");
    seen.dialog("#help-button", "help");
    seen.dialog("#open-button", "open-dialog");
    dropped(&mut seen.browser, "two.csv", "t,x,z\n0,1,2\n0.1,2,1\n0.2,1,0\n0.3,0,1\n");
    seen.wait("#drop-dialog[open]");
    seen.look("drop-dialog");
    seen.found_nothing(&bench.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_workbench_of_a_campaign() {
    let (folder, _) = campaign_with_a_gap();
    let bench = Bench::start_in(folder, "rig/campaign.toml");
    let mut seen = Seen::opened(&bench.url);
    seen.wait("#release-list:has([data-release='7']):not(:has(.pending))");
    seen.wait(".candidate");
    seen.look("a campaign");
    seen.browser.click("#fit-button");
    seen.wait("#steps button");
    seen.click("#tab-derivatives", "#plot-derivatives canvas", "derivatives");
    seen.browser.key("g");
    seen.wait("#campaign-dialog[open]:has(.pool .file) #campaign-wrong li");
    seen.look("campaign-dialog");
    seen.browser.value("document.querySelector('#campaign-dialog').close()");
    seen.click("[data-badge=bad] button", "#verdict[data-status=bad]", "bad data");
    seen.found_nothing(&bench.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_workbench_without_a_record_and_a_device() {
    let bench = Bench::start(&[], "");
    let mut seen = Seen::opened(&bench.url);
    seen.wait("#release-list .empty");
    seen.look("empty");
    seen.click("#live-button", "#live-device option[value=emulated]", "live");
    let chosen = |id: &str, value: &str| {
        format!("(() => {{ const e = document.querySelector('#{id}'); e.value = '{value}'; e.dispatchEvent(new Event('change')); }})()")
    };
    seen.browser.value(&chosen("live-speed", "100"));
    seen.click("#live-connect", "#live-log li:nth-child(13)", "a device followed");
    seen.browser.click("#live-connect");
    seen.browser.wait("document.querySelector('#live-connect').textContent === 'Connect'");
    seen.browser.value(&chosen("live-source", "session"));
    seen.wait("#live-session:not([hidden])");
    seen.look("stored sessions");
    seen.found_nothing(&bench.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_page_without_a_server() {
    let served = Served::start();
    let mut seen = Seen::by(served.opened());
    seen.look("empty");
    served.drop(&mut seen.browser, "rubbing.csv");
    seen.wait("#diagnosis .verdict");
    seen.look("diagnosed");
    seen.click("#printed summary", "#printed-diagnose:not(:empty)", "what is printed");
    seen.dialog("#save-button", "save-dialog");
    seen.dialog("#phone-button", "phone-dialog");
    seen.click("#live-button", "#live:not([hidden])", "a board");
    seen.click("#board-first summary", "#board-first[open]", "a board without yawrig");
    seen.found_nothing(&served.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_reports() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = "simulate --campaign rig --seconds 10 --rate-hz 200 --effect coulomb_friction:c=0.05";
    for command in [RUBBING, rig, "fit rubbing.csv", "add coulomb_friction"] {
        yawrig(command).in_folder(folder.path()).run().exits(0);
    }
    let address = |of: &Path| format!("file://{}", of.display());
    let mut seen = Seen::opened("about:blank");
    for of in ["rubbing.csv", "rig/campaign.toml", "model.toml"] {
        yawrig(&format!("report {of} --force")).in_folder(folder.path()).run().exits(0);
        seen.browser.open(&address(&folder.path().join("report.html")));
        // Of what is closed the first is open.
        seen.look(&format!("the report of {of}"));
    }
    seen.found_nothing(&address(folder.path()));
}
