//! Requests, replies and events over one port.
//!
//! A thread of its own reads the port, so that results are taken off the line while the host is
//! busy. A request without an answer is sent again under its old sequence number; the device
//! then repeats its answer and does nothing twice.

mod following;
mod reading;

use crate::events::Events;
use crate::holders::holders;
use crate::port;
use reading::{passing, read, Incoming};
use std::cmp::Ordering;
use std::collections::VecDeque;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{self, AtomicBool};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_shared::wire::{
    self, Encoded, Event, HelloReply, Message, Refusal, Reply, Request, Samples, Status, HELLO_KEY,
    SAMPLES_KEY,
};

/// How long the device may take over an ordinary answer, and over erasing or verifying flash.
const ANSWER: Duration = Duration::from_millis(700);
const FLASH_ANSWER: Duration = Duration::from_secs(4);
const TRIES: u32 = 3;
/// Behind a pseudo-terminal is a program, which may have to wait for its turn on a busy machine.
const TRIES_OF_A_PROGRAM: u32 = 20;

/// What went wrong between a request and its reply.
#[derive(Clone, Debug)]
pub enum LinkError {
    /// No answer; `bytes` came in the meantime, none of them a frame of ours if `frames` is zero.
    Silent {
        bytes: u64,
        frames: u64,
    },
    /// The port is gone: unplugged, or its program ended.
    Gone(String),
    /// The device understood and said no.
    Refused(Refusal),
    Interrupted,
}

/// A device that has said hello.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    pub firmware: String,
    pub board: String,
    pub protocol: u16,
}

/// One end of the link.
pub struct Client {
    path: String,
    port: Box<dyn Write + Send>,
    incoming: Receiver<Incoming>,
    events: Events,
    /// Of the stream, where this client has asked for it.
    samples: Option<VecDeque<Samples>>,
    /// What this run of the device is called; zero: not known yet.
    session: u32,
    /// When that was asked for in vain.
    asked: Option<Instant>,
    resets: u64,
    sequence: u16,
    garbled: u64,
    frames: u64,
    heard: Instant,
    rounds: u32,
    bytes: Arc<std::sync::atomic::AtomicU64>,
    gone: Option<String>,
    stop: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
    pub identity: Identity,
}

impl Client {
    /// Opens a port and finds out who is there.
    ///
    /// # Errors
    /// Exit 4: no such port, busy, forbidden, another protocol; exit 7: nobody answers.
    pub fn open(path: &str) -> Result<Self> {
        let (reading, port) = port::open(path)?;
        let (sender, incoming) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let bytes = Arc::new(std::sync::atomic::AtomicU64::new(0));
        let reader = {
            let (stop, bytes) = (stop.clone(), bytes.clone());
            std::thread::spawn(move || read(reading, &sender, &stop, &bytes))
        };
        let mut client = Self {
            path: path.to_owned(),
            port,
            incoming,
            events: Events::default(),
            samples: None,
            session: 0,
            asked: None,
            resets: 0,
            // Another client's last request must not be answered to ours.
            sequence: rand::random(),
            garbled: 0,
            frames: 0,
            heard: Instant::now(),
            rounds: 0,
            bytes,
            gone: None,
            stop,
            reader: Some(reader),
            identity: Identity { firmware: String::new(), board: String::new(), protocol: 0 },
        };
        client.hello()?;
        Ok(client)
    }

    pub fn path(&self) -> &str {
        &self.path
    }

    fn hello(&mut self) -> Result<()> {
        let sequence = self.next_sequence();
        let frame = wire::encode_raw(HELLO_KEY, sequence, &[])
            .map_err(|e| Error::internal(format!("hello does not fit a frame: {e:?}")))?;
        let body = self.exchange(HELLO_KEY, sequence, &frame, ANSWER).map_err(|e| match e {
            LinkError::Silent { bytes, frames: 0 } if bytes > 0 => Error::device(format!(
                "what is on {} is not a yawrig device: it sent {bytes} bytes and no frame that yawrig knows",
                self.path
            ))
            .help("choose another port (`yawrig ports`) or write yawrig's firmware to the board"),
            LinkError::Gone(_) if self.bytes() == 0 && port::is_socket(&self.path) => {
                Error::device(format!("cannot open port {}: another program has it open", self.path))
                    .help("close that program")
            }
            other => self.explain(other, "its name"),
        })?;
        if body.is_empty() {
            // Our own question came back.
            return Err(Error::device(format!(
                "the line on {} sends back what it is sent",
                self.path
            ))
            .help("see that a device is at its other end, and no plug that joins its two wires"));
        }
        let hello = HelloReply::read(&body).ok_or_else(|| {
            Error::device(format!(
                "the device on {} answers the hello in an unknown way",
                self.path
            ))
            .help("write this version's firmware to the board")
        })?;
        // What came before the answer had been waiting in the line, perhaps for an hour.
        self.events.begin(None);
        let text =
            |field: [u8; 24]| String::from_utf8_lossy(&field).trim_end_matches('\0').to_owned();
        self.identity = Identity {
            firmware: text(hello.firmware),
            board: text(hello.board),
            protocol: hello.protocol,
        };
        self.understands(&hello)
    }

