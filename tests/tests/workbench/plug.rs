//! A browser's plug with anything at its other end: Web Serial as a script, its bytes carried over the page's own
//! server. A real port, its driver and the browser's own window for choosing one are not in it.

use serde_json::json;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use yawrig_tests::browser::Browser;
use yawrig_tests::line::Board;

/// `navigator.serial` with one port, which is asked for by a user's own hand and fails as a real one does.
const SERIAL: &str = r#"(() => {
  const lost = () => new DOMException("The device has been lost.", "NetworkError");
  const asked = async (what, options) => (await fetch(`plug/${what}`, options)).text();
  class Port extends EventTarget {
    readable = null; writable = null;
    getInfo() { return { usbVendorId: 0x2e8a, usbProductId: 0x000a }; }
    async open({ baudRate }) {
      if (this.readable) throw new DOMException("The port is already open.", "InvalidStateError");
      if (baudRate !== 115200 || await asked("open") !== "yes") throw new DOMException("Failed to open serial port.", "NetworkError");
      const said = (await fetch("plug/read")).body.getReader(), port = this;
      this.readable = new ReadableStream({
        async pull(out) {
          const { value, done } = await said.read().catch(() => ({ done: true }));
          if (!done) return out.enqueue(value);
          port.readable = null;
          out.error(lost());
        },
        cancel: () => said.cancel(),
      }, { highWaterMark: 0 });
      this.writable = new WritableStream({ async write(body) { if (await asked("write", { method: "POST", body }) !== "yes") throw lost(); } });
    }
    async close() { this.readable = this.writable = null; }
  }
  const port = new Port(), serial = new EventTarget();
  serial.requestPort = async () => {
    if (!navigator.userActivation.isActive) throw new DOMException("Must be handling a user gesture to show a permission request.", "SecurityError");
    return port;
  };
  Object.defineProperty(navigator, "serial", { value: serial });
  window.pluggedInAgain = () => {
    const event = new Event("connect");
    Object.defineProperty(event, "target", { value: port });
    serial.dispatchEvent(event);
  };
})()"#;

/// What the far end answers to bytes; to none of them, too.
pub type Far = Box<dyn FnMut(&[u8]) -> Vec<u8> + Send>;

/// The plug.
pub struct Plug(Mutex<Inner>);

struct Inner {
    far: Far,
    said: Vec<u8>,
    is_in: bool,
    is_held: bool,
}

impl Plug {
    pub fn new(far: Far) -> Arc<Self> {
        Arc::new(Self(Mutex::new(Inner { far, said: Vec::new(), is_in: true, is_held: false })))
    }

    pub fn board(board: &Board) -> Arc<Self> {
        let board = board.clone();
        Self::new(Box::new(move |bytes| board.exchange(bytes)))
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn pull(&self) {
        self.inner().is_in = false;
    }

    /// What the far end has to say is taken, as a computer's driver does however busy its programs are.
    pub fn take(&self) {
        let mut inner = self.inner();
        if inner.is_in {
            let said = (inner.far)(&[]);
            inner.said.extend(said);
        }
    }

    pub fn put_back(&self) {
        let mut inner = self.inner();
        (inner.is_in, inner.said) = (true, Vec::new());
    }

    /// Another program opens the port.
    pub fn hold(&self) {
        self.inner().is_held = true;
    }

    /// Answers what the script above asks.
    pub fn serve(&self, what: &str, head: &str, mut stream: TcpStream) {
        let answer = match what {
            "open" => {
                let inner = self.inner();
                inner.is_in && !inner.is_held
            }
            "read" => return self.say(stream),
            "write" => {
                let length = head.lines().find_map(|line| {
                    line.to_ascii_lowercase().strip_prefix("content-length: ")?.parse().ok()
                });
                let mut body = vec![0; length.expect("a length")];
                stream.read_exact(&mut body).expect("bytes for the board");
                let mut inner = self.inner();
                if inner.is_in {
                    let said = (inner.far)(&body);
                    inner.said.extend(said);
                }
                inner.is_in
            }
            other => panic!("plug/{other}"),
        };
        let text = if answer { "yes" } else { "no" };
        let length = text.len();
        let _ = stream.write_all(format!("HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{text}").as_bytes());
    }

    /// All that comes from the far end, until the plug is pulled or nobody reads any more.
    fn say(&self, mut stream: TcpStream) {
        let head = "HTTP/1.1 200 OK\r\nContent-Type: application/octet-stream\r\nConnection: close\r\n\r\n";
        let mut bytes = head.as_bytes().to_vec();
        while stream.write_all(&bytes).is_ok() {
            std::thread::sleep(Duration::from_millis(2));
            let mut inner = self.inner();
            if !inner.is_in {
                return;
            }
            bytes = (inner.far)(&[]);
            bytes.splice(0..0, std::mem::take(&mut inner.said));
        }
    }
}

/// Gives the browser's pages this plug; the next one that is opened has it.
pub fn plugged(browser: &mut Browser) {
    browser.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": SERIAL }));
}
