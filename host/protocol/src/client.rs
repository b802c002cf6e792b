//! Requests, replies and events over one line. A request without an answer is sent again under its
//! old sequence number; the device then repeats its answer and does nothing twice.

mod following;

use crate::events::Events;
use crate::line::{Incoming, Line, Words};
use std::cmp::Ordering;
use std::collections::VecDeque;
use std::time::Duration;
use yawrig_base::clock::Instant;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_shared::wire::{
    self, Encoded, Event, HelloReply, Message, Refusal, Reply, Request, Samples, Status, HELLO_KEY,
    SAMPLES_KEY,
};

/// How long the device may take over an ordinary answer, and over erasing or verifying flash.
const ANSWER: Duration = Duration::from_millis(700);
const FLASH_ANSWER: Duration = Duration::from_secs(4);
/// After so many questions, what has said anything else but no frame of ours is no device.
const TRIES: u32 = 3;

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
pub struct Client<L> {
    line: L,
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
    gone: Option<String>,
    pub identity: Identity,
}

impl<L: Line> Client<L> {
    /// Finds out who is at the other end.
    ///
    /// # Errors
    /// Exit 4: no device of ours, or another protocol; exit 7: nobody answers.
    pub async fn open(mut line: L) -> Result<Self> {
        // Another client's last request must not be answered to ours.
        let sequence = line.random() as u16;
        let mut client = Self {
            line,
            events: Events::default(),
            samples: None,
            session: 0,
            asked: None,
            resets: 0,
            sequence,
            garbled: 0,
            frames: 0,
            heard: Instant::now(),
            rounds: 0,
            gone: None,
            identity: Identity { firmware: String::new(), board: String::new(), protocol: 0 },
        };
        client.hello().await?;
        Ok(client)
    }

    pub fn path(&self) -> &str {
        self.line.name()
    }

    /// What users do about what is wrong.
    pub fn words(&self) -> &'static Words {
        self.line.words()
    }

    /// What the device is at the other end of.
    pub fn line(&mut self) -> &mut L {
        &mut self.line
    }

    async fn hello(&mut self) -> Result<()> {
        let sequence = self.next_sequence();
        let frame = wire::encode_raw(HELLO_KEY, sequence, &[])
            .map_err(|e| Error::internal(format!("hello does not fit a frame: {e:?}")))?;
        let body = self.exchange(HELLO_KEY, sequence, &frame, ANSWER).await.map_err(|e| match e {
            LinkError::Silent { bytes, frames: 0 } if bytes > 0 => Error::device(format!(
                "what is on {} is not a yawrig device: it sent {bytes} bytes and no frame that yawrig knows",
                self.path()
            ))
            .help(self.line.words().another_port),
            LinkError::Gone(_) if self.line.bytes() == 0 && self.line.turns_away() => {
                Error::device(format!("cannot open port {}: another program has it open", self.path()))
                    .help("close that program")
            }
            other => self.explain(other, "its name"),
        })?;
        if body.is_empty() {
            // Our own question came back.
            return Err(Error::device(format!(
                "the line on {} sends back what it is sent",
                self.path()
            ))
            .help("see that a device is at its other end, and no plug that joins its two wires"));
        }
        let hello = HelloReply::read(&body).ok_or_else(|| {
            Error::device(format!(
                "the device on {} answers the hello in an unknown way",
                self.path()
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
            self.path(),
            self.identity.firmware,
            hello.messages_key,
            wire::MESSAGES_KEY
        ))
        .help(help))
    }

    /// Sends a request and waits for its reply.
    pub async fn request(&mut self, request: &Request) -> std::result::Result<Reply, LinkError> {
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
        let body = self.exchange(Reply::KEY, sequence, &frame, patience).await?;
        match postcard::from_bytes(&body) {
            Ok(Reply::Refused(refusal)) => Err(LinkError::Refused(refusal)),
            Ok(reply) => {
                if let Reply::Status(status) = &reply {
                    self.met(status);
                }
                Ok(reply)
            }
            Err(_) => Err(LinkError::Silent { bytes: self.line.bytes(), frames: self.frames }),
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
    async fn name_session(&mut self) -> std::result::Result<(), LinkError> {
        let number = self.line.random().max(1);
        self.request(&Request::Session { number }).await?;
        self.request(&Request::Status).await.map(|_| ())
    }

    /// How often the device has restarted, by a reset or a power cut, while this line was open.
    pub fn resets(&self) -> u64 {
        self.resets
    }

    /// The device's state.
    pub async fn status(&mut self) -> Result<Status> {
        match self.request(&Request::Status).await {
            Ok(Reply::Status(status)) => Ok(status),
            Ok(other) => Err(Error::device(format!(
                "the device on {} answered a question about its state with {other:?}",
                self.path()
            ))),
            Err(e) => Err(self.explain(e, "its state")),
        }
    }

    /// Sends a request that is answered with "done".
    pub async fn tell(&mut self, request: &Request, what: &str) -> Result<()> {
        self.request(request).await.map(|_| ()).map_err(|e| self.explain(e, what))
    }

    /// A link error as the user sees it.
    pub fn explain(&self, error: LinkError, what: &str) -> Error {
        let path = self.path();
        match error {
            LinkError::Silent { .. } => {
                let silent = format!("the device on {path} does not answer ({what})");
                let error = |message| Error::new(Exit::Timeout, message);
                match self.line.other_reader() {
                    Some([beside, help]) => error(format!("{silent}; {beside}")).help(help),
                    None => error(silent).help(self.line.words().nobody),
                }
            }
            LinkError::Gone(why) => Error::device(format!("the device on {path} is gone: {why}"))
                .help(self.line.words().gone),
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

    async fn exchange(
        &mut self,
        key: u32,
        sequence: u16,
        frame: &Encoded,
        patience: Duration,
    ) -> std::result::Result<Vec<u8>, LinkError> {
        for tried in 0..self.line.tries() {
            let before = self.line.bytes();
            self.send(frame).await?;
            let deadline = Instant::now() + patience;
            while let Some(left) = deadline.checked_duration_since(Instant::now()) {
                if interrupt::requested() {
                    return Err(LinkError::Interrupted);
                }
                if let Some((k, s, body)) = self.take(left.min(Duration::from_millis(100))).await?
                    && (k, s) == (key, sequence)
                {
                    return Ok(body);
                }
            }
            // Who says something else all the while does not wait for its turn.
            if tried + 1 >= TRIES && self.frames == 0 && self.line.bytes() > before {
                break;
            }
        }
        Err(LinkError::Silent { bytes: self.line.bytes(), frames: self.frames })
    }

    async fn send(&mut self, frame: &Encoded) -> std::result::Result<(), LinkError> {
        match self.line.send(frame).await {
            Ok(true) => Ok(()),
            Ok(false) => Err(LinkError::Silent { bytes: self.line.bytes(), frames: self.frames }),
            Err(why) => Err(LinkError::Gone(why)),
        }
    }

    /// Takes one thing that has come: an event is put aside, anything else returned.
    async fn take(
        &mut self,
        patience: Duration,
    ) -> std::result::Result<Option<(u32, u16, Vec<u8>)>, LinkError> {
        if let Some(why) = &self.gone {
            return Err(LinkError::Gone(why.clone()));
        }
        match self.line.receive(patience).await {
            Ok(Some(Incoming::Frame { key, sequence, body })) => {
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
            Ok(Some(Incoming::Garbled)) => {
                self.garbled += 1;
                Ok(None)
            }
            Ok(None) => Ok(None),
            Err(why) => {
                self.gone = Some(why.clone());
                Err(LinkError::Gone(why))
            }
        }
    }
}
