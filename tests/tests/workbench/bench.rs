//! A workbench that runs, and what is asked of it without a browser.

use serde_json::{json, Value};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use yawrig_tests::process::{yawrig, Running};
use yawrig_tests::PATIENCE;

/// A free decay with dry friction at 1 kHz, and a folder for it.
pub const RUBBING: &str =
    "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05 --out rubbing.csv";

pub struct Bench {
    pub folder: TempDir,
    pub running: Running,
    /// Without the token.
    pub origin: String,
    pub url: String,
    pub token: String,
}

/// A reply: status, head and body.
pub struct Reply {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Bench {
    /// In a folder where these commands have been run.
    pub fn start(made_by: &[&str], arguments: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for command in made_by {
            yawrig(command).in_folder(folder.path()).run().exits(0);
        }
        Self::start_in(folder, arguments)
    }

    pub fn start_in(folder: TempDir, arguments: &str) -> Self {
        let command = format!("workbench {arguments}");
        let mut running = yawrig(&command).in_folder(folder.path()).start();
        let url = running.prints("http://");
        let (origin, token) = url.split_once("/?token=").expect("a token in the address");
        let (origin, token) = (origin.to_owned(), token.to_owned());
        Self { folder, running, origin, url, token }
    }

    /// `127.0.0.1:port`.
    pub fn host(&self) -> &str {
        self.origin.strip_prefix("http://").expect("http")
    }

    pub fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect(name)
    }

    /// Sends a request as it stands.
    pub fn send(&self, request: &str) -> Reply {
        let mut stream = TcpStream::connect(self.host()).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time limit");
        stream.write_all(request.as_bytes()).expect("room");
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("a reply");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status");
        Reply { status, head: head.to_ascii_lowercase(), body: body.to_owned() }
    }

    /// A request with these lines besides.
    pub fn ask(&self, first: &str, lines: &[String], body: &str) -> Reply {
        let mut request = format!("{first} HTTP/1.1\r\nConnection: close\r\n");
        for line in lines {
            request.push_str(line);
            request.push_str("\r\n");
        }
        request.push_str(&format!("Content-Length: {}\r\n\r\n{body}", body.len()));
        self.send(&request)
    }

    /// What a page of ours sends with each request.
    pub fn ours(&self) -> Vec<String> {
        vec![format!("Host: {}", self.host()), format!("Authorization: Bearer {}", self.token)]
    }

    pub fn get(&self, path: &str) -> Value {
        let reply = self.ask(&format!("GET {path}"), &self.ours(), "");
        assert_eq!(reply.status, 200, "{path}: {}", reply.body);
        serde_json::from_str(&reply.body).expect("JSON")
    }

    /// Does something; the answer and its status.
    pub fn act(&self, what: &Value) -> (u16, Value) {
        let mut lines = self.ours();
        lines.push("Content-Type: application/json".to_owned());
        let reply = self.ask("POST /api/do", &lines, &what.to_string());
        (reply.status, serde_json::from_str(&reply.body).unwrap_or(json!(reply.body)))
    }

    /// Waits until the state is so.
    #[track_caller]
    pub fn wait(&self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let until = Instant::now() + PATIENCE;
        loop {
            let state = self.get("/api/state");
            if is_so(&state) {
                return state;
            }
            assert!(Instant::now() < until, "{what}: {state:#}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Where pictures are put, to be looked at.
pub fn pictures() -> std::path::PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("workbench")
}
