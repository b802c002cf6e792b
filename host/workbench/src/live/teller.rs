//! Shows the pages what happens, as often as they can draw it.

use super::shown::Shown;
use serde_json::{json, Value};
use std::sync::Arc;
use std::time::{Duration, Instant};
use yawrig_link::live::item::Item;
use yawrig_session::followed::{trace_json, Stretch};

/// Between two messages to the pages.
const BETWEEN: Duration = Duration::from_millis(100);

/// Shows what happens to the pages that are open and keeps it for those to come.
pub struct Teller {
    shown: Arc<Shown>,
    /// Not sent yet.
    fresh: Vec<Stretch>,
    lines: Vec<Value>,
    sent: Instant,
}

impl Teller {
    pub fn new(shown: &Arc<Shown>) -> Self {
        Self { shown: shown.clone(), fresh: Vec::new(), lines: Vec::new(), sent: Instant::now() }
    }

    pub fn show(&mut self, item: &Item) {
        let (line, fresh) = self.shown.seen(|seen| seen.take(item));
        self.fresh.extend(fresh);
        self.lines.extend(line);
    }

    /// A line of the log that belongs to no item.
    pub fn log(&mut self, line: Value, text: &str) {
        let line = self.shown.seen(|seen| seen.log(line, text));
        self.lines.push(line);
    }

    /// Starts the pages anew with the items so far.
    pub fn begin_anew<'a>(&mut self, items: impl Iterator<Item = &'a Item>) {
        self.fresh.clear();
        self.lines.clear();
        self.shown.seen(|seen| {
            let (device, replay) = (std::mem::take(&mut seen.device), seen.replay.take());
            seen.begin(&device, replay);
            for item in items {
                seen.take(item);
            }
        });
        self.tell();
    }

    pub fn is_due(&self) -> bool {
        self.sent.elapsed() >= BETWEEN
    }

    pub fn tell(&mut self) {
        self.sent = Instant::now();
        let fresh = std::mem::take(&mut self.fresh);
        let lines = std::mem::take(&mut self.lines);
        self.shown.news.send(&json!({
            "kind": "live",
            "state": self.shown.to_json(),
            "trace": trace_json(fresh.iter()),
            "lines": lines,
        }));
    }
}
