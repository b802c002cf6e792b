//! What a device or a stored session has shown so far: its trace thinned to what is drawn, its results, its
//! marks.

use serde_json::{json, Value};
use std::collections::VecDeque;
use std::path::PathBuf;
use yawrig_base::error::Error;
use yawrig_protocol::live::item::{time_s, Item};
use yawrig_report::drawn::short;

/// Samples of which the least and the largest are sent: two values every 10 ms.
const STRETCH: u64 = 10;
/// Stretches that a page opened later is given: a minute.
const KEPT: usize = 6000;
/// Lines of the log that are kept.
const MAX_LINES: usize = 500;

/// State shown on the pages.
#[derive(Default)]
pub struct Seen {
    pub device: String,
    /// Why nothing is shown any more.
    pub fault: Option<Error>,
    pub recording: Option<PathBuf>,
    /// How many times as fast as a real rig the built-in one swings; none before a board.
    pub speed: Option<f64>,
    /// The campaign or the condition that is being measured, as it was asked for, and whether all is made.
    pub measuring: Option<(Value, bool)>,
    /// Most bytes that an hour of recording takes, and those that are free there.
    pub disk: Option<(f64, Option<u64>)>,
    /// Where a stored session is shown instead of a device.
    pub replay: Option<Replay>,
    /// Changes with each beginning and each jump: a page that knows an earlier number asks for everything.
    pub epoch: u64,
    /// Effects that the device's network knows.
    effects: String,
    trace: VecDeque<Stretch>,
    open: Option<Stretch>,
    samples: u64,
    missing: u64,
    /// Text and JSON of what happened, the number of the first and of those to come.
    lines: VecDeque<Value>,
    count: u64,
}

/// A stored session that is shown. Times are the session's, in s.
#[derive(Clone, Debug)]
pub struct Replay {
    pub file: String,
    pub started: Option<String>,
    pub is_finished: bool,
    pub from_s: f64,
    pub to_s: f64,
    pub at_s: f64,
    pub is_playing: bool,
    /// Times real time.
    pub speed: f64,
    /// Marks and releases to jump to.
    pub places: Vec<(f64, String)>,
}

/// The least and the largest of ten samples, by the number of the stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    number: u64,
    low: f64,
    high: f64,
}

impl Seen {
    /// Starts anew, for another device or session.
    pub fn begin(&mut self, device: &str, replay: Option<Replay>) {
        let epoch = self.epoch + 1;
        *self = Self { device: device.to_owned(), replay, epoch, ..Self::default() };
    }

    /// Takes what happened; its line of the log, if it has one, and the stretches that are whole by it.
    pub fn take(&mut self, item: &Item) -> (Option<Value>, Vec<Stretch>) {
        if let Some(effects) = item.effects() {
            self.effects = effects;
        }
        let mut fresh = Vec::new();
        match item {
            Item::Samples { first, yaw_deg } => {
                self.samples += yaw_deg.len() as u64;
                for (number, yaw_deg) in (*first..).zip(yaw_deg) {
                    fresh.extend(self.add(number / STRETCH, *yaw_deg));
                }
            }
            Item::Gap { count, .. } => self.missing += count,
            Item::Back { port, .. } => self.device.clone_from(port),
            _ => {}
        }
        let line = item.to_text(&self.effects).map(|text| self.log(item.to_json(), &text));
        (line, fresh)
    }

    /// Adds a line to the log.
    pub fn log(&mut self, mut line: Value, text: &str) -> Value {
        self.count += 1;
        line["text"] = json!(text);
        line["number"] = json!(self.count);
        self.lines.push_back(line.clone());
        if self.lines.len() > MAX_LINES {
            // A page that is opened later is to be told of every release and condition: windows go first.
            let oldest = self.lines.iter().position(|line| line["event"] == "window").unwrap_or(0);
            self.lines.remove(oldest);
        }
        line
    }

    /// Takes a sample of stretch `number`; the stretch before, where that is whole.
    fn add(&mut self, number: u64, yaw_deg: f64) -> Option<Stretch> {
        if let Some(open) = &mut self.open
            && open.number == number
        {
            open.low = open.low.min(yaw_deg);
            open.high = open.high.max(yaw_deg);
            return None;
        }
        let done = self.open.replace(Stretch { number, low: yaw_deg, high: yaw_deg })?;
        self.trace.push_back(done);
        if self.trace.len() > KEPT {
            self.trace.pop_front();
        }
        Some(done)
    }

