//! Chromium without a screen, looking at one page from disk.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A page opened once.
#[derive(Clone, Copy, Debug)]
pub struct Look<'a> {
    pub page: &'a Path,
    pub width: u32,
    pub height: u32,
    pub dark: bool,
}

/// What the browser made of it.
#[derive(Debug)]
pub struct Seen {
    /// The document after its scripts have run.
    pub dom: String,
    /// What it wrote to its console.
    pub console: Vec<String>,
    /// Addresses it asked for, but for the page itself and what is within it.
    pub requests: Vec<String>,
    /// The picture, a PNG.
    pub screenshot: Vec<u8>,
}

const PATIENCE: Duration = Duration::from_secs(120);

impl Look<'_> {
    /// # Panics
    /// Where Chromium is not there, does not end, or gives nothing.
    pub fn see(&self) -> Seen {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let (picture, network, document) = (at("picture.png"), at("network.json"), at("dom.html"));
        let console = at("console.txt");
        let file = |path: &PathBuf| std::fs::File::create(path).expect("room for it");
        let page = self.page.canonicalize().expect("the page is there");
        let mut browser = Command::new("chromium")
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"])
            .args(["--no-first-run", "--disable-background-networking", "--disable-sync"])
            .args(["--disable-component-update", "--enable-logging=stderr", "--dump-dom"])
            .args(["--virtual-time-budget=5000", "--hide-scrollbars"])
            // 0 is dark.
            .arg(format!("--blink-settings=preferredColorScheme={}", u8::from(!self.dark)))
            .arg(format!("--window-size={},{}", self.width, self.height))
            .arg(format!("--user-data-dir={}", at("profile").display()))
            .arg(format!("--log-net-log={}", network.display()))
            .arg(format!("--screenshot={}", picture.display()))
            .arg(format!("file://{}", page.display()))
            .stdin(Stdio::null())
            .stdout(file(&document))
            .stderr(file(&console))
            .spawn()
            .expect("Debian's package `chromium`");
        let until = Instant::now() + PATIENCE;
        while browser.try_wait().expect("a process").is_none() {
            if Instant::now() > until {
                let _ = browser.kill();
                panic!("Chromium did not end: {}", read(&console));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let console = read(&console);
        let console = console.lines().filter(|line| line.contains("CONSOLE")).map(str::to_owned);
        Seen {
            dom: read(&document),
            console: console.collect(),
            requests: requests(&read(&network)),
            screenshot: std::fs::read(picture).expect("a picture"),
        }
    }
}

fn read(path: &Path) -> String {
    String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()).into_owned()
}

/// Every address that a page asked for, in Chromium's log of its network.
fn requests(log: &str) -> Vec<String> {
    let log: Value = serde_json::from_str(log).expect("Chromium's log of its network");
    let events = log["events"].as_array().expect("events");
    let asked = |event: &Value| {
        let url = event["params"]["url"].as_str()?;
        // The browser's own errands are nobody's.
        event["params"]["initiator"].as_str().filter(|by| *by != "not an origin")?;
        let within = ["file:", "data:", "blob:", "chrome:", "devtools:"];
        (!within.iter().any(|scheme| url.starts_with(scheme))).then(|| url.to_owned())
    };
    let mut all: Vec<String> = events.iter().filter_map(asked).collect();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[ignore = "needs Chromium: tests/run runs it"]
    fn what_a_page_does_wrong_is_seen() {
        let folder = tempfile::tempdir().expect("a folder");
        let page = folder.path().join("page.html");
        let text = "<img src=\"http://example.invalid/x.png\"><script>absent()</script>";
        std::fs::write(&page, text).expect("room for it");
        let seen = Look { page: &page, width: 400, height: 300, dark: true }.see();
        assert_eq!(seen.requests, ["http://example.invalid/x.png"]);
        assert!(seen.console.iter().any(|line| line.contains("absent is not defined")), "{seen:?}");
    }
}
