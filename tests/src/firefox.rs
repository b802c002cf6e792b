//! A headless Firefox, spoken to by WebDriver BiDi: what a page answers and logs there.

use crate::PATIENCE;
use serde_json::{json, Value};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

const SLICE: Duration = Duration::from_millis(20);
/// After it, on a line of its own, stands where it listens.
const LISTENS: &str = "WebDriver BiDi listening on ws://";

/// A browser with one page.
pub struct Firefox {
    child: Child,
    socket: WebSocket<TcpStream>,
    count: u64,
    context: Value,
    /// Errors and warnings of the page's console, and what it threw.
    pub complaints: Vec<String>,
    _profile: TempDir,
}

impl Firefox {
    /// Opens an empty page.
    ///
    /// # Panics
    /// Where there is no Firefox, or it does not start.
    pub fn start() -> Self {
        let profile = tempfile::tempdir().expect("a folder");
        let started = |name: &str| {
            Command::new(name)
                .args(["--headless", "--no-remote", "--remote-debugging-port", "0", "--profile"])
                .arg(profile.path())
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .ok()
        };
        let mut child = ["firefox-esr", "firefox"]
            .into_iter()
            .find_map(started)
            .expect("Firefox is missing; as root on Debian: apt-get install firefox-esr");
        let mut said = BufReader::new(child.stderr.take().expect("its messages")).lines();
        let host = said
            .by_ref()
            .map_while(Result::ok)
            .find_map(|line| line.split_once(LISTENS).map(|(_, host)| host.trim().to_owned()))
            .expect("Firefox starts");
        // It stops where nobody reads what it has to say.
        std::thread::spawn(move || said.for_each(drop));
        let stream = TcpStream::connect(&host).expect("its debugging port");
        let (socket, _) =
            tungstenite::client(format!("ws://{host}/session"), stream).expect("it listens");
        let slice = Some(SLICE);
        socket.get_ref().set_read_timeout(slice).expect("a time limit");
        let mut firefox = Self {
            child,
            socket,
            count: 0,
            context: Value::Null,
            complaints: Vec::new(),
            _profile: profile,
        };
        firefox.call("session.new", json!({"capabilities": {}}));
        firefox.call("session.subscribe", json!({"events": ["log.entryAdded"]}));
        let tree = firefox.call("browsingContext.getTree", json!({}));
        firefox.context = tree["contexts"][0]["context"].clone();
        let viewport = json!({"width": 1280, "height": 800});
        firefox.call(
            "browsingContext.setViewport",
            json!({"context": firefox.context, "viewport": viewport}),
        );
        firefox
    }

    pub fn open(&mut self, url: &str) {
        let wanted = json!({"context": self.context, "url": url, "wait": "complete"});
        self.call("browsingContext.navigate", wanted);
    }

    /// The value of a script, or of what it promises.
    ///
    /// # Panics
    /// Where it throws.
    #[track_caller]
    pub fn value(&mut self, script: &str) -> Value {
        self.evaluated(script).unwrap_or_else(|threw| panic!("{script}: {threw}"))
    }

    /// As text, since the protocol has a form of its own for each kind of value.
    fn evaluated(&mut self, script: &str) -> Result<Value, Value> {
        let expression = format!("(async () => JSON.stringify(await ({script})) ?? 'null')()");
        let target = json!({"context": self.context});
        let wanted = json!({"expression": expression, "target": target, "awaitPromise": true});
        let answer = self.call("script.evaluate", wanted);
        match answer["result"]["value"].as_str() {
            Some(text) => Ok(serde_json::from_str(text).expect("JSON")),
            None => Err(answer["exceptionDetails"].clone()),
        }
    }

    /// Waits until a script, or what it promises, is true. One that throws is not true yet.
    ///
    /// # Panics
    /// Out of patience, with what the page says.
    #[track_caller]
    pub fn wait(&mut self, script: &str) {
        let until = Instant::now() + PATIENCE;
        while self.evaluated(&format!("!!({script})")) != Ok(Value::Bool(true)) {
            if Instant::now() > until {
                let page = self.value("document.body.innerText");
                panic!("{script} is not so: {page}\n{:?}", self.complaints);
            }
            std::thread::sleep(SLICE);
        }
    }

    /// Writes a picture of the page.
    pub fn picture(&mut self, file: &Path) {
        let wanted = json!({"context": self.context});
        let answer = self.call("browsingContext.captureScreenshot", wanted);
        let text = answer["data"].as_str().expect("a picture");
        let bytes = data_encoding::BASE64.decode(text.as_bytes()).expect("base64");
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("room");
        std::fs::write(file, bytes).expect("room");
    }

    #[track_caller]
    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.count += 1;
        let message = json!({"id": self.count, "method": method, "params": parameters});
        self.socket.send(Message::text(message.to_string())).expect("Firefox listens");
        let until = Instant::now() + PATIENCE;
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => {
                    let answer: Value = serde_json::from_str(&text).expect("JSON");
                    if answer["id"] == self.count {
                        assert_eq!(answer["type"], "success", "{method}: {answer}");
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
        if event["method"] == "log.entryAdded"
            && (about["level"] == "error" || about["level"] == "warn")
        {
            self.complaints.push(about["text"].to_string());
        }
    }
}

impl Drop for Firefox {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
