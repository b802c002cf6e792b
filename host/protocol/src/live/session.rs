//! A device followed: what it says in order, with what was lost, over unplugging and restarts.

use super::clock::Clock;
use super::item::{Item, Windows};
use crate::client::{Client, LinkError};
use crate::condition::check;
use crate::follow::{began_text, check_measures, device_json};
use crate::line::Line;
use crate::numbers::{named, Named};
use std::collections::VecDeque;
use std::time::Duration;
use yawrig_base::clock::Instant;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_shared::wire::{Condition, Event, Learnt, Reply, Request, Samples, Settings, Status};

/// Samples asked for at a time, and how often: many questions may be lost before the stream ends.
/// Where a simulated rig runs faster than real time, they are asked for when half are left.
const LEASE: u32 = 60_000;
const RENEWAL: Duration = Duration::from_secs(1);
/// Between two attempts to open the port of a device that was unplugged.
const RETRY: Duration = Duration::from_millis(250);

/// What is to be followed of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follow {
    /// Its results.
    Results,
    /// Its potentiometer's trace, too.
    Trace,
}

/// A device, and what becomes of it once it was unplugged.
// As with [`Line`].
#[allow(async_fn_in_trait)]
pub trait Board {
    type Line: Line;

    fn client(&mut self) -> &mut Client<Self::Line>;

    /// What its line is called by others.
    fn port(&mut self) -> String;

    /// Whether it may be plugged in again.
    fn may_come_back(&self) -> bool;

    /// Speaks to it again where it is there again; what its line was called before, where that has changed.
    ///
    /// # Errors
    /// While it is not there.
    async fn reopen(&mut self) -> Result<Option<String>>;
}

/// A device that is followed.
pub struct Session<B> {
    bench: B,
    follow: Follow,
    items: VecDeque<Item>,
    windows: Windows,
    clock: Clock,
    /// Time of the latest event.
    latest: u64,
    /// The port is gone.
    gone: bool,
    /// Where it was, if it is there again under another path and that has not been reported.
    moved_from: Option<String>,
    /// When to ask next: for the stream and the state, or for the port.
    ask_at: Instant,
    /// Half of the samples that were asked for have come.
    leased_to: u64,
    /// The first samples have come.
    streams: bool,
    silent: bool,
    device: serde_json::Value,
    /// What else than natural frequency and damping ratio its network says.
    names: Vec<Named>,
    /// Results lost for good that were reported already; on this connection and on those before.
    missed: u64,
    /// Resets on this connection that were reported already, and what this run of the device is called.
    resets: u64,
    run: u32,
    /// What a reset makes the device forget, as it last had it; and that it has.
    known: (Settings, Option<Condition>),
    forgotten: bool,
    /// What it had learnt of its network's error when last asked.
    learnt: Learnt,
}

impl<B: Board> Session<B> {
    /// Follows a device from now on.
    ///
    /// # Errors
    /// Exit 7 where it does not answer, 4 where it is gone or in safe mode.
    pub async fn new(mut bench: B, follow: Follow) -> Result<Self> {
        let status = bench.client().status().await?;
        check_measures(&status)?;
        let mut session = Self {
            bench,
            follow,
            items: VecDeque::new(),
            windows: Windows::default(),
            clock: Clock::new(status.samples, 0),
            latest: 0,
            gone: false,
            moved_from: None,
            ask_at: Instant::now(),
            leased_to: 0,
            streams: false,
            silent: false,
            device: serde_json::Value::Null,
            names: Vec::new(),
            missed: 0,
            resets: 0,
            run: status.session,
            known: (status.settings, status.condition),
            forgotten: false,
            learnt: status.learnt,
        };
        session.tell_device(&status);
        Ok(session)
    }

    /// The device and what is before its potentiometer.
    pub fn bench(&mut self) -> &mut B {
        &mut self.bench
    }

    /// The device was unplugged, and is not there again.
    pub fn is_gone(&self) -> bool {
        self.gone
    }

    /// Number of the session's next sample.
    pub fn now(&self) -> u64 {
        self.clock.session
    }

    /// A user's note of this moment.
    pub fn mark(&mut self, text: &str) {
        self.items.push_back(Item::Mark { at: self.now(), text: text.to_owned() });
    }

    /// Something else that happened now.
    pub fn note(&mut self, item: Item) {
        self.items.push_back(item);
    }

    /// Says what the coming releases are made under; after a reset the device is told again. What it answers
    /// about itself then: a release that is going on was begun before.
    ///
    /// # Errors
    /// Exit 2 for a condition that cannot be, naming the quantity; those of the line.
    pub async fn set_condition(&mut self, condition: Condition) -> Result<Status> {
        check(&condition)?;
        self.bench
            .client()
            .tell(&Request::Condition(condition), "the condition of its releases")
            .await?;
        self.known.1 = Some(condition);
        let status = self.bench.client().status().await?;
        self.notice_forgotten(&status);
        Ok(status)
    }

