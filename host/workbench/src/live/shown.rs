//! What is shown live, and the thread behind it: the user's orders go to it, what it has seen comes back.

use super::super::news::News;
use serde_json::{json, Value};
use std::sync::mpsc::{channel, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_campaign::plan::Wanted;
use yawrig_session::followed::Seen;

/// What a user does with the device or the session.
pub enum Order {
    Record,
    StopRecording,
    Mark(String),
    /// What the coming releases are made under; then: leave the next one out, make the last one again.
    Measure(Box<Wanted>),
    Skip,
    Back,
    /// For stored sessions: play, pause, speed (times real time), jump to this time.
    Play,
    Pause,
    Speed(f64),
    Jump(f64),
    /// For both: stop showing it.
    Leave,
}

impl Order {
    fn is_of_a_session(&self) -> bool {
        matches!(self, Self::Play | Self::Pause | Self::Speed(_) | Self::Jump(_))
    }
}

/// The device or the stored session that is shown, if any.
pub struct Shown {
    inner: Mutex<Inner>,
    pub news: News,
}

#[derive(Default)]
struct Inner {
    orders: Option<Sender<Order>>,
    thread: Option<JoinHandle<()>>,
    seen: Seen,
}

impl Shown {
    pub fn new(news: News) -> Self {
        Self { inner: Mutex::default(), news }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Locked for moments only.
    pub fn seen<T>(&self, with: impl FnOnce(&mut Seen) -> T) -> T {
        with(&mut self.inner().seen)
    }

    /// State for the pages.
    pub fn to_json(&self) -> Value {
        let inner = self.inner();
        inner.seen.to_json(inner.orders.is_some())
    }

    /// All that a page which has just been opened has missed.
    pub fn history(&self) -> Value {
        let inner = self.inner();
        inner.seen.history(inner.orders.is_some())
    }

    /// Runs `run` in a thread of its own until the user leaves it.
    ///
    /// # Errors
    /// Exit 2 where something is shown already.
    pub fn begin(
        self: &Arc<Self>,
        begin: impl FnOnce(&mut Seen),
        run: impl FnOnce(&Arc<Self>, &Receiver<Order>) -> Result<()> + Send + 'static,
    ) -> Result<()> {
        let mut inner = self.inner();
        if inner.orders.is_some() {
            let (what, help) = match inner.seen.replay {
                None => ("a device is followed already", "disconnect it first"),
                Some(_) => ("a stored session is shown already", "leave it first"),
            };
            return Err(Error::usage(what).help(help));
        }
        let (send, orders) = channel();
        begin(&mut inner.seen);
        inner.orders = Some(send);
        let shown = self.clone();
        inner.thread = Some(std::thread::spawn(move || {
            let ended = run(&shown, &orders);
            let mut inner = shown.inner();
            inner.orders = None;
            inner.seen.recording = None;
            inner.seen.fault = ended.err().filter(|_| !interrupt::requested());
            drop(inner);
            shown.news.send(&json!({"kind": "live", "state": shown.to_json()}));
        }));
        Ok(())
    }

    /// # Errors
    /// Exit 2 where nothing is shown that this could be done with.
    pub fn order(&self, order: Order) -> Result<()> {
        let inner = self.inner();
        let nothing = || Error::usage("no device is followed").help("connect one first");
        let orders = inner.orders.as_ref().ok_or_else(nothing)?;
        match (&inner.seen.replay, &order) {
            (_, Order::Leave) => {}
            (None, order) if order.is_of_a_session() => {
                return Err(Error::usage("a device is followed, not a stored session")
                    .help("disconnect it and choose a session"))
            }
            (Some(_), order) if !order.is_of_a_session() => {
                return Err(Error::usage("a stored session is shown: it is not changed")
                    .help("leave it and connect a device"))
            }
            _ => {}
        }
        orders.send(order).map_err(|_| nothing())
    }

    /// Waits until what is being recorded is whole; the user has stopped the program.
    pub fn end(&self) {
        let thread = self.inner().thread.take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }
}
