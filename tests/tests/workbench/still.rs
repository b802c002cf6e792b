//! The page that needs no server of ours: written to a folder, served by any, it answers as the program prints.

use crate::bench::{pictures, RUBBING};
use crate::looks::nothing_is_cut_off;
use crate::page::{
    an_own_effect_is_written, the_commands_go_on, the_loop, the_model_is_that_of_the_commands,
    MODEL,
};
use crate::plug::Plug;
use serde_json::{json, Value};
use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::process::yawrig;

pub const WINDOW: Window = Window { width: 1280, height: 800, is_dark: false };
/// A record whose decay is that of a second-order model, at a rate of its own.
const PLAIN: &str =
    "simulate --natural-frequency 9.1 --damping 0.011 --rate-hz 250 --seed 4 --out plain.csv";

/// The page's folder on a server that knows nothing but files.
pub struct Served {
    folder: TempDir,
    pub origin: String,
}

impl Served {
    pub fn start() -> Self {
        Self::beside(None)
    }

    /// With what is at the browser's plug.
    pub fn beside(plug: Option<Arc<Plug>>) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for command in [RUBBING, PLAIN] {
            yawrig(command).in_folder(folder.path()).run().exits(0);
        }
        let said = yawrig("workbench --static page").in_folder(folder.path()).run().exits(0);
        assert_eq!(said.stdout.trim(), "page/index.html");
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let origin = format!("http://{}", listener.local_addr().expect("its address"));
        let page = folder.path().join("page");
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (page, plug) = (page.clone(), plug.clone());
                std::thread::spawn(move || serve(stream, &page, plug.as_deref()));
            }
        });
        Self { folder, origin }
    }

    /// A browser with the page, nothing in it yet.
    pub fn opened(&self) -> Browser {
        let mut browser = Browser::start(WINDOW);
        browser.open(&format!("{}/", self.origin));
        browser.wait(IS_EMPTY);
        browser
    }

    /// The page's files.
    pub fn page(&self) -> PathBuf {
        self.folder.path().join("page")
    }

    pub fn printed(&self, arguments: &str) -> String {
        yawrig(arguments).in_folder(self.folder.path()).run().exits(0).stdout
    }

    /// The text of a record.
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.folder.path().join(name)).expect(name)
    }

    /// Drops this record on the page.
    pub fn drop(&self, browser: &mut Browser, name: &str) {
        dropped(browser, name, &self.read(name));
    }

    fn drop_all(&self, browser: &mut Browser, names: &[&'static str]) {
        let read = |name: &&'static str| (*name, self.read(name));
        dropped_all(browser, &names.iter().map(read).collect::<Vec<_>>());
    }
}

pub fn dropped(browser: &mut Browser, name: &str, text: &str) {
    dropped_all(browser, &[(name, text.to_owned())]);
}

/// Drops these files at once.
fn dropped_all(browser: &mut Browser, files: &[(&str, String)]) {
    browser.value(&dropping(files));
}

/// The script that drops these files at once.
pub fn dropping(files: &[(&str, String)]) -> String {
    let files = serde_json::to_string(files).expect("texts");
    format!(
        "(() => {{ const held = new DataTransfer(); for (const [name, text] of {files}) held.items.add(new File([text], name)); \
         document.dispatchEvent(new DragEvent('drop', {{ dataTransfer: held, bubbles: true, cancelable: true }})); return 1; }})()"
    )
}

