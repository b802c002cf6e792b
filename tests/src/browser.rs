//! A headless Chromium, spoken to by its own protocol: what it shows, logs and asks for.

use crate::PATIENCE;
use nix::sys::signal::{kill, Signal};
use nix::unistd::Pid;
use serde_json::{json, Value};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

const SLICE: Duration = Duration::from_millis(20);

/// What a window is like.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    pub width: u32,
    pub height: u32,
    pub is_dark: bool,
}

/// A browser with one page.
pub struct Browser {
    child: Child,
    socket: WebSocket<TcpStream>,
    count: u64,
    session: String,
    /// Errors and warnings of the page's console, and what it threw.
    pub complaints: Vec<String>,
    /// Every address it has asked for.
    pub requests: Vec<String>,
    _profile: TempDir,
}

/// Chromium's program.
fn program() -> PathBuf {
    let named = ["chromium", "chromium-browser", "google-chrome"];
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path)
        .flat_map(|folder| named.map(|name| folder.join(name)))
        .find(|file| file.is_file())
        .expect("Chromium is missing; as root on Debian: apt-get install chromium")
}

impl Browser {
    /// Opens an empty page.
    ///
    /// # Panics
    /// Where there is no Chromium, or it does not start.
    pub fn start(window: Window) -> Self {
        let profile = tempfile::tempdir().expect("a folder");
        let child = Command::new(program())
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
            ])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
            ])
            .args(["--disable-dev-shm-usage", "--remote-debugging-port=0"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("Chromium starts");
        let (port, path) = debugging(profile.path());
        let stream = TcpStream::connect(("127.0.0.1", port)).expect("its debugging port");
        stream.set_read_timeout(Some(SLICE)).expect("a time limit");
        let url = format!("ws://127.0.0.1:{port}{path}");
        let mut patience = tungstenite::client(url, stream);
        let socket = loop {
            patience = match patience {
                Ok((socket, _)) => break socket,
                Err(tungstenite::HandshakeError::Interrupted(more)) => more.handshake(),
                Err(error) => panic!("no connection to Chromium: {error}"),
            };
        };
        let mut browser = Self {
            child,
            socket,
            count: 0,
            session: String::new(),
            complaints: Vec::new(),
            requests: Vec::new(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let wanted = json!({"targetId": target["targetId"], "flatten": true});
        let attached = browser.call("Target.attachToTarget", wanted);
        attached["sessionId"].as_str().expect("a session").clone_into(&mut browser.session);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser.resize(window);
        browser
    }

    /// Gives the page this size and these colours.
    pub fn resize(&mut self, window: Window) {
        let Window { width, height, is_dark } = window;
        self.call(
            "Emulation.setDeviceMetricsOverride",
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false}),
        );
        let scheme = if is_dark { "dark" } else { "light" };
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.call("Emulation.setEmulatedMedia", json!({ "features": features }));
    }

    pub fn open(&mut self, url: &str) {
        self.call("Page.navigate", json!({ "url": url }));
        self.wait("document.readyState === 'complete'");
    }

    /// The value of a script.
    ///
    /// # Panics
    /// Where it throws.
    #[track_caller]
    pub fn value(&mut self, script: &str) -> Value {
        let answer = self.evaluated(script);
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    fn evaluated(&mut self, script: &str) -> Value {
        let wanted = json!({"expression": script, "returnByValue": true, "awaitPromise": true});
        self.call("Runtime.evaluate", wanted)
    }

    /// Its text.
    #[track_caller]
    pub fn text(&mut self, selector: &str) -> String {
        let found = self.value(&format!("document.querySelector({selector:?})?.textContent"));
        found.as_str().unwrap_or_else(|| panic!("{selector} is not on the page")).to_owned()
    }

    /// Waits until a script, or what it promises, is true. One that throws is not true yet: what it asks for may just be made anew.
    ///
    /// # Panics
    /// Out of patience, with what the page says.
    #[track_caller]
    pub fn wait(&mut self, script: &str) {
        let until = Instant::now() + PATIENCE;
        loop {
            let answer = self.evaluated(&format!("(async () => !!(await ({script})))()"));
            if answer["result"]["value"] == true {
                return;
            }
            if Instant::now() > until {
                let (threw, page) =
                    (&answer["exceptionDetails"], self.value("document.body.innerText"));
                panic!("{script} is not so: {threw} {page}\n{:?}", self.complaints);
            }
            std::thread::sleep(SLICE);
        }
    }

    /// Clicks the first of these elements, once it can be: where it is at this very moment, for what is still
    /// being laid out moves away from under a mouse, and what is made anew loses the half of a click.
    #[track_caller]
    pub fn click(&mut self, selector: &str) {
        let until = Instant::now() + PATIENCE;
        let click = format!(
            "(() => {{ const e = document.querySelector({selector:?}); if (!e) return 'missing'; if (e.disabled) return 'disabled'; \
             e.scrollIntoView({{block: 'nearest'}}); const r = e.getBoundingClientRect(); \
             const hit = document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2); \
             if (!hit || !(e.contains(hit) || hit.contains(e) && hit.closest('label'))) return 'under ' + (hit?.id || hit?.className || 'nothing'); \
             e.focus({{preventScroll: true}}); e.click(); return 'clicked'; }})()"
        );
        loop {
            let found = self.value(&click);
            if found == "clicked" {
                return;
            }
            assert!(Instant::now() < until, "{selector} cannot be clicked: {found}");
            std::thread::sleep(SLICE);
        }
    }

    /// Chooses a file or a folder in a field for one, as in the system's own dialog.
    #[track_caller]
    pub fn choose(&mut self, selector: &str, path: &Path) {
        let wanted = json!({"expression": format!("document.querySelector({selector:?})")});
        let field = self.call("Runtime.evaluate", wanted)["result"]["objectId"].clone();
        self.call("DOM.setFileInputFiles", json!({"files": [path], "objectId": field}));
    }

    /// Does something in each of so many tabs that show a page of `origin`, once they are there.
    #[track_caller]
    pub fn each_tab(&mut self, origin: &str, count: usize, mut what: impl FnMut(&mut Self)) {
        let ours = std::mem::take(&mut self.session);
        let until = Instant::now() + PATIENCE;
        let is_ours = |tab: &&Value| {
            tab["type"] == "page" && tab["url"].as_str().is_some_and(|url| url.starts_with(origin))
        };
        let tabs: Vec<Value> = loop {
            let all = self.call("Target.getTargets", json!({}))["targetInfos"].clone();
            let all = all.as_array().expect("tabs");
            let tabs: Vec<Value> = all.iter().filter(is_ours).cloned().collect();
            if tabs.len() == count {
                break tabs;
            }
            assert!(Instant::now() < until, "{} of {count} tabs: {all:?}", tabs.len());
            std::thread::sleep(SLICE);
        };
        for tab in tabs {
            let wanted = json!({"targetId": tab["targetId"], "flatten": true});
            let attached = self.call("Target.attachToTarget", wanted);
            attached["sessionId"].as_str().expect("a session").clone_into(&mut self.session);
            what(self);
            self.session.clear();
        }
        self.session = ours;
    }

    /// Moves the mouse there.
    pub fn hover(&mut self, x: f64, y: f64) {
        self.call("Input.dispatchMouseEvent", json!({"type": "mouseMoved", "x": x, "y": y}));
    }

    /// Drags with the mouse from one place to another.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        let mut event = |kind: &str, [x, y]: [f64; 2], buttons: u8| {
            let button = if kind == "mouseMoved" && buttons == 0 { "none" } else { "left" };
            let event = json!({"type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1});
            self.call("Input.dispatchMouseEvent", event);
        };
        event("mouseMoved", from, 0);
        event("mousePressed", from, 1);
        for share in [0.3, 0.7, 1.0] {
            event("mouseMoved", [0, 1].map(|k| from[k] + share * (to[k] - from[k])), 1);
        }
        event("mouseReleased", to, 0);
    }

    /// Presses and releases a key, by its name as the DOM has it.
    pub fn key(&mut self, key: &str) {
        let (code, virtual_key, text) = match key {
            "Tab" => ("Tab", 9, ""),
            "Escape" => ("Escape", 27, ""),
            "Enter" => ("Enter", 13, "\r"),
            " " => ("Space", 32, " "),
            "ArrowLeft" => ("ArrowLeft", 37, ""),
            "ArrowUp" => ("ArrowUp", 38, ""),
            "ArrowRight" => ("ArrowRight", 39, ""),
            "ArrowDown" => ("ArrowDown", 40, ""),
            one => ("", 0, one),
        };
        let event = |kind: &str| json!({"type": kind, "key": key, "code": code, "windowsVirtualKeyCode": virtual_key, "text": text});
        let down = if text.is_empty() { "rawKeyDown" } else { "keyDown" };
        self.call("Input.dispatchKeyEvent", event(down));
        self.call("Input.dispatchKeyEvent", event("keyUp"));
    }

    /// Puts `text` where there was another, as typing does.
    #[track_caller]
    pub fn fill(&mut self, selector: &str, text: &str) {
        self.wait(&format!("document.querySelector({selector:?})"));
        self.value(&format!(
            "(() => {{ const e = document.querySelector({selector:?}); e.focus(); e.select(); }})()"
        ));
        self.call("Input.insertText", json!({ "text": text }));
    }

    /// Writes a picture of the page.
    pub fn picture(&mut self, file: &Path) {
        let answer = self.call("Page.captureScreenshot", json!({"format": "png"}));
        let text = answer["data"].as_str().expect("a picture");
        let bytes = data_encoding::BASE64.decode(text.as_bytes()).expect("base64");
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("room");
        std::fs::write(file, bytes).expect("room");
    }

    /// Asks the browser, and takes down what it tells meanwhile.
    #[track_caller]
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.count += 1;
        let mut message = json!({"id": self.count, "method": method, "params": parameters});
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(message.to_string())).expect("Chromium listens");
        let until = Instant::now() + PATIENCE;
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => {
                    let answer: Value = serde_json::from_str(&text).expect("JSON");
                    if answer["id"] == self.count {
                        assert!(answer["error"].is_null(), "{method}: {answer}");
                        return answer["result"].clone();
                    }
                    self.note(&answer);
                }
                Ok(_) => {}
                Err(tungstenite::Error::Io(e)) if e.kind() == std::io::ErrorKind::WouldBlock => {}
                Err(error) => panic!("{method}: {error}"),
            }
            assert!(Instant::now() < until, "{method}: no answer");
        }
    }

    fn note(&mut self, event: &Value) {
        let about = &event["params"];
        match event["method"].as_str().unwrap_or("") {
            "Runtime.exceptionThrown" => {
                self.complaints.push(about["exceptionDetails"].to_string())
            }
            "Runtime.consoleAPICalled"
                if about["type"] == "error" || about["type"] == "warning" =>
            {
                self.complaints.push(about["args"].to_string());
            }
            "Log.entryAdded" if about["entry"]["level"] == "error" => {
                self.complaints.push(about["entry"].to_string());
            }
            "Network.requestWillBeSent" => {
                let url = about["request"]["url"].as_str().unwrap_or("");
                self.requests.push(url.to_owned());
            }
            _ => {}
        }
    }

    /// Nothing on the console, and nothing asked of anyone but `origin`.
    ///
    /// # Panics
    /// Where that is not so.
    #[track_caller]
    pub fn is_clean(&mut self, origin: &str) {
        // What has happened by now has been reported before this is answered.
        self.value("1");
        assert!(self.complaints.is_empty(), "{:#?}", self.complaints);
        let strange: Vec<&String> = self
            .requests
            .iter()
            // What a page holds itself is asked of nobody.
            .filter(|url| !["about:blank", "data:", origin].iter().any(|own| url.starts_with(own)))
            .collect();
        assert!(strange.is_empty(), "{strange:?}");
        assert!(self.requests.iter().any(|url| url.starts_with(origin)), "{:?}", self.requests);
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = kill(Pid::from_raw(self.child.id() as i32), Signal::SIGTERM);
        let until = Instant::now() + Duration::from_secs(5);
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(SLICE);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Port and path at which the browser of this profile is spoken to.
fn debugging(profile: &Path) -> (u16, String) {
    let file = profile.join("DevToolsActivePort");
    let until = Instant::now() + PATIENCE;
    loop {
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        if let Some((port, path)) = text.split_once('\n').filter(|(_, path)| !path.is_empty()) {
            return (port.parse().expect("a port"), path.trim().to_owned());
        }
        assert!(Instant::now() < until, "Chromium does not start");
        std::thread::sleep(SLICE);
    }
}
