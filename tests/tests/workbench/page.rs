//! The loop by hand, in a browser.

use crate::bench::{pictures, Bench, RUBBING};
use serde_json::Value;
use std::path::Path;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;
use yawrig_tests::swinging;

const WINDOW: Window = Window { width: 1280, height: 720, is_dark: false };

fn steps(browser: &mut Browser) -> Vec<f64> {
    let found = browser
        .value("[...document.querySelectorAll('#steps button')].map(b => +b.dataset.overNoise)");
    found.as_array().expect("steps").iter().filter_map(Value::as_f64).collect()
}

fn steps_are(count: usize) -> String {
    format!("document.querySelectorAll('#steps button').length === {count}")
}

const IS_STRUCTURED: &str = "document.querySelector('#verdict').dataset.status === 'structured'";
const IS_ADEQUATE: &str = "document.querySelector('#verdict').dataset.status === 'adequate'";

/// The text of a file that the page's session has written; none where it is not there.
pub type Written<'a> = dyn Fn(&mut Browser, &str) -> Option<String> + 'a;

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_loop_by_hand() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    let written = |_: &mut Browser, name: &str| std::fs::read_to_string(bench.path(name)).ok();
    let added = the_loop(&mut browser, &written);
    assert_eq!(browser.value("location.search"), "", "the token stays in the address");
    let same = |ours: &Value, theirs: &Value| assert_eq!(ours, theirs);
    let theirs = the_model_is_that_of_the_commands(bench.folder.path(), &added, &same);
    assert_eq!(added[0], theirs);
    an_own_effect_is_written(&mut browser, &written);
    the_commands_go_on(bench.folder.path());
    browser.is_clean(&bench.origin);
}

/// A record is open on the page: what it lacks is found, tried, added, and taken back; the model and the journal as
/// they were once it had been added.
pub fn the_loop(browser: &mut Browser, written: &Written) -> [String; 2] {
    // The failing verdict.
    browser.wait(IS_STRUCTURED);
    assert!(browser.text("#verdict").starts_with("This record: something is missing"));
    // Of one record there is one verdict.
    assert_eq!(browser.value("document.querySelector('#verdict-all').hidden"), true);
    // The figures come after the verdict.
    browser.wait("document.querySelector('#figure-white').textContent.includes('not white')");
    browser.wait("document.querySelector('.badge.structured')");

    // What is missing, on trial.
    browser.click("#diagnose-button");
    browser.wait("document.querySelector('#diagnosis').textContent.includes('explained by coulomb_friction')");
    assert_eq!(
        browser.value("document.querySelector('.candidate').dataset.effect"),
        "coulomb_friction"
    );
    assert_eq!(
        browser.text(".candidate .name"),
        "coulomb_friction",
        "named as on the command line"
    );
    browser.click("[data-effect=coulomb_friction] [data-focus=try-coulomb_friction]");
    browser.wait("document.querySelector('#message').textContent.includes('coulomb_friction tried in this release') && document.body.dataset.busy === undefined");
    browser.hover(600.0, 180.0);
    browser.picture(&pictures().join("trial.png"));
    assert_eq!(written(browser, "model.toml"), None, "a trial writes nothing");

    // The right effect: the staircase falls.
    browser.click("[data-effect=coulomb_friction] [data-focus=add-coulomb_friction]");
    browser.wait(&steps_are(2));
    browser.wait(IS_ADEQUATE);
    let stairs = steps(browser);
    assert!(stairs[0] > 2.0 * stairs[1] && stairs[1] < 1.1, "{stairs:?}");
    // So does what was held out: the later part of the record.
    let held = browser.value("+document.querySelector('#figure-held').textContent");
    assert!(held.as_f64().is_some_and(|held| held < 1.3), "{held}");
    browser.picture(&pictures().join("added.png"));
    let added = MODEL.map(|name| written(browser, name).unwrap_or_else(|| panic!("no {name}")));

    // A wrong one is rejected, with a note.
    browser.click("[data-focus=reject-cubic_damping]");
    browser.fill("[data-focus=note-cubic_damping]", "the wind was off");
    browser.key("Enter");
    browser.wait(&steps_are(3));
    browser.wait("document.querySelector('[data-effect=cubic_damping]').textContent.includes('the wind was off')");

    // Back a step.
    browser.click("#steps button[data-step='1']");
    browser.wait(&steps_are(4));
    browser.wait(IS_STRUCTURED);
    added
}