/// Answers one request with the file of that name.
fn serve(mut stream: TcpStream, page: &Path, plug: Option<&Plug>) {
    let mut head = Vec::new();
    let mut byte = [0];
    while !head.ends_with(b"\r\n\r\n") && matches!(stream.read(&mut byte), Ok(1)) {
        head.push(byte[0]);
    }
    let head = String::from_utf8_lossy(&head).into_owned();
    let path = head.split(' ').nth(1).unwrap_or("/").trim_start_matches('/');
    if let (Some(plug), Some(what)) = (plug, path.strip_prefix("plug/")) {
        return plug.serve(what, &head, stream);
    }
    let path = PathBuf::from(if path.is_empty() { "index.html" } else { path });
    let kind = match path.extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html",
        Some("js") => "text/javascript",
        Some("css") => "text/css",
        Some("svg") => "image/svg+xml",
        _ => "application/octet-stream",
    };
    let body = std::fs::read(page.join(&path));
    let status = if body.is_ok() { "200 OK" } else { "404 Not Found" };
    let body = body.unwrap_or_default();
    let length = body.len();
    let head = format!("HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n");
    // A browser that has gone away wants it no more.
    let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&body));
}

/// What the page's worker prints of its `release`th record.
pub fn printed(browser: &mut Browser, verb: &str, release: usize) -> Value {
    browser.value(&printing(verb, release))
}

/// The script that asks for it.
pub fn printing(verb: &str, release: usize) -> String {
    format!("import('./talk.js').then(t => t.get('/api/printed', {{ verb: '{verb}', release: {release} }}))")
}

/// A file that the page holds.
fn held(browser: &mut Browser, name: &str) -> Option<String> {
    let text = browser.value(&format!(
        "import('./backend.js').then(b => b.file('{name}')).then(bytes => bytes && new TextDecoder().decode(bytes))"
    ));
    text.as_str().map(str::to_owned)
}

/// A value with its uncertainty is the same to a millionth of that, all else to a millionth of itself: more than
/// is printed, which is compared as it stands. Sines and powers are another library's in a browser, and round
/// otherwise in the last digit; covariances, the worst, came out the same to 3e-8.
fn are_same(page: &Value, program: &Value, at: &str, u: Option<f64>) {
    match (page, program) {
        (Value::Object(a), Value::Object(b)) => {
            for (key, value) in b {
                // How long it took.
                if key == "seconds" {
                    continue;
                }
                let u = b.get("u").and_then(Value::as_f64).filter(|_| key == "value");
                are_same(&a[key], value, &format!("{at}.{key}"), u);
            }
            assert_eq!(a.len(), b.len(), "{at}");
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{at}");
            for (k, (a, b)) in a.iter().zip(b).enumerate() {
                are_same(a, b, &format!("{at}[{k}]"), None);
            }
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
            let least = 1e-6 * u.unwrap_or(b).abs();
            assert!((a - b).abs() <= least.max(1e-12), "{at}: {a} and {b}");
        }
        _ => assert_eq!(page, program, "{at}"),
    }
}

/// What the module calls is in its script: nothing that speaks to a host, but for the loading of the module by
/// its address, which the page does itself.
fn the_worker_cannot_ask(served: &Served) {
    let text = |name: &str| {
        std::fs::read_to_string(served.folder.path().join("page").join(name)).expect(name)
    };
    let script = text("yawrig.js");
    assert_eq!(script.matches("fetch(module_or_path)").count(), 1);
    let script = script.replace("fetch(module_or_path)", "");
    for speaks in
        ["fetch(", "XMLHttpRequest", "WebSocket", "EventSource", "sendBeacon", "importScripts"]
    {
        for of in [&script, &text("worker.js")] {
            assert!(!of.contains(speaks), "{speaks}");
        }
    }
}

pub const IS_EMPTY: &str =
    "document.querySelector('#verdict').textContent.startsWith('Drop the record')";
pub const IS_IDLE: &str = "document.body.dataset.busy === undefined";
/// Dry friction was found.
pub const IS_FOUND: &str =
    "document.querySelector('#diagnosis').textContent.includes('explained by coulomb_friction')";