    /// All but trace and log.
    pub fn to_json(&self, is_on: bool) -> Value {
        let replay = self.replay.as_ref().map(|r| {
            json!({
                "file": r.file, "started": r.started, "is_finished": r.is_finished,
                "from_s": r.from_s, "to_s": r.to_s, "at_s": r.at_s,
                "is_playing": r.is_playing, "speed": r.speed,
            })
        });
        json!({
            "epoch": self.epoch,
            "is_followed": is_on && self.replay.is_none(),
            "device": self.device,
            "samples": self.samples,
            "missing_samples": self.missing,
            "recording": self.recording.as_ref().map(|p| p.display().to_string()),
            "speed": self.speed.filter(|_| is_on),
            "measuring": self.measuring.as_ref().filter(|_| is_on).map(|(wanted, has_ended)| {
                json!({"wanted": wanted, "has_ended": has_ended})
            }),
            "disk": self.disk.filter(|_| is_on).map(|(bytes_an_hour, free_bytes)| {
                json!({"bytes_an_hour": bytes_an_hour, "free_bytes": free_bytes})
            }),
            "replay": replay.filter(|_| is_on),
            "fault": self.fault.as_ref().map(|e| json!({"message": e.message, "help": e.help})),
        })
    }

    /// Everything, for a page that has just been opened.
    pub fn history(&self, is_on: bool) -> Value {
        let mut out = self.to_json(is_on);
        out["trace"] = trace_json(self.trace.iter());
        out["lines"] = json!(self.lines);
        let places = self.replay.iter().flat_map(|r| &r.places);
        out["places"] =
            places.map(|(time_s, text)| json!({"time_s": time_s, "text": text})).collect();
        out
    }
}

pub fn trace_json<'a>(stretches: impl Iterator<Item = &'a Stretch>) -> Value {
    let mut out = (Vec::new(), Vec::new(), Vec::new());
    for s in stretches {
        out.0.push(time_s(s.number * STRETCH));
        out.1.push(short(s.low));
        out.2.push(short(s.high));
    }
    json!({"time_s": out.0, "low_deg": out.1, "high_deg": out.2})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_ten_samples_the_least_and_the_largest_are_kept() {
        let mut seen = Seen::default();
        let said: Vec<Stretch> = (0..35_u64)
            .filter_map(|n| seen.add(n / STRETCH, if n == 13 { -4.0 } else { n as f64 }))
            .collect();
        let bounds: Vec<(u64, f64, f64)> = said.iter().map(|s| (s.number, s.low, s.high)).collect();
        assert_eq!(bounds, [(0, 0.0, 9.0), (1, -4.0, 19.0), (2, 20.0, 29.0)]);
        // After a gap a new stretch begins where the samples do.
        assert_eq!(seen.add(9, 1.0).map(|s| s.number), Some(3));
        assert_eq!(seen.add(10, 1.0).map(|s| s.number), Some(9));
    }

    #[test]
    fn of_many_lines_the_windows_are_forgotten_first() {
        let mut seen = Seen::default();
        for release in 0..40 {
            seen.log(json!({"event": "condition", "release": release}), "next");
            (0..20).for_each(|_| drop(seen.log(json!({"event": "window"}), "a window")));
        }
        let of = |event: &str| seen.lines.iter().filter(|line| line["event"] == event).count();
        assert_eq!((of("condition"), of("window")), (40, MAX_LINES - 40));
        let numbers: Vec<u64> = seen.lines.iter().filter_map(|l| l["number"].as_u64()).collect();
        assert!(numbers.is_sorted() && numbers.last() == Some(&840), "{numbers:?}");
    }

    #[test]
    fn what_begins_anew_forgets_all_but_who_it_is() {
        let mut seen = Seen::default();
        seen.begin("emulated", None);
        let mark = Item::Mark { at: 20, text: "wind on".to_owned() };
        seen.take(&Item::Samples { first: 0, yaw_deg: vec![1.0; 25] });
        let line = seen.take(&mark).0.expect("a line");
        assert_eq!((line["number"].as_u64(), seen.trace.len()), (Some(1), 2));
        seen.begin("emulated", None);
        let now = seen.history(true);
        assert_eq!(
            (&now["epoch"], &now["samples"], &now["lines"]),
            (&json!(2), &json!(0), &json!([]))
        );
    }
}