/// What a step writes.
pub const MODEL: [&str; 2] = ["model.toml", "model.journal.jsonl"];

/// The command line goes on from there.
pub fn the_commands_go_on(folder: &Path) {
    let history = yawrig("history --json").in_folder(folder).run().exits(0).json();
    let done: Vec<&str> = history["steps"]
        .as_array()
        .expect("steps")
        .iter()
        .filter_map(|s| s["action"].as_str())
        .collect();
    assert_eq!(done, ["fit", "add", "reject", "return", "add"]);
    assert_eq!(history["edited"], false);
    yawrig("compare --json").in_folder(folder).run().exits(0);
}

/// An own effect: wrong, with the error under its character, then right.
pub fn an_own_effect_is_written(browser: &mut Browser, written: &Written) {
    browser.click("#tab-own");
    browser.fill("[data-field=moment]", "-c * sgn(r)");
    browser.wait("!document.querySelector('#own-error').hidden");
    let said = browser.text("#own-error");
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!((lines[0], lines[1]), ("-c * sgn(r)", "     ^^^"), "{said}");
    assert!(said.contains("sign"), "{said}");
    assert_eq!(browser.value("document.querySelector('#own-add').disabled"), true);
    browser.picture(&pictures().join("own-error.png"));
    browser.fill("[data-field=moment]", "-c * sign(r)");
    browser.wait("document.querySelector('#own-error').hidden && !document.querySelector('#own-add').disabled");
    browser.wait("!document.querySelector('.key.own').hidden");
    browser.picture(&pictures().join("own.png"));
    // With memory: an error in its state, a right one, of which there is no curve, and none again.
    browser.click("#own-more-states");
    browser.fill("[data-field='states.0.rate']", "b - z");
    browser.wait("document.querySelector(\"[data-field='states.0.rate']\").ariaInvalid === 'true'");
    browser.fill("[data-field='states.0.rate']", "(b - z) / 0.3");
    browser.fill("[data-field=moment]", "-c * z / 0.01");
    browser.wait(
        "document.querySelector('.key.own').hidden && !document.querySelector('#own-add').disabled",
    );
    let warned = browser.text("#own-error");
    assert!(warned.starts_with("at its start values this puts energy into a swing"), "{warned}");
    assert!(warned.contains("\nhelp: ") && !warned.contains(".toml"), "{warned}");
    browser.picture(&pictures().join("own-state.png"));
    browser.value("document.querySelector(\"[aria-label='take state 1 away']\").click()");
    browser.fill("[data-field=moment]", "-c * sign(r)");
    browser.wait("!document.querySelector('.key.own').hidden && !document.querySelector('#own-add').disabled");
    browser.click("#own-add");
    browser.wait(&steps_are(5));
    browser.wait(IS_ADEQUATE);
    let stairs = steps(browser);
    assert!(stairs[3] > 2.0 * stairs[4] && stairs[4] < 1.1, "{stairs:?}");
    assert!(written(browser, "model.toml").is_some_and(|text| text.contains("my_effect")));
}

