//! A device's log, read out: what it kept of releases and starts while nobody listened.

use crate::client::{Client, LinkError};
use crate::follow::{event_json, event_text, start_json, start_text};
use crate::numbers::named;
use serde_json::{json, Value};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{Condition, Event, LogEntry, Logged, Refusal, Reply, Request, Status};

/// What a device has kept, oldest first.
#[derive(Clone, Debug)]
pub struct Log {
    pub entries: Vec<LogEntry>,
    /// Its state once all was read.
    status: Status,
}

/// Reads all of it.
///
/// # Errors
/// Exit 4 for a board without a log.
pub fn read(client: &mut Client) -> Result<Log> {
    let mut entries: Vec<LogEntry> = Vec::new();
    loop {
        interrupt::check()?;
        let from = entries.last().map_or(0, |last| last.number.saturating_add(1));
        match client.request(&Request::Log { from }) {
            Ok(Reply::Log(Some(entry))) if entry.number >= from => entries.push(entry),
            Ok(Reply::Log(None)) => return Ok(Log { entries, status: client.status()? }),
            Ok(other) => {
                return Err(Error::device(format!("asked for its log it answered {other:?}")))
            }
            Err(LinkError::Refused(Refusal::NoLog)) => {
                let board = &client.identity.board;
                return Err(Error::device(format!("the board {board} has no room for a log"))
                    .help("have a computer listen to it: yawrig monitor"));
            }
            Err(e) => return Err(client.explain(e, "its log")),
        }
    }
}

fn seconds(samples: u32) -> f64 {
    f64::from(samples) / f64::from(SAMPLE_RATE_HZ)
}

impl Log {
    /// The run that goes on.
    fn run(&self) -> Option<u32> {
        self.entries.last().map(|last| last.run)
    }

    /// How long ago it was, s; of a run that is over nobody knows.
    fn ago_s(&self, entry: &LogEntry) -> Option<f64> {
        let samples = self.status.samples;
        (Some(entry.run) == self.run()).then(|| match entry.what {
            // It may stand for several that were alike: this run's is the last.
            Logged::Start(_) => seconds(samples),
            _ => seconds(samples.wrapping_sub(entry.at_sample)),
        })
    }

    /// Entries that were before the one of this index and are not there.
    fn missing_before(&self, index: usize) -> u32 {
        let number = self.entries[index].number;
        let before = index.checked_sub(1).map_or(number - 1, |before| self.entries[before].number);
        number.wrapping_sub(before).saturating_sub(1)
    }

    /// Numbers of effects are named where the network that said them still runs.
    fn event_json(&self, event: &Event, entry: &LogEntry) -> Value {
        event_json(event, &self.names(entry))
    }

    fn names(&self, entry: &LogEntry) -> Vec<crate::numbers::Named> {
        let network = &self.status.network;
        if entry.network == network.id {
            named(network)
        } else {
            Vec::new()
        }
    }

    /// As one object.
    pub fn json(&self) -> Value {
        let entries: Vec<Value> = self
            .entries
            .iter()
            .map(|entry| {
                let (event, mut object) = match &entry.what {
                    Logged::Start(start) => ("start", start_json(start)),
                    Logged::Condition(condition) => ("condition", condition_json(condition)),
                    Logged::Release(release) => {
                        ("release", self.event_json(&Event::Release(*release), entry))
                    }
                    Logged::Refined(refined) => {
                        ("refined", self.event_json(&Event::Refined(*refined), entry))
                    }
                };
                if let Some(fields) = object.as_object_mut() {
                    // Once, of the whole object.
                    fields.remove("schema_version");
                }
                object["event"] = json!(event);
                object["number"] = json!(entry.number);
                object["run"] = json!(entry.run);
                object["at_s"] = json!(seconds(entry.at_sample));
                object["ago_s"] = json!(self.ago_s(entry));
                object["lost_samples"] = json!(entry.lost_samples);
                object["network"] = json!(format!("{:08x}", entry.network));
                object
            })
            .collect();
        let missing: u32 = (1..self.entries.len()).map(|index| self.missing_before(index)).sum();
        json!({
            "run": self.run(),
            "made_room": self.entries.first().map_or(0, |first| first.number - 1),
            "unreadable": missing,
            "entries": entries,
        })
    }

    /// A line for each, and more where a result has more to say.
    pub fn text(&self) -> String {
        let mut lines = Vec::new();
        for (index, entry) in self.entries.iter().enumerate() {
            match (index, self.missing_before(index)) {
                (_, 0) => {}
                (0, count) => lines.push(format!("the {count} before these have made room")),
                (_, count) => lines.push(format!(
                    "{count} that cannot be read: a power cut, or another version's firmware"
                )),
            }
            let when = match self.ago_s(entry) {
                Some(ago_s) => format!("{} ago", span(ago_s)),
                None => format!("{} after the start", span(seconds(entry.at_sample))),
            };
            let names = self.names(entry);
            let said = |event: &Event| event_text(event, "RECORD", &names).unwrap_or_default();
            let what = match &entry.what {
                Logged::Start(start) => format!("run {} begins: {}", entry.run, start_text(start)),
                Logged::Condition(condition) => condition_text(condition),
                Logged::Release(release) => said(&Event::Release(*release)),
                Logged::Refined(refined) => said(&Event::Refined(*refined)),
            };
            lines.push(format!("{:5}  {when}: {what}", entry.number).replace('\n', "\n     "));
        }
        if lines.is_empty() {
            lines.push("nothing has happened yet".to_owned());
        }
        lines.join("\n")
    }
}

fn condition_json(condition: &Condition) -> Value {
    let Condition { rig, wind, model, inertia_kg_m2 } = condition;
    json!({
        "rig": format!("{rig:08x}"),
        "wind_speed_m_s": wind.speed_m_s,
        "density_kg_m3": wind.density_kg_m3,
        "length_m": model.length_m,
        "frontal_area_m2": model.frontal_area_m2,
        "inertia_kg_m2": (*inertia_kg_m2 != 0.0).then_some(inertia_kg_m2),
    })
}

fn condition_text(condition: &Condition) -> String {
    match condition.wind.speed_m_s {
        0.0 => "wind off from here on".to_owned(),
        speed_m_s => format!("wind {speed_m_s} m/s from here on"),
    }
}

/// A time as somebody says it.
fn span(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.1} s"),
        s if s < 100.0 * 60.0 => format!("{:.0} min", s / 60.0),
        s if s < 48.0 * 3600.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}