    /// What happened next, waiting for it at most so long.
    ///
    /// # Errors
    /// Exit 4 where the device is gone and cannot come back, 130 where the user wants to stop.
    pub async fn next(&mut self, patience: Duration) -> Result<Option<Item>> {
        if self.items.is_empty() {
            if self.gone {
                self.try_again(patience).await?;
                return Ok(self.items.pop_front());
            }
            match self.listen(patience).await {
                Ok(()) => {}
                Err(LinkError::Interrupted) => return Err(Error::interrupted()),
                Err(LinkError::Gone(why)) if self.bench.may_come_back() => self.unplugged(why),
                Err(error) => return Err(self.bench.client().explain(error, "its events")),
            }
        }
        Ok(self.items.pop_front())
    }

    async fn listen(&mut self, patience: Duration) -> std::result::Result<(), LinkError> {
        if Instant::now() >= self.ask_at || self.now() > self.leased_to {
            self.ask_at = Instant::now() + RENEWAL;
            self.renew().await?;
        }
        let found = self.bench.client().next_event(patience).await?;
        // What came before the event stands before it.
        self.drain();
        let missed = self.bench.client().missed_events();
        if missed > self.missed {
            let count = missed - self.missed;
            self.missed = missed;
            self.items.push_back(Item::EventsLost { at: self.now(), count });
        }
        if self.bench.client().resets() > self.resets {
            let status = self.status().await?;
            self.notice_reset(&status);
            // It has forgotten that the stream was asked for.
            self.ask_at = Instant::now();
        }
        if let Some(numbered) = found {
            self.take_event(numbered.event);
        }
        Ok(())
    }

    /// Asks whether the device is the one it was, and for more of the stream.
    async fn renew(&mut self) -> std::result::Result<(), LinkError> {
        let asked = self.status().await;
        self.drain();
        let asked = match asked {
            Ok(status) => self.renewed(&status).await,
            Err(error) => Err(error),
        };
        match asked {
            Ok(()) => Ok(()),
            Err(error @ (LinkError::Gone(_) | LinkError::Interrupted)) => Err(error),
            Err(_) => {
                if !std::mem::replace(&mut self.silent, true) {
                    self.items.push_back(Item::Silent { at: self.now() });
                }
                Ok(())
            }
        }
    }

    /// The device has told its state.
    async fn renewed(&mut self, status: &Status) -> std::result::Result<(), LinkError> {
        self.notice_reset(status);
        self.silent = false;
        self.notice_forgotten(status);
        self.tell_device(status);
        if self.forgotten {
            self.remind(status).await?;
        } else {
            self.known = (status.settings, status.condition);
        }
        match self.follow {
            Follow::Trace => self.bench.client().stream(LEASE).await?,
            Follow::Results => {}
        }
        self.leased_to = self.now() + u64::from(LEASE) / 2;
        Ok(())
    }

    /// Takes the samples that have come.
    fn drain(&mut self) {
        while let Some(samples) = self.bench.client().next_samples() {
            self.take_samples(&samples);
        }
    }

    async fn status(&mut self) -> std::result::Result<Status, LinkError> {
        match self.bench.client().request(&Request::Status).await? {
            Reply::Status(status) => Ok(status),
            _ => Err(LinkError::Silent { bytes: 0, frames: 0 }),
        }
    }

    fn tell_device(&mut self, status: &Status) {
        let device = device_json(&self.bench.client().identity, status);
        if device != self.device {
            self.device = device.clone();
            self.names = named(&status.network);
            let port = self.bench.port();
            self.items.push_back(Item::Device { at: self.now(), port, device });
        }
    }

    /// Whether the device has begun anew while the port was open.
    fn notice_reset(&mut self, status: &Status) {
        self.run = status.session;
        let resets = self.bench.client().resets();
        if resets > self.resets {
            self.resets = resets;
            self.restarted(status);
        }
    }

    /// Whether what it had learnt is less than it was, and it says why.
    fn notice_forgotten(&mut self, status: &Status) {
        let before = std::mem::replace(&mut self.learnt, status.learnt).releases;
        if let Some(why) = status.learnt.forgotten.filter(|_| status.learnt.releases < before) {
            self.items.push_back(Item::Forgotten { at: self.now(), releases: before, why });
        }
    }

