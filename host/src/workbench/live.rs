//! A device followed on the page: its trace thinned to what is drawn, its results, recordings and marks.

use super::app::App;
use super::series::short;
use crate::criticism::records;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::link::bench::{Bench, Target};
use crate::link::port;
use crate::live::item::{time_s, Item};
use crate::live::recording::Recording;
use crate::live::session::{Follow, Session};
use crate::live::swing::Swing;
use serde_json::{json, Value};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{channel, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Samples of which the least and the largest are sent: two values every 10 ms.
const STRETCH: u64 = 10;
/// How often the page is told.
const TELL: Duration = Duration::from_millis(100);
/// Stretches that a page opened later is given: a minute.
const KEPT: usize = 6000;
/// Lines of the log that are kept.
const MOST_LINES: usize = 500;
/// Folder of recordings made from the page.
pub const FOLDER: &str = "recordings";

/// What a user does with the device that is followed.
enum Order {
    Record,
    StopRecording,
    Mark(String),
    Leave,
}

/// The device that is followed, if any.
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

/// What is known of it, for pages.
#[derive(Default)]
struct Seen {
    device: String,
    /// Why it is not followed any more.
    fault: Option<Error>,
    trace: VecDeque<Stretch>,
    open: Option<Stretch>,
    samples: u64,
    missing: u64,
    recording: Option<PathBuf>,
    /// Text and JSON of what happened, the number of the first and of those to come.
    lines: VecDeque<Value>,
    count: u64,
}

/// The least and the largest of ten samples, by the number of the stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    number: u64,
    low: f64,
    high: f64,
}

impl Live {
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ports, and whether a device is followed.
    pub fn to_json(&self) -> Value {
        let inner = self.inner();
        let seen = &inner.seen;
        json!({
            "is_followed": inner.orders.is_some(),
            "device": seen.device,
            "samples": seen.samples,
            "missing_samples": seen.missing,
            "recording": seen.recording.as_ref().map(|p| p.display().to_string()),
            "fault": seen.fault.as_ref().map(|e| json!({"message": e.message, "help": e.help})),
        })
    }

    /// All that a page which has just been opened has missed.
    pub fn history(&self) -> Value {
        let mut out = self.to_json();
        let seen = &self.inner().seen;
        out["trace"] = trace_json(seen.trace.iter());
        out["lines"] = json!(seen.lines);
        out
    }

    /// Follows a device: `emulated`, or a port's path.
    ///
    /// # Errors
    /// Exit 2 where one is followed already. What is wrong with the device itself is told later.
    pub fn connect(&self, app: &Arc<App>, device: &str) -> Result<()> {
        let mut inner = self.inner();
        if inner.orders.is_some() {
            return Err(Error::usage("a device is followed already").help("disconnect it first"));
        }
        let (send, orders) = channel();
        let Ok(target) = device.parse::<Target>();
        inner.seen = Seen { device: device.to_owned(), ..Seen::default() };
        inner.orders = Some(send);
        let app = app.clone();
        inner.thread = Some(std::thread::spawn(move || {
            let ended = follow(&app, &target, &orders);
            let mut inner = app.live.inner();
            inner.orders = None;
            inner.seen.recording = None;
            inner.seen.fault = ended.err().filter(|_| !interrupt::requested());
            drop(inner);
            app.tell(&json!({"kind": "live", "state": app.live.to_json()}));
        }));
        Ok(())
    }

    fn order(&self, order: Order) -> Result<()> {
        let sent = self.inner().orders.as_ref().map(|orders| orders.send(order));
        match sent {
            Some(Ok(())) => Ok(()),
            _ => Err(Error::usage("no device is followed").help("connect one first")),
        }
    }

    /// # Errors
    /// These four: exit 2 where no device is followed.
    pub fn record(&self) -> Result<()> {
        self.order(Order::Record)
    }

    pub fn stop_recording(&self) -> Result<()> {
        self.order(Order::StopRecording)
    }

    pub fn mark(&self, text: &str) -> Result<()> {
        self.order(Order::Mark(text.to_owned()))
    }

    pub fn leave(&self) -> Result<()> {
        self.order(Order::Leave)
    }

    /// Waits until what is being recorded is whole; the user has stopped the program.
    pub fn end(&self) {
        let thread = self.inner().thread.take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }
}

fn trace_json<'a>(stretches: impl Iterator<Item = &'a Stretch>) -> Value {
    let mut out = (Vec::new(), Vec::new(), Vec::new());
    for s in stretches {
        out.0.push(time_s(s.number * STRETCH));
        out.1.push(short(s.low));
        out.2.push(short(s.high));
    }
    json!({"time_s": out.0, "low_deg": out.1, "high_deg": out.2})
}

/// The device and where it is written to.
struct Following<'a> {
    app: &'a Arc<App>,
    session: Session,
    recording: Option<Recording>,
    device: Option<Item>,
    effects: String,
    /// Not told of yet.
    fresh: Vec<Stretch>,
    lines: Vec<Value>,
    told: Instant,
}

fn follow(app: &Arc<App>, target: &Target, orders: &Receiver<Order>) -> Result<()> {
    let bench = Bench::open(target)?;
    let mut swing = match target {
        Target::Port(_) => None,
        _ => Some(Swing::new(1.0)),
    };
    let mut following = Following {
        app,
        session: Session::new(bench, Follow::Trace)?,
        recording: None,
        device: None,
        effects: String::new(),
        fresh: Vec::new(),
        lines: Vec::new(),
        told: Instant::now(),
    };
    let done = following.run(&mut swing, orders);
    // However it ended: what was recorded is kept.
    let kept = following.stop();
    following.tell();
    done.and(kept)
}

