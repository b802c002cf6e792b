//! The page's stream as a line: what has come waits here until the client takes it.

use super::array;
use js_sys::{Function, JsString};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;
use std::time::Duration;
use wasm_bindgen::JsValue;
use yawrig_base::clock::Instant;
use yawrig_protocol::line::{completed, Incoming, Line, Words};
use yawrig_shared::wire::Decoder;

/// A page shares its processor with others, and its bytes go through its main thread.
const TRIES: u32 = 6;

const WORDS: Words = Words {
    another_port: "connect again and choose another port, or write yawrig's firmware to the board",
    nobody: "check that it has power and that the port chosen is its own, then connect again",
    gone: "plug it in again and connect",
    write_again: "write it again",
    which_runs: "connect again to see which",
    sign: || "write it with the program, which signs it: yawrig flash --sign KEY".to_owned(),
};

/// Both ends of the page's stream.
pub struct Wire {
    name: String,
    says: Function,
    decoder: Decoder,
    waiting: VecDeque<Incoming>,
    bytes: u64,
    gone: Option<String>,
}

impl Wire {
    pub fn new(name: &str, says: Function) -> Self {
        let (decoder, waiting) = (Decoder::new(), VecDeque::new());
        Self { name: name.to_owned(), says, decoder, waiting, bytes: 0, gone: None }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn came(&mut self, bytes: &[u8]) {
        self.bytes += bytes.len() as u64;
        let found = bytes.iter().filter_map(|byte| completed(&mut self.decoder, *byte));
        self.waiting.extend(found);
    }

    pub fn gone(&mut self, why: &str) {
        self.gone = Some(why.to_owned());
    }

    pub fn is_gone(&self) -> bool {
        self.gone.is_some()
    }

    /// It is there again, in the middle of nothing.
    pub fn back(&mut self) {
        (self.decoder, self.gone) = (Decoder::new(), None);
    }

    /// Tells the page's side. One that does not hear it is closed.
    pub fn say(&self, what: &str, of: &JsValue) {
        let _ = self.says.call2(&JsValue::NULL, &JsString::from(what), of);
    }
}

/// The line of a client.
pub struct Stream {
    name: String,
    wire: Rc<RefCell<Wire>>,
}

impl Stream {
    pub fn new(wire: &Rc<RefCell<Wire>>) -> Self {
        Self { name: wire.borrow().name.clone(), wire: wire.clone() }
    }
}

impl Line for Stream {
    fn name(&self) -> &str {
        &self.name
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn tries(&self) -> u32 {
        TRIES
    }

    fn random(&mut self) -> u32 {
        (js_sys::Math::random() * f64::from(u32::MAX)) as u32
    }

    fn bytes(&self) -> u64 {
        self.wire.borrow().bytes
    }

    async fn send(&mut self, bytes: &[u8]) -> Result<bool, String> {
        let wire = self.wire.borrow();
        match &wire.gone {
            Some(why) => Err(why.clone()),
            None => {
                wire.say("send", &array(bytes));
                Ok(true)
            }
        }
    }

    async fn receive(&mut self, patience: Duration) -> Result<Option<Incoming>, String> {
        let until = Instant::now() + patience;
        poll_fn(|_| {
            let mut wire = self.wire.borrow_mut();
            match (wire.waiting.pop_front(), &wire.gone) {
                (Some(came), _) => Poll::Ready(Ok(Some(came))),
                (None, Some(why)) => Poll::Ready(Err(why.clone())),
                (None, None) if Instant::now() >= until => Poll::Ready(Ok(None)),
                (None, None) => Poll::Pending,
            }
        })
        .await
    }

    async fn pause(&mut self, duration: Duration) {
        let until = Instant::now() + duration;
        poll_fn(|_| if Instant::now() >= until { Poll::Ready(()) } else { Poll::Pending }).await;
    }
}