pub fn steps_are(count: usize) -> String {
    format!("document.querySelectorAll('#steps button').length === {count}")
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_record_dropped_on_the_page_is_judged_as_the_program_judges_it() {
    let served = Served::start();
    let mut browser = served.opened();
    served.drop(&mut browser, "rubbing.csv");
    // By itself, where it is the only one.
    browser.wait(&format!("{IS_FOUND} && {IS_IDLE}"));
    served.drop(&mut browser, "plain.csv");
    browser.wait("document.querySelector('.release.selected')?.dataset.release === '1'");
    browser.click("#diagnose-button");
    browser.wait(&format!(
        "document.querySelector('#diagnosis').textContent.includes('is adequate') && {IS_IDLE}"
    ));
    for (id, name) in ["rubbing.csv", "plain.csv"].into_iter().enumerate() {
        for verb in ["identify", "diagnose"] {
            // To the last digit that is printed.
            let page = printed(&mut browser, verb, id);
            let text = page["text"].as_str().expect("a text");
            assert_eq!(text.trim_end(), served.printed(&format!("{verb} {name}")).trim_end());
            let program = served.printed(&format!("{verb} {name} --json"));
            are_same(&page["json"], &serde_json::from_str(&program).expect("JSON"), verb, None);
        }
    }
    browser.click("#printed summary");
    let shown = served.printed("diagnose plain.csv");
    browser.wait(&format!(
        "document.querySelector('#printed-diagnose').textContent.trim() === {:?}",
        shown.trim_end()
    ));

    // Where the browser has no room for it, it is said that the session will be gone.
    let will_be_gone =
        "document.querySelector('#nothing-sent').textContent.includes('gone once it is closed')";
    assert_eq!(browser.value(will_be_gone), false);
    browser.value(
        "(IDBObjectStore.prototype.put = () => { throw new Error('no room'); }, \
         import('./talk.js').then(t => t.post('/api/do', { do: 'tick', releases: [0], used: 'out' })))",
    );
    browser.wait(will_be_gone);

    // What is no record is refused in the words of the program.
    dropped(&mut browser, "notes.csv", "nothing,of\nthe,kind\n");
    browser.wait("document.querySelector('#message').className === 'error' || document.querySelector('#drop-dialog').open");
    browser.value("document.querySelector('#drop-dialog').close()");
    browser.is_clean(&served.origin);
    the_worker_cannot_ask(&served);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_loop_by_hand_without_a_server() {
    let served = Served::start();
    let mut browser = served.opened();
    served.drop(&mut browser, "rubbing.csv");
    let added = the_loop(&mut browser, &held);
    let same = |ours: &Value, theirs: &Value| are_same(ours, theirs, "the model", None);
    the_model_is_that_of_the_commands(served.folder.path(), &added, &same);
    an_own_effect_is_written(&mut browser, &held);
    for (width, height, is_dark) in
        [(1280, 800, false), (1920, 1080, true), (800, 900, true), (390, 844, false)]
    {
        browser.resize(Window { width, height, is_dark });
        if width > 900 {
            nothing_is_cut_off(&mut browser, "the page without a server");
        }
        browser.picture(&pictures().join(format!("static-{width}.png")));
        let overflow = browser.value("document.documentElement.scrollWidth - innerWidth");
        assert!(overflow.as_f64().is_some_and(|x| x <= 0.0), "{width}: {overflow}");
    }

    // Closed and opened again it goes on, and the law can be measured.
    browser.resize(WINDOW);
    browser.open(&format!("{}/", served.origin));
    browser.wait(&steps_are(5));
    browser.wait("document.querySelector('#verdict').dataset.status === 'adequate'");
    browser.click("#law-button");
    browser.wait(&format!(
        "document.querySelector('#law').textContent.includes('Measure again') && {IS_IDLE}"
    ));

    // What is saved is what the program reads.
    browser.click("#save-button");
    browser.wait("document.querySelector('#save-dialog').open");
    let names =
        browser.value("[...document.querySelectorAll('[data-save]')].map(b => b.dataset.save)");
    assert_eq!(names, json!([MODEL[1], MODEL[0], "report.html", "identify.json", "diagnose.json"]));
    for name in MODEL {
        let text = held(&mut browser, name).expect(name);
        std::fs::write(served.folder.path().join(name), text).expect("room");
    }
    the_commands_go_on(served.folder.path());
    let report = browser.value("import('./talk.js').then(t => t.get('/api/report'))");
    std::fs::write(
        served.folder.path().join("report.html"),
        report["html"].as_str().expect("a page"),
    )
    .expect("room");
    let data: Value =
        serde_json::from_str(&served.printed("report --data report.html")).expect("its data");
    assert_eq!(data["journal"].as_array().map(Vec::len), Some(5));

    // Forgotten, it is empty; and what was saved, with its record, goes on again.
    browser.value("document.querySelector('#save-dialog').close()");
    browser.click("#close-button");
    browser.wait(IS_EMPTY);
    browser.open(&format!("{}/", served.origin));
    browser.wait(IS_EMPTY);
    served.drop_all(&mut browser, &["rubbing.csv", MODEL[1], MODEL[0]]);
    browser.wait(&steps_are(5));
    browser.is_clean(&served.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn what_is_under_way_can_be_cancelled_and_asked_again() {
    let served = Served::start();
    let mut browser = served.opened();
    served.drop(&mut browser, "rubbing.csv");
    // The very moment that the diagnosis begins.
    browser.wait(
        "(() => { if (!document.querySelector('#job-text').textContent.startsWith('fitting every effect')) return false; \
         document.querySelector('#cancel-button').click(); return true; })()",
    );
    browser.wait(&format!(
        "document.querySelector('#message').textContent.startsWith('cancelled') && {IS_IDLE}"
    ));
    assert_eq!(browser.value(IS_FOUND), false);
    browser.click("#diagnose-button");
    browser.wait(IS_FOUND);
    browser.is_clean(&served.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn once_it_was_opened_it_needs_no_network() {
    let served = Served::start();
    let mut browser = served.opened();
    browser.value("navigator.serviceWorker.ready.then(() => 1)");
    // From now on its server answers that there is nothing.
    std::fs::rename(served.folder.path().join("page"), served.folder.path().join("gone"))
        .expect("room");
    let missing = "fetch('nowhere.js').then(answer => answer.status)";
    assert_eq!(browser.value(missing), 404);
    browser.complaints.clear();
    browser.open(&format!("{}/", served.origin));
    browser.wait(IS_EMPTY);
    // Who has no record is given one.
    browser.click("#example-button");
    browser.wait("document.querySelector('#diagnosis').textContent.includes('explained by coulomb_friction, cubic_stiffness')");
    assert_eq!(browser.value("document.querySelector('#example-button')"), Value::Null);
    browser.picture(&pictures().join("static-example.png"));
    browser.is_clean(&served.origin);
}

/// A campaign's file and its records, dropped together: the table, and what the releases lack.
#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_campaign_dropped_on_the_page_comes_to_its_derivatives() {
    let served = Served::start();
    yawrig("simulate --campaign campaign").in_folder(served.folder.path()).run().exits(0);
    let campaign = served.folder.path().join("campaign");
    // Two springs are enough.
    let text = std::fs::read_to_string(campaign.join("campaign.toml")).expect("a campaign");
    let (head, releases) = text.split_at(text.find("[[release]]").expect("a release"));
    let few: String = releases
        .split("[[release]]")
        .filter(|one| one.contains("\"K2\"") || one.contains("\"K6\""))
        .map(|one| format!("[[release]]{one}"))
        .collect();
    std::fs::write(campaign.join("campaign.toml"), format!("{head}{few}")).expect("room");
    let mut browser = served.opened();
    browser.choose("#open-folder", &campaign);
    browser.wait("document.querySelectorAll('.release').length === 8");
    browser.wait("document.querySelectorAll('.badge.pending').length === 0");
    browser.click("#fit-button");
    browser.wait(&steps_are(1));
    browser.click("#tab-derivatives");
    browser.wait("document.querySelector('#pane-derivatives table')");
    browser.click("#judge-button");
    browser
        .wait("document.querySelector('#pane-derivatives').textContent.includes('The campaign:')");
    // As the program has them.
    let page = browser.value("import('./talk.js').then(t => t.get('/api/derivatives'))");
    let program = served.printed("diagnose campaign/campaign.toml --json");
    let program: Value = serde_json::from_str(&program).expect("JSON");
    let points = &program["derivatives"]["after"];
    assert_eq!(points.as_array().map(Vec::len), Some(2), "{program}");
    are_same(&page["judged"]["derivatives"]["after"], points, "derivatives", None);
    browser.picture(&pictures().join("static-campaign.png"));
    browser.is_clean(&served.origin);
}

/// What can be pressed is come to with Tab alone, and is seen to be.
#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn what_the_page_has_of_its_own_is_reached_with_keys() {
    let served = Served::start();
    let mut browser = served.opened();
    served.drop(&mut browser, "rubbing.csv");
    browser.wait(&format!("{IS_FOUND} && {IS_IDLE}"));
    browser.value("document.activeElement.blur()");
    let mut order = Vec::new();
    for _ in 0..40 {
        browser.key("Tab");
        let focus = browser.value(
            "(() => { const e = document.activeElement, s = getComputedStyle(e); \
             return [e.id || e.parentElement?.id || '', s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 1]; })()",
        );
        assert_eq!(focus[1], true, "the focus on {focus} is not seen");
        order.push(focus[0].as_str().unwrap_or_default().to_owned());
    }
    for name in
        ["open-button", "folder-button", "phone-button", "save-button", "close-button", "printed"]
    {
        assert!(order.iter().any(|one| one == name), "{name}: {order:?}");
    }
    browser.value("document.querySelector('#save-button').focus()");
    browser.key("Enter");
    browser.wait("document.querySelector('#save-dialog').open");
    browser.key("Escape");
    browser.wait("!document.querySelector('#save-dialog').open");
    // No name is missing for those who do not see it.
    let nameless = "[...document.querySelectorAll('button, input, select, dialog, summary')].filter(e => \
        !(e.ariaLabel || e.textContent.trim() || e.labels?.length || e.title)).map(e => e.outerHTML)";
    assert_eq!(browser.value(nameless), json!([]));
    browser.is_clean(&served.origin);
}

#[test]
fn another_page_is_not_written_over() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("index.html"), "<title>mine</title>").expect("room");
    let refused = yawrig("workbench --static .").in_folder(folder.path()).run().exits(3);
    assert!(refused.stderr.contains("./index.html is another page"), "{}", refused.stderr);
    yawrig("workbench r.csv --static page").in_folder(folder.path()).run().exits(2);
}

/// What both lock files name is of one version: the page's module answers with the program's own libraries.
#[test]
fn the_module_is_built_from_the_programs_own_libraries() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    /// Name, and what of the version another may take the place of; all of it.
    type Locked = HashMap<(String, String), String>;
    let locked = |file: &str| -> Locked {
        let text = std::fs::read_to_string(root.join(file)).expect(file);
        let table: toml::Table = text.parse().expect("TOML");
        let of = |p: &toml::Value| {
            let [name, version] = ["name", "version"].map(|k| p[k].as_str().expect(k).to_owned());
            let parts: Vec<&str> = version.split('.').collect();
            let kind = if parts[0] == "0" { parts[..2].join(".") } else { parts[0].to_owned() };
            ((name, kind), version)
        };
        table["package"].as_array().expect("packages").iter().map(of).collect()
    };
    let (ours, theirs) = (locked("Cargo.lock"), locked("host/web/Cargo.lock"));
    let both: Vec<_> = theirs.iter().filter(|(k, _)| ours.contains_key(*k)).collect();
    assert!(both.len() > 100, "{}", both.len());
    let others: Vec<_> = both.into_iter().filter(|(k, v)| ours[*k] != **v).collect();
    assert!(others.is_empty(), "in host/web, cargo update NAME --precise VERSION: {others:?}");
}