    /// Whether both sides know the same messages; if not, which of them is older.
    fn understands(&self, hello: &HelloReply) -> Result<()> {
        let (theirs, ours) = (hello.protocol, wire::REVISION);
        if (theirs, hello.messages_key) == (ours, wire::MESSAGES_KEY) {
            return Ok(());
        }
        let (which, help) = match theirs.cmp(&ours) {
            Ordering::Less => {
                ("the device is the older one", "write this version's firmware to the board")
            }
            Ordering::Greater => (
                "this program is the older one",
                "use the program that came with the firmware, or a newer one",
            ),
            Ordering::Equal => (
                "they are of the same number and differ all the same, as between two releases",
                "build firmware and program from the same sources and write that firmware to the board",
            ),
        };
        Err(Error::device(format!(
            "the device on {} ({}) speaks protocol {theirs} ({:08x}), this program {ours} ({:08x}): {which}",
            self.path,
            self.identity.firmware,
            hello.messages_key,
            wire::MESSAGES_KEY
        ))
        .help(help))
    }

    /// Sends a request and waits for its reply.
    pub fn request(&mut self, request: &Request) -> std::result::Result<Reply, LinkError> {
        let patience = match request {
            Request::FlashBegin { .. }
            | Request::FlashTrial
            | Request::FlashCommit
            | Request::SetLinearity(_) => FLASH_ANSWER,
            _ => ANSWER,
        };
        let sequence = self.next_sequence();
        // Every request fits a frame: the wire's tests hold the largest against it.
        let frame =
            wire::encode(sequence, request).map_err(|e| LinkError::Gone(format!("{e:?}")))?;
        let body = self.exchange(Reply::KEY, sequence, &frame, patience)?;
        match postcard::from_bytes(&body) {
            Ok(Reply::Refused(refusal)) => Err(LinkError::Refused(refusal)),
            Ok(reply) => {
                if let Reply::Status(status) = &reply {
                    self.met(status);
                }
                Ok(reply)
            }
            Err(_) => Err(LinkError::Silent { bytes: self.bytes(), frames: self.frames }),
        }
    }

    /// Tells from its state whether the device is still the one it was.
    fn met(&mut self, status: &Status) {
        if self.session != 0 && status.session != self.session {
            self.resets += 1;
            self.events.began_anew();
        } else {
            self.events.goes_on();
        }
        self.session = status.session;
        self.events.had(status.next_event);
    }

    /// Gives this run of the device a name, where nobody has, and learns it.
    fn name_session(&mut self) -> std::result::Result<(), LinkError> {
        let number = rand::random::<u32>().max(1);
        self.request(&Request::Session { number })?;
        self.request(&Request::Status).map(|_| ())
    }

    /// How often the device has restarted, by a reset or a power cut, while this line was open.
    pub fn resets(&self) -> u64 {
        self.resets
    }

    /// The device's state.
    pub fn status(&mut self) -> Result<Status> {
        match self.request(&Request::Status) {
            Ok(Reply::Status(status)) => Ok(status),
            Ok(other) => Err(Error::device(format!(
                "the device on {} answered a question about its state with {other:?}",
                self.path
            ))),
            Err(e) => Err(self.explain(e, "its state")),
        }
    }

    /// Sends a request that is answered with "done".
    pub fn tell(&mut self, request: &Request, what: &str) -> Result<()> {
        self.request(request).map(|_| ()).map_err(|e| self.explain(e, what))
    }

