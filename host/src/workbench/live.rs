//! A device followed on the page, or a stored session shown again as if it were one.

mod following;
mod playing;
mod seen;

use super::app::App;
use seen::Seen;
use serde_json::{json, Value};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{channel, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_link::bench::Target;
use yawrig_link::live::sessions::{self, Listed};
use yawrig_link::live::stored::Stored;
use yawrig_link::port;

/// Folder of recordings made from the page.
pub const FOLDER: &str = "recordings";

/// What a user does with the device or the session.
pub enum Order {
    Record,
    StopRecording,
    Mark(String),
    /// From here on a stored session's: go on, stand still, so many times as fast as life, to this time.
    Play,
    Pause,
    Speed(f64),
    Jump(f64),
    /// Of either.
    Leave,
}

impl Order {
    fn is_of_a_session(&self) -> bool {
        matches!(self, Self::Play | Self::Pause | Self::Speed(_) | Self::Jump(_))
    }
}

/// The device or the stored session that is shown, if any.
#[derive(Default)]
pub struct Live {
    inner: Mutex<Inner>,
}

#[derive(Default)]
struct Inner {
    orders: Option<Sender<Order>>,
    thread: Option<JoinHandle<()>>,
    seen: Seen,
}

impl Live {
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Held for moments only.
    fn seen<T>(&self, with: impl FnOnce(&mut Seen) -> T) -> T {
        with(&mut self.inner().seen)
    }

    /// What is shown, and how far.
    pub fn to_json(&self) -> Value {
        let inner = self.inner();
        inner.seen.to_json(inner.orders.is_some())
    }

    /// All that a page which has just been opened has missed.
    pub fn history(&self) -> Value {
        let inner = self.inner();
        inner.seen.history(inner.orders.is_some())
    }

    /// Follows a device: `emulated`, or a port's path.
    ///
    /// # Errors
    /// Exit 2 where something is shown already. What is wrong with the device itself is told later.
    pub fn connect(&self, app: &Arc<App>, device: &str) -> Result<()> {
        let Ok(target) = device.parse::<Target>();
        self.begin(
            app,
            |seen| seen.begin(device, None),
            move |app, orders| following::follow(app, &target, orders),
        )
    }

    /// Shows a stored session again from its beginning.
    ///
    /// # Errors
    /// Those of [`Stored::open`]; exit 3 where nothing is in it, 2 where something is shown already.
    pub fn replay(&self, app: &Arc<App>, session: &Path) -> Result<()> {
        let stored = Stored::open(session)?;
        let replay = playing::replay_of(&stored)?;
        let shown = replay.clone();
        self.begin(
            app,
            |seen| seen.begin("", Some(shown)),
            move |app, orders| playing::play(app, &stored, replay, orders),
        )
    }

    fn begin(
        &self,
        app: &Arc<App>,
        begin: impl FnOnce(&mut Seen),
        run: impl FnOnce(&Arc<App>, &Receiver<Order>) -> Result<()> + Send + 'static,
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
        let app = app.clone();
        inner.thread = Some(std::thread::spawn(move || {
            let ended = run(&app, &orders);
            let mut inner = app.live.inner();
            inner.orders = None;
            inner.seen.recording = None;
            inner.seen.fault = ended.err().filter(|_| !interrupt::requested());
            drop(inner);
            app.tell(&json!({"kind": "live", "state": app.live.to_json()}));
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

/// The devices that could be followed.
///
/// # Errors
/// Exit 4 where the ports cannot be listed.
pub fn devices() -> Result<Value> {
    let ports = port::list()?;
    Ok(json!({ "ports": ports }))
}

/// The stored sessions that could be shown, newest first: those in the folder of the page's recordings, beside the
/// model's file, and in the folders there.
pub fn stored(model: &Path) -> Value {
    let beside = model.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut folders = vec![PathBuf::from(FOLDER), beside.to_owned()];
    let inside = beside.read_dir().into_iter().flatten().flatten();
    folders.extend(inside.filter(|e| e.file_type().is_ok_and(|t| t.is_dir())).map(|e| e.path()));
    let listed = |session: &Listed| {
        let Listed { stem, duration_s, releases, marks, is_finished, is_damaged, .. } = session;
        // As a user would name it.
        let stem = stem.strip_prefix(".").unwrap_or(stem);
        json!({
            "session": stem.display().to_string(),
            "started": humantime::format_rfc3339_seconds(session.started).to_string(),
            "duration_s": duration_s, "releases": releases, "marks": marks,
            "is_finished": is_finished, "is_damaged": is_damaged,
        })
    };
    json!({"sessions": sessions::list(&folders).iter().map(listed).collect::<Vec<_>>()})
}