/// A model and its journal are those that the commands make of the record, as `same` has it; the text of theirs.
pub fn the_model_is_that_of_the_commands(
    record: &Path,
    added: &[String; 2],
    same: &dyn Fn(&Value, &Value),
) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::copy(record.join("rubbing.csv"), folder.path().join("rubbing.csv")).expect("room");
    let run = |arguments: &str| yawrig(arguments).in_folder(folder.path()).run().exits(0);
    run("fit rubbing.csv");
    run("add coulomb_friction");
    let theirs = MODEL.map(|name| std::fs::read_to_string(folder.path().join(name)).expect(name));
    let [ours, made] = [added, &theirs].map(|[model, journal]| {
        let model: toml::Table = model.parse().expect("TOML");
        let step = |line: &str| {
            let mut step: Value = serde_json::from_str(line).expect("JSON");
            for own in ["time_utc", "command"] {
                step.as_object_mut().expect("a step").remove(own).expect(own);
            }
            // The model's text, whose numbers may be other digits' there.
            let text = step["model"].as_str().expect("a text").parse::<toml::Table>();
            step["model"] = serde_json::to_value(text.expect("TOML")).expect("JSON");
            step
        };
        let journal: Vec<Value> = journal.lines().map(step).collect();
        serde_json::json!({ "model": model, "journal": journal })
    });
    same(&ours, &made);
    let [model, _] = theirs;
    model
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_step_on_the_command_line_shows_on_the_page() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    browser.wait(IS_STRUCTURED);
    let run = |arguments: &str| yawrig(arguments).in_folder(bench.folder.path()).run().exits(0);
    run("fit rubbing.csv");
    browser.wait(&steps_are(1));
    run("add coulomb_friction");
    browser.wait(&steps_are(2));
    browser.wait(IS_ADEQUATE);
    let says =
        |words: &str| format!("document.querySelector('#message').textContent.includes('{words}')");
    browser.wait(&says("step 2, taken outside this page: add coulomb_friction"));
    // A file that is broken by hand is said to be, and corrected again.
    let good = bench.text("model.toml");
    std::fs::write(bench.path("model.toml"), good.replace("schema_version", "version"))
        .expect("room");
    browser.wait("document.querySelector('#verdict').dataset.status === 'bad'");
    assert!(browser.text("#verdict").contains("model.toml"));
    browser.wait("document.querySelector('#message').className === 'error'");
    assert!(!browser.text("#subtitle").contains("not made yet"));
    assert!(browser.text("#in-model").contains("cannot be used"));
    std::fs::write(bench.path("model.toml"), good).expect("room");
    browser.wait(IS_ADEQUATE);
    browser.wait(&says("model.toml can be used again"));
    // And one that is edited by hand.
    let edited = bench.text("model.toml").replace("max = 0.7", "max = 0.6");
    std::fs::write(bench.path("model.toml"), edited).expect("room");
    browser.wait(&says("edited by hand"));
    browser.is_clean(&bench.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_head_says_of_what_it_speaks() {
    let plain = "simulate --natural-frequency 7.5 --damping 0.008 --seed 3 --out plain.csv";
    let bench = Bench::start(&[RUBBING, plain], "plain.csv rubbing.csv");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    browser.wait("document.querySelectorAll('.badge.pending').length === 0 && document.querySelectorAll('.release').length === 2");
    // The one in view is explained, of those that are ticked one is not.
    browser.wait(IS_ADEQUATE);
    assert_eq!(
        browser.text("#verdict"),
        "This record: the second-order model explains it to the noise."
    );
    assert!(
        browser.text("#verdict-all").starts_with("All 2 ticked: 1 not explained, "),
        "{}",
        browser.text("#verdict-all")
    );
    assert!(browser.text("#verdict-all").contains("rubbing.csv"));
    browser.wait("document.querySelector('#figure-one').className === 'good' && document.querySelector('#figure-fitted').className === 'warn'");
    browser.picture(&pictures().join("two-verdicts.png"));
    // Ticked alone it is all there is to be said of.
    browser.click("[data-focus=name-1]");
    browser.wait(IS_STRUCTURED);
    assert_eq!(browser.value("document.querySelector('#verdict-all').hidden"), false);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn what_is_looked_at_is_in_the_address_and_the_report_on_a_button() {
    let plain = "simulate --natural-frequency 7.5 --damping 0.008 --seed 3 --out plain.csv";
    let fit = "fit plain.csv rubbing.csv";
    let bench = Bench::start(&[RUBBING, plain, fit], "model.toml");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    browser.wait("location.hash === '#record=plain.csv'");
    browser.wait("document.querySelectorAll('.badge.pending').length === 0");
    let time = "[...document.querySelectorAll('#plot-overlay .u-over')].length";
    browser.wait(&format!("{time} === 1"));

    // By the wheel with Ctrl, about the pointer; without it the page scrolls.
    let turn = |keys: &str| {
        format!(
            "(() => {{ const plot = document.querySelector('#plot-overlay .u-over'), box = plot.getBoundingClientRect(); \
             return plot.dispatchEvent(new WheelEvent('wheel', {{ deltaY: -200, clientX: box.left + box.width / 2, clientY: box.top + 20, bubbles: true, cancelable: true, {keys} }})); }})()"
        )
    };
    assert_eq!(browser.value(&turn("")), true);
    assert_eq!(browser.value(&turn("ctrlKey: true")), false);
    browser.wait("new URLSearchParams(location.hash.slice(1)).has('from_s')");
    let at = "(() => { const at = new URLSearchParams(location.hash.slice(1)); return [+at.get('from_s'), +at.get('to_s')]; })()";
    let span: Vec<f64> = serde_json::from_value(browser.value(at)).expect("two times");
    let whole = "import('./panels.js').then(p => p.seen.curves.whole_s)";
    let whole: Vec<f64> = serde_json::from_value(browser.value(whole)).expect("two times");
    let share = (span[1] - span[0]) / (whole[1] - whole[0]);
    assert!((share - (-1f64).exp()).abs() < 0.05, "{span:?} of {whole:?}");

    // Loaded anew, and by a bookmark.
    browser.click("#tab-derivatives");
    browser.wait("location.hash.endsWith('&tab=derivatives')");
    let here = browser.value("location.href");
    browser.open("about:blank");
    browser.open(here.as_str().expect("an address"));
    let shown = format!(
        "import('./panels.js').then(p => p.seen.curves && p.seen.span[0] === {} && !document.querySelector('#pane-derivatives').hidden)",
        span[0]
    );
    browser.wait(&shown);
    assert_eq!(browser.value("location.href"), here);
    // What the page writes there itself before it hears of it is not written over it.
    browser.value("location.hash = 'record=rubbing.csv&from_s=2&to_s=4', document.querySelector('#tab-effects').click()");
    browser.wait("import('./panels.js').then(p => p.seen.curves && p.seen.span.join() === '2,4')");
    browser.wait("document.title.startsWith('rubbing.csv')");
    // What no stretch of the record is shows all of it.
    for nonsense in ["from_s=4&to_s=2", "from_s=soon&to_s=4", "from_s=2"] {
        browser.value(&format!("location.hash = 'record=plain.csv&{nonsense}'"));
        browser.wait(
            "document.title.startsWith('plain.csv') && location.hash === '#record=plain.csv'",
        );
        let seen = "import('./panels.js').then(p => p.seen.fault === null && p.seen.curves !== null && p.seen.span.join() === ',')";
        browser.wait(seen);
        browser.value("location.hash = 'record=rubbing.csv'");
        browser.wait("document.title.startsWith('rubbing.csv')");
    }
    browser.value("location.hash = 'record=plain.csv&from_s=1000&to_s=2000'");
    browser.wait("document.querySelector('#plot-overlay').textContent.includes('the record has nothing between 1000 s and 2000 s')");
    // The refusal, as the browser tells it.
    assert!(browser.complaints.iter().all(|said| said.contains("from=1000&to=2000")));
    browser.complaints.clear();
    browser.key("z");
    browser.wait("location.hash === '#record=plain.csv' && import('./panels.js').then(p => p.seen.curves !== null)");
    browser.value("location.hash = 'record=gone.csv'");
    browser.wait("document.querySelector('#message').textContent.includes('the address is of gone.csv, which is not in the list')");

    browser.click("#report-button");
    browser.wait(
        "document.querySelector('#message').textContent === 'report.html is among your downloads'",
    );
    let report =
        browser.value("import('./talk.js').then(t => t.get('/api/report')).then(r => r.html)");
    let report = report.as_str().expect("a page");
    assert!(report.contains("rubbing.csv") && report.contains("yawrig report"), "{report:.300}");
    browser.picture(&pictures().join("address.png"));
    browser.is_clean(&bench.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_critical_speed_stands_under_the_derivatives() {
    let folder = tempfile::tempdir().expect("a folder");
    swinging::campaign(folder.path());
    for command in ["fit campaign.toml", "add cubic_damping"] {
        yawrig(command).in_folder(folder.path()).run().exits(0);
    }
    let bench = Bench::start_in(folder, "model.toml");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    browser.wait("document.querySelector('.release')");
    browser.click("#tab-derivatives");
    browser.wait("document.querySelector('.critical')");
    let said = browser.text(".critical p");
    let words: Vec<f64> = said.split(' ').filter_map(|word| word.parse().ok()).collect();
    let [speed, u] = words[..] else { panic!("{said}") };
    assert!((speed - swinging::CRITICAL_M_S).abs() < 3.0 * u && u < 0.1, "{said}");
    let rows =
        "[...document.querySelectorAll('.critical tbody tr')].map(r => r.cells[1].textContent)";
    let rows: Vec<String> = serde_json::from_value(browser.value(rows)).expect("rows");
    println!("{said}\n{rows:?}");
    assert!(rows.len() >= 4 && rows[0].starts_with("0.02"), "{rows:?}");
    browser.picture(&pictures().join("critical.png"));
    browser.is_clean(&bench.origin);
}

/// Panels that are said to those who do not see them, and those whose picture is wider than their place.
const UNSAID: &str = "[...document.querySelectorAll('#panels .plot')].filter(p => p.role !== 'img' || !p.ariaLabel).map(p => p.id)";
const TOO_WIDE: &str = "[...document.querySelectorAll('.panel')].filter(p => p.offsetParent).filter(p => p.getBoundingClientRect().right > document.body.getBoundingClientRect().right + 1 \
    || [...p.querySelectorAll('canvas')].some(c => c.getBoundingClientRect().right > p.getBoundingClientRect().right + 1)).map(p => p.id)";

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn panels_tell_what_they_show_and_are_printed_whole() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let mut browser = Browser::start(WINDOW);
    browser.open(&bench.url);
    browser.wait(IS_STRUCTURED);
    browser.wait(&format!("{UNSAID}.length === 0"));
    let said = browser.value("document.querySelector('#plot-residual').ariaLabel");
    assert!(said.as_str().expect("words").contains("times the noise, not white"), "{said}");
    // Values under the pointer.
    browser.hover(600.0, 180.0);
    browser.wait("document.querySelector('#plot-overlay .pointed:not([hidden])')?.textContent.match(/ s · measured .* deg · model .* deg$/)");
    browser.picture(&pictures().join("pointed.png"));
    // As on paper: higher than a window, nothing beside the column.
    browser.value("dispatchEvent(new Event('beforeprint'))");
    browser.wait(&format!(
        "document.documentElement.scrollHeight > innerHeight && {TOO_WIDE}.length === 0"
    ));
    browser.picture(&pictures().join("printed.png"));
    browser.value("dispatchEvent(new Event('afterprint'))");
    browser.wait("document.documentElement.scrollHeight <= innerHeight");
    browser.is_clean(&bench.origin);
}