impl Following<'_> {
    fn run(&mut self, swing: &mut Option<Swing>, orders: &Receiver<Order>) -> Result<()> {
        loop {
            interrupt::check()?;
            if let Some(swing) = swing {
                swing.go_on(self.session.bench())?;
            }
            let mut patience = Duration::from_millis(20);
            while let Some(item) = self.session.next(patience)? {
                patience = Duration::ZERO;
                self.take(item)?;
            }
            while let Ok(order) = orders.try_recv() {
                match order {
                    Order::Record => self.start()?,
                    Order::StopRecording => self.stop()?,
                    Order::Mark(text) => self.session.mark(&text),
                    Order::Leave => return Ok(()),
                }
            }
            if self.told.elapsed() >= TELL {
                self.tell();
            }
        }
    }

    fn take(&mut self, item: Item) -> Result<()> {
        self.show(&item);
        let records = match &mut self.recording {
            Some(recording) => recording.put(&item)?,
            None => Vec::new(),
        };
        records.iter().for_each(|record| self.keep(record));
        if matches!(item, Item::Device { .. }) {
            self.device = Some(item);
        }
        Ok(())
    }

    fn show(&mut self, item: &Item) {
        if let Some(effects) = item.effects() {
            self.effects = effects;
        }
        let mut inner = self.app.live.inner();
        let seen = &mut inner.seen;
        match item {
            Item::Samples { first, yaw_deg } => {
                seen.samples += yaw_deg.len() as u64;
                for (number, yaw_deg) in (*first..).zip(yaw_deg) {
                    if let Some(done) = seen.add(number / STRETCH, *yaw_deg) {
                        self.fresh.push(done);
                    }
                }
            }
            Item::Gap { count, .. } => seen.missing += count,
            _ => {}
        }
        if let Some(text) = item.to_text(&self.effects) {
            seen.count += 1;
            let mut line = item.to_json();
            line["text"] = json!(text);
            line["number"] = json!(seen.count);
            seen.lines.push_back(line.clone());
            if seen.lines.len() > MOST_LINES {
                seen.lines.pop_front();
            }
            self.lines.push(line);
        }
    }

    /// A release that is whole joins the list of releases.
    fn keep(&mut self, record: &Item) {
        self.show(record);
        let Item::Record { file, .. } = record else { return };
        let folder = self.app.live.inner().seen.recording.clone();
        let path = folder.as_deref().and_then(Path::parent).unwrap_or(Path::new("")).join(file);
        let model_path = self.app.session().model_path.clone();
        if let Ok(entries) = records::entries(&[path], &model_path) {
            let mut session = self.app.session();
            for entry in entries {
                let used = session.used_when_new();
                session.include(entry, used);
            }
            drop(session);
            self.app.tell_state();
            self.app.work.wake();
        }
    }

    fn start(&mut self) -> Result<()> {
        if self.recording.is_some() {
            return Ok(());
        }
        let recording = Recording::begin(Path::new(FOLDER), self.device.as_ref())?;
        self.app.live.inner().seen.recording = Some(recording.trace());
        self.recording = Some(recording);
        Ok(())
    }

    fn stop(&mut self) -> Result<()> {
        let Some(recording) = self.recording.take() else { return Ok(()) };
        let (finished, records) = recording.finish()?;
        records.iter().for_each(|record| self.keep(record));
        let mut inner = self.app.live.inner();
        inner.seen.recording = None;
        inner.seen.count += 1;
        let missing = match finished.missing_samples {
            0 => "none missing".to_owned(),
            count => format!("{count} missing"),
        };
        let text = format!(
            "{}: {} samples, {missing}, {} releases",
            finished.trace.display(),
            finished.samples,
            finished.releases
        );
        let line = json!({
            "event": "recorded", "text": text, "number": inner.seen.count,
            "file": finished.trace.display().to_string(),
            "samples": finished.samples, "missing_samples": finished.missing_samples,
        });
        inner.seen.lines.push_back(line.clone());
        drop(inner);
        self.lines.push(line);
        Ok(())
    }

    fn tell(&mut self) {
        self.told = Instant::now();
        let fresh = std::mem::take(&mut self.fresh);
        let lines = std::mem::take(&mut self.lines);
        self.app.tell(&json!({
            "kind": "live",
            "state": self.app.live.to_json(),
            "trace": trace_json(fresh.iter()),
            "lines": lines,
        }));
    }
}

impl Seen {
    /// Takes a sample of stretch `number`; the stretch before, where that is whole.
    fn add(&mut self, number: u64, yaw_deg: f64) -> Option<Stretch> {
        if let Some(open) = &mut self.open {
            if open.number == number {
                open.low = open.low.min(yaw_deg);
                open.high = open.high.max(yaw_deg);
                return None;
            }
        }
        let done = self.open.replace(Stretch { number, low: yaw_deg, high: yaw_deg })?;
        self.trace.push_back(done);
        if self.trace.len() > KEPT {
            self.trace.pop_front();
        }
        Some(done)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_ten_samples_the_least_and_the_largest_are_kept() {
        let mut seen = Seen::default();
        let told: Vec<Stretch> = (0..35_u64)
            .filter_map(|n| seen.add(n / STRETCH, if n == 13 { -4.0 } else { n as f64 }))
            .collect();
        let bounds: Vec<(u64, f64, f64)> = told.iter().map(|s| (s.number, s.low, s.high)).collect();
        assert_eq!(bounds, [(0, 0.0, 9.0), (1, -4.0, 19.0), (2, 20.0, 29.0)]);
        // After a gap a new stretch begins where the samples do.
        assert_eq!(seen.add(9, 1.0).map(|s| s.number), Some(3));
        assert_eq!(seen.add(10, 1.0).map(|s| s.number), Some(9));
    }
}