    /// A device that has begun anew is sent its settings and the condition of its releases again.
    async fn remind(&mut self, status: &Status) -> std::result::Result<(), LinkError> {
        let (settings, condition) = self.known;
        let condition = condition.filter(|_| status.condition.is_none());
        if status.settings != settings {
            self.bench.client().request(&Request::Configure(settings)).await?;
        }
        if let Some(condition) = condition {
            self.bench.client().request(&Request::Condition(condition)).await?;
        }
        if status.settings != settings || condition.is_some() {
            self.items.push_back(Item::Restored { at: self.now() });
        }
        self.forgotten = false;
        Ok(())
    }

    /// The device's clock begins anew.
    fn restarted(&mut self, status: &Status) {
        let session = self.clock.session + self.clock.due();
        self.clock = Clock::new(status.samples, session);
        self.windows = Windows::default();
        self.forgotten = true;
        let why = began_text(status);
        self.items.push_back(Item::Restarted { at: session, why });
    }

    fn take_samples(&mut self, samples: &Samples) {
        let ahead = self.clock.since(samples.first_sample);
        if ahead < 0 {
            // A message that came twice: what a restarted device sends comes after its state.
            return;
        }
        // Before the first ones nobody had asked for any.
        if std::mem::replace(&mut self.streams, true) && ahead > 0 {
            self.items.push_back(Item::Gap { first: self.clock.session, count: ahead as u64 });
        }
        let first = self.clock.of(samples.first_sample);
        let degrees = decimal(samples.degrees_per_count);
        let yaw_deg = samples
            .counts
            .iter()
            .map(|counts| f64::from(i32::from(*counts) - i32::from(samples.zero_counts)) * degrees);
        self.items.push_back(Item::Samples { first, yaw_deg: yaw_deg.collect() });
        let count = samples.counts.len();
        let device = samples.first_sample.wrapping_add(count as u32);
        self.clock = Clock::new(device, first + count as u64);
    }

    fn take_event(&mut self, event: Event) {
        let sample = match &event {
            Event::Phase { at_sample, .. } => *at_sample,
            Event::Window(window) => window.sent_sample,
            Event::Release(result) => result.finished_sample,
            // Of a release that was over before; samples up to what was said before it may be still to come.
            Event::Refined(_) => {
                let at = self.now().max(self.latest);
                let (trends, names) = (Vec::new(), Vec::new());
                self.items.push_back(Item::Event { at, event, trends, names });
                return;
            }
        };
        if self.follow == Follow::Results && self.clock.since(sample) > 0 {
            self.clock = Clock::new(sample, self.clock.of(sample));
        }
        let at = self.clock.of(sample);
        self.latest = self.latest.max(at);
        let trends = self.windows.take(&event);
        let names = match &event {
            Event::Window(_) | Event::Release(_) => self.names.clone(),
            _ => Vec::new(),
        };
        self.items.push_back(Item::Event { at, event, trends, names });
    }

    fn unplugged(&mut self, why: String) {
        // What had come before is not lost.
        self.drain();
        self.items.push_back(Item::Disconnected { at: self.now(), why });
        self.gone = true;
        self.ask_at = Instant::now() + RETRY;
    }

    /// Opens the port where it is there again.
    async fn try_again(&mut self, patience: Duration) -> Result<()> {
        let due = self.ask_at.saturating_duration_since(Instant::now());
        self.bench.client().line().pause(due.min(patience)).await;
        interrupt::check()?;
        if due > patience {
            return Ok(());
        }
        self.ask_at = Instant::now() + RETRY;
        let expected = self.bench.client().expected_event();
        // Whatever is wrong with the port, it is tried again: it may not have settled.
        let Ok(moved_from) = self.bench.reopen().await else { return Ok(()) };
        self.moved_from = self.moved_from.take().or(moved_from);
        let Ok(status) = self.status().await else { return Ok(()) };
        self.gone = false;
        self.missed = 0;
        self.device = serde_json::Value::Null;
        self.resets = 0;
        if self.began_anew(&status) {
            self.restarted(&status);
            self.bench.client().resume(0, status.next_event);
        } else if let Some(expected) = expected {
            self.bench.client().resume(expected, status.next_event);
        }
        self.run = status.session;
        let port = self.bench.client().path().to_owned();
        if let Some(was) = self.moved_from.take().filter(|was| *was != port) {
            self.items.push_back(Item::Back { at: self.now(), port, was });
        }
        self.tell_device(&status);
        self.ask_at = Instant::now();
        Ok(())
    }

    /// Whether the device that is there again lost its power meanwhile: its run has another name, or
    /// it had none yet and its clock is behind.
    fn began_anew(&self, status: &Status) -> bool {
        match self.run {
            0 => self.clock.since(status.samples) < 0,
            run => status.session != run,
        }
    }
}

/// A device's `f32` as the shortest decimal that means it: 0.005 and not 0.004999999888.
fn decimal(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}