    /// A link error as the user sees it.
    pub fn explain(&self, error: LinkError, what: &str) -> Error {
        let path = &self.path;
        match error {
            LinkError::Silent { .. } => {
                let silent = format!("the device on {path} does not answer ({what})");
                let error = |message| Error::new(Exit::Timeout, message);
                match holders(Path::new(path)).first() {
                    Some(other) => {
                        error(format!("{silent}; {}", other.beside())).help(other.help())
                    }
                    None => error(silent)
                        .help("check that it has power and that this is its port (`yawrig ports`)"),
                }
            }
            LinkError::Gone(why) => Error::device(format!("the device on {path} is gone: {why}"))
                .help("plug it in again and repeat the command"),
            LinkError::Refused(refusal) => {
                Error::device(format!("the device on {path} refused {what}: {refusal:?}"))
            }
            LinkError::Interrupted => Error::interrupted(),
        }
    }

    fn next_sequence(&mut self) -> u16 {
        self.sequence = self.sequence.wrapping_add(1);
        self.sequence
    }

    fn bytes(&self) -> u64 {
        self.bytes.load(atomic::Ordering::Relaxed)
    }

    fn exchange(
        &mut self,
        key: u32,
        sequence: u16,
        frame: &Encoded,
        patience: Duration,
    ) -> std::result::Result<Vec<u8>, LinkError> {
        for tried in 0..if port::is_of_a_program(&self.path) { TRIES_OF_A_PROGRAM } else { TRIES } {
            let before = self.bytes();
            self.send(frame)?;
            let deadline = Instant::now() + patience;
            while let Some(left) = deadline.checked_duration_since(Instant::now()) {
                if interrupt::requested() {
                    return Err(LinkError::Interrupted);
                }
                if let Some((k, s, body)) = self.take(left.min(Duration::from_millis(100)))?
                    && (k, s) == (key, sequence)
                {
                    return Ok(body);
                }
            }
            // Who says something else all the while does not wait for its turn.
            if tried + 1 >= TRIES && self.frames == 0 && self.bytes() > before {
                break;
            }
        }
        Err(LinkError::Silent { bytes: self.bytes(), frames: self.frames })
    }

    fn send(&mut self, frame: &Encoded) -> std::result::Result<(), LinkError> {
        let mut left: &[u8] = frame;
        let deadline = Instant::now() + ANSWER;
        while !left.is_empty() {
            // By 0 Windows says that the port takes nothing for the moment.
            match self.port.write(left).and_then(|n| match n {
                0 => Err(ErrorKind::TimedOut.into()),
                n => Ok(n),
            }) {
                Ok(n) => left = &left[n..],
                Err(e) if passing(&e) && Instant::now() < deadline => {}
                Err(e) if passing(&e) => {
                    return Err(LinkError::Silent { bytes: self.bytes(), frames: self.frames })
                }
                Err(e) => return Err(LinkError::Gone(e.to_string())),
            }
        }
        Ok(())
    }

    /// Takes one thing the reading thread found: an event is put aside, anything else returned.
    fn take(
        &mut self,
        patience: Duration,
    ) -> std::result::Result<Option<(u32, u16, Vec<u8>)>, LinkError> {
        if let Some(why) = &self.gone {
            return Err(LinkError::Gone(why.clone()));
        }
        match self.incoming.recv_timeout(patience) {
            Ok(Incoming::Frame { key, sequence, body }) => {
                self.frames += 1;
                if key == SAMPLES_KEY {
                    // They say nothing of events, so they do not count as having heard.
                    match (Samples::read(&body), &mut self.samples) {
                        (Some(samples), Some(waiting)) => waiting.push_back(samples),
                        (Some(_), None) => {}
                        (None, _) => self.garbled += 1,
                    }
                    return Ok(None);
                }
                self.heard = Instant::now();
                if key != Event::KEY {
                    return Ok(Some((key, sequence, body)));
                }
                match postcard::from_bytes(&body) {
                    Ok(event) => self.events.put(sequence, event),
                    Err(_) => self.garbled += 1,
                }
                Ok(None)
            }
            Ok(Incoming::Garbled) => {
                self.garbled += 1;
                Ok(None)
            }
            Ok(Incoming::Gone(why)) => {
                self.gone = Some(why.clone());
                Err(LinkError::Gone(why))
            }
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(LinkError::Gone("reading ended".into())),
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        self.stop.store(true, atomic::Ordering::Relaxed);
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}
