//! A device's client on a port of this machine: it waits for each answer.
//!
//! A thread of its own reads the port, so that results are taken off the line while the host is busy.

mod reading;

use crate::holders::holders;
use crate::port;
use reading::{passing, read, Incoming as Read};
use std::io::{ErrorKind, Write};
use std::ops::{Deref, DerefMut};
use std::path::Path;
use std::pin::pin;
use std::sync::atomic::{self, AtomicBool, AtomicU64};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use yawrig_base::error::Result;
use yawrig_base::settings;
use yawrig_protocol::client::Client as Protocol;
pub use yawrig_protocol::client::{Identity, LinkError};
use yawrig_protocol::events::Numbered;
use yawrig_protocol::line::{Incoming, Line, Words};
use yawrig_shared::wire::{Reply, Request, Status};

const TRIES: u32 = 3;
/// Behind a pseudo-terminal is a program, which may have to wait for its turn on a busy machine.
const TRIES_OF_A_PROGRAM: u32 = 20;
/// How long a port may take nothing.
const SENDING: Duration = Duration::from_millis(700);

const COMMANDS: Words = Words {
    another_port: "choose another port (`yawrig ports`) or write yawrig's firmware to the board",
    nobody: "check that it has power and that this is its port (`yawrig ports`)",
    gone: "plug it in again and repeat the command",
    write_again: "run `yawrig flash` again",
    which_runs: "`yawrig device` shows which",
    sign: || format!("sign with {}, the file of that private key", settings::given("sign", "KEY")),
};

/// A port that is open.
pub struct Port {
    path: String,
    port: Box<dyn Write + Send>,
    incoming: Receiver<Read>,
    bytes: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
}

impl Port {
    fn open(path: &str) -> Result<Self> {
        let (reading, port) = port::open(path)?;
        let (sender, incoming) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let bytes = Arc::new(AtomicU64::new(0));
        let reader = {
            let (stop, bytes) = (stop.clone(), bytes.clone());
            std::thread::spawn(move || read(reading, &sender, &stop, &bytes))
        };
        Ok(Self { path: path.to_owned(), port, incoming, bytes, stop, reader: Some(reader) })
    }
}

impl Line for Port {
    fn name(&self) -> &str {
        &self.path
    }

    fn words(&self) -> &'static Words {
        &COMMANDS
    }

    fn tries(&self) -> u32 {
        if port::is_of_a_program(&self.path) {
            TRIES_OF_A_PROGRAM
        } else {
            TRIES
        }
    }

    fn random(&mut self) -> u32 {
        rand::random()
    }

    fn bytes(&self) -> u64 {
        self.bytes.load(atomic::Ordering::Relaxed)
    }

    async fn send(&mut self, bytes: &[u8]) -> std::result::Result<bool, String> {
        let mut left = bytes;
        let deadline = Instant::now() + SENDING;
        while !left.is_empty() {
            // By 0 Windows says that the port takes nothing for the moment.
            match self.port.write(left).and_then(|n| match n {
                0 => Err(ErrorKind::TimedOut.into()),
                n => Ok(n),
            }) {
                Ok(n) => left = &left[n..],
                Err(e) if passing(&e) && Instant::now() < deadline => {}
                Err(e) if passing(&e) => return Ok(false),
                Err(e) => return Err(e.to_string()),
            }
        }
        Ok(true)
    }

    async fn receive(
        &mut self,
        patience: Duration,
    ) -> std::result::Result<Option<Incoming>, String> {
        match self.incoming.recv_timeout(patience) {
            Ok(Read::Came(came)) => Ok(Some(came)),
            Ok(Read::Gone(why)) => Err(why),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err("reading ended".into()),
        }
    }

    async fn pause(&mut self, duration: Duration) {
        std::thread::sleep(duration);
    }

    fn other_reader(&self) -> Option<[String; 2]> {
        let holders = holders(Path::new(&self.path));
        holders.first().map(|other| [other.beside(), other.help()])
    }

    fn turns_away(&self) -> bool {
        port::is_socket(&self.path)
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        self.stop.store(true, atomic::Ordering::Relaxed);
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}

/// What is found by one that waits by itself, as a [`Port`] does: it is ready when it is polled.
pub fn waited<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    loop {
        if let Poll::Ready(found) = future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return found;
        }
    }
}

/// What a program asks and waits for: `T`, whose answers over a line of this machine are ready when they are asked for.
pub struct Waited<T>(pub(crate) T);

impl<T> Deref for Waited<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> DerefMut for Waited<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

/// One end of the link.
pub type Client = Waited<Protocol<Port>>;

impl Client {
    /// Opens a port and finds out who is there.
    ///
    /// # Errors
    /// Exit 4: no such port, busy, forbidden, another protocol; exit 7: nobody answers.
    pub fn open(path: &str) -> Result<Self> {
        waited(Protocol::open(Port::open(path)?)).map(Self)
    }

    /// Sends a request and waits for its reply.
    pub fn request(&mut self, request: &Request) -> std::result::Result<Reply, LinkError> {
        waited(self.0.request(request))
    }

    /// The device's state.
    pub fn status(&mut self) -> Result<Status> {
        waited(self.0.status())
    }

    /// Sends a request that is answered with "done".
    pub fn tell(&mut self, request: &Request, what: &str) -> Result<()> {
        waited(self.0.tell(request, what))
    }

    /// Asks for the next so many samples of the potentiometer; ask again before they are over.
    pub fn stream(&mut self, samples: u32) -> std::result::Result<(), LinkError> {
        waited(self.0.stream(samples))
    }

    /// The next event, waiting for it at most so long. What the line has lost is asked for again.
    pub fn next_event(
        &mut self,
        patience: Duration,
    ) -> std::result::Result<Option<Numbered>, LinkError> {
        waited(self.0.next_event(patience))
    }
}
