//! What happens while a device is followed, as text and as JSON.

use crate::amplitude_trend::{trends, Trend};
use crate::follow::{event_from_json, event_json, event_text, forgotten_name, forgotten_of};
use crate::numbers::{names_from_json, Named};
use serde::{Deserialize, Serialize};
use serde_json::{json, Value};
use std::fmt;
use yawrig_shared::axis::Axis;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{Event, Forgotten, WindowResult};

/// One thing that happened. `at` and `first` are numbers of samples in the session: 1 ms each, from 0.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// The device has answered, is there again, or runs another network.
    Device { at: u64, port: String, device: Value },
    /// A stretch of the potentiometer's trace without a gap.
    Samples { first: u64, yaw_deg: Vec<f64> },
    /// Samples that never came.
    Gap { first: u64, count: u64 },
    /// What the device says; with a release's result, what of its windows changes with amplitude. `names` are
    /// those of the numbers of effects in it.
    Event { at: u64, event: Event, trends: Vec<Trend>, names: Vec<Named> },
    /// Results that the device does not keep any more.
    EventsLost { at: u64, count: u64 },
    /// The device began anew: its clock and its releases count from zero, and how long it was away
    /// is taken from this program's clock.
    Restarted { at: u64, why: String },
    /// It had forgotten its settings and the condition of its releases, and has been sent them again.
    Restored { at: u64 },
    /// It has forgotten what it had learnt of its network's error from so many releases.
    Forgotten { at: u64, releases: u16, why: Forgotten },
    /// The port is there and the device does not answer.
    Silent { at: u64 },
    /// The device was unplugged.
    Disconnected { at: u64, why: String },
    /// It is there again under another path.
    Back { at: u64, port: String, was: String },
    /// The coming releases are made under this condition.
    Condition { at: u64, next: Next },
    /// All releases of a campaign are made: its derivatives, as JSON and as text.
    Derivatives { at: u64, table: Value, text: String },
    /// A user's note.
    Mark { at: u64, text: String },
    /// Little of the disk is left: the trace of the recording ends, all else of it goes on.
    TraceEnded { at: u64, free_bytes: u64 },
    /// A release was cut into a record of its own.
    Record { at: u64, release: u32, file: String, missing_samples: u64 },
}

/// What is to be released next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Next {
    pub spring: String,
    pub axis: Axis,
    pub wind_speed_m_s: f64,
    pub density_kg_m3: f64,
    /// What else it is made under, as it is shown; mostly empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub at: String,
    /// Not known: the device gives no derivatives.
    pub inertia_kg_m2: Option<f64>,
    /// Its place in the campaign, from 1, and how many there are; one condition over and over has neither.
    pub place: Option<[usize; 2]>,
    /// Why the release before does not count.
    pub not_counted: Option<String>,
}

impl fmt::Display for Next {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(why) = &self.not_counted {
            writeln!(f, "that release does not count: {why}")?;
        }
        write!(f, "next: {} {}, ", self.spring, self.axis)?;
        match self.wind_speed_m_s {
            0.0 => write!(f, "wind off")?,
            speed_m_s => write!(f, "wind {speed_m_s} m/s")?,
        }
        if !self.at.is_empty() {
            write!(f, ", at {}", self.at)?;
        }
        if let Some([number, of]) = self.place {
            write!(f, " (release {number} of {of})")?;
        }
        match (self.wind_speed_m_s, self.inertia_kg_m2) {
            (0.0, _) => Ok(()),
            (_, Some(inertia)) => write!(f, ", Izz {inertia:.5} kg m2"),
            (_, None) => write!(f, "; without the moment of inertia there are no derivatives"),
        }
    }
}

/// Bytes as they are read.
pub fn size(bytes: f64) -> String {
    match bytes {
        ..1e9 => format!("{:.0} MB", bytes / 1e6),
        ..1e12 => format!("{:.1} GB", bytes / 1e9),
        _ => format!("{:.1} TB", bytes / 1e12),
    }
}

/// Session time of a sample, s.
pub fn time_s(number: u64) -> f64 {
    number as f64 / f64::from(SAMPLE_RATE_HZ)
}

/// Whether that can be a session's time: from its beginning to thirty years on.
pub fn is_time_s(time_s: f64) -> bool {
    (0.0..1e9).contains(&time_s)
}

impl Item {
    /// When it happened, as a number of a sample.
    pub fn at(&self) -> u64 {
        match *self {
            Self::Samples { first, .. } | Self::Gap { first, .. } => first,
            Self::Device { at, .. }
            | Self::Event { at, .. }
            | Self::EventsLost { at, .. }
            | Self::Restarted { at, .. }
            | Self::Restored { at }
            | Self::Forgotten { at, .. }
            | Self::Silent { at }
            | Self::Disconnected { at, .. }
            | Self::Back { at, .. }
            | Self::Condition { at, .. }
            | Self::Derivatives { at, .. }
            | Self::Mark { at, .. }
            | Self::TraceEnded { at, .. }
            | Self::Record { at, .. } => at,
        }
    }

    /// One JSON object: `event` names the kind, `time_s` is session time.
    pub fn to_json(&self) -> Value {
        let (name, mut object) = match self {
            Self::Device { port, device, .. } => {
                ("device", json!({"port": port, "device": device}))
            }
            Self::Samples { yaw_deg, .. } => ("samples", json!({"yaw_deg": yaw_deg})),
            Self::Gap { count, .. } => ("gap", json!({"missing_samples": count})),
            Self::Event { event, trends, names, .. } => {
                let mut object = event_json(event, names);
                if matches!(event, Event::Release(_)) {
                    object["trends"] = trends.iter().map(Trend::to_json).collect();
                }
                object["time_s"] = json!(time_s(self.at()));
                return object;
            }
            Self::EventsLost { count, .. } => ("events_lost", json!({"count": count})),
            Self::Restarted { why, .. } => ("restarted", json!({"why": why})),
            Self::Restored { .. } => ("restored", json!({})),
            Self::Forgotten { releases, why, .. } => {
                ("forgotten", json!({"releases": releases, "why": forgotten_name(*why)}))
            }
            Self::Silent { .. } => ("silent", json!({})),
            Self::Disconnected { why, .. } => ("disconnected", json!({"why": why})),
            Self::Back { port, was, .. } => ("back", json!({"port": port, "was": was})),
            Self::Condition { next, .. } => ("condition", json!(next)),
            Self::Derivatives { table, text, .. } => {
                ("derivatives", json!({"table": table, "text": text}))
            }
            Self::Mark { text, .. } => ("mark", json!({"text": text})),
            Self::TraceEnded { free_bytes, .. } => {
                ("trace_ended", json!({"free_bytes": free_bytes}))
            }
            Self::Record { release, file, missing_samples, .. } => (
                "record",
                json!({"release": release, "file": file, "missing_samples": missing_samples}),
            ),
        };
        object["schema_version"] = json!(1);
        object["event"] = json!(name);
        object["time_s"] = json!(time_s(self.at()));
        object
    }

    /// The item of such an object; none where it is no such object. Trends are for the reader to find.
    pub fn from_json(object: &Value) -> Option<Self> {
        let time_s = object["time_s"].as_f64().filter(|time_s| is_time_s(*time_s))?;
        let at = (time_s * f64::from(SAMPLE_RATE_HZ)).round() as u64;
        let text = |key: &str| object[key].as_str().map(str::to_owned);
        let number = |key: &str| object[key].as_u64();
        Some(match object["event"].as_str()? {
            "device" => Self::Device { at, port: text("port")?, device: object["device"].clone() },
            "samples" => {
                let yaw_deg = object["yaw_deg"].as_array()?.iter().map(Value::as_f64);
                Self::Samples { first: at, yaw_deg: yaw_deg.collect::<Option<_>>()? }
            }
            "gap" => Self::Gap { first: at, count: number("missing_samples")? },
            "events_lost" => Self::EventsLost { at, count: number("count")? },
            // Stored before it was told: without.
            "restarted" => Self::Restarted { at, why: text("why").unwrap_or_default() },
            "restored" => Self::Restored { at },
            "forgotten" => Self::Forgotten {
                at,
                releases: number("releases")?.try_into().ok()?,
                why: forgotten_of(object["why"].as_str()?)?,
            },
            "silent" => Self::Silent { at },
            "disconnected" => Self::Disconnected { at, why: text("why")? },
            "back" => Self::Back { at, port: text("port")?, was: text("was")? },
            "condition" => {
                Self::Condition { at, next: serde_json::from_value(object.clone()).ok()? }
            }
            "derivatives" => {
                Self::Derivatives { at, table: object["table"].clone(), text: text("text")? }
            }
            "mark" => Self::Mark { at, text: text("text")? },
            "trace_ended" => Self::TraceEnded { at, free_bytes: number("free_bytes")? },
            "record" => Self::Record {
                at,
                release: number("release")?.try_into().ok()?,
                file: text("file")?,
                missing_samples: number("missing_samples")?,
            },
            _ => Self::Event {
                at,
                event: event_from_json(object)?,
                trends: Vec::new(),
                names: names_from_json(object),
            },
        })
    }

    /// The item in a line or more; none where there is nothing to tell. `effects` are those the
    /// device's network was trained on.
    pub fn to_text(&self, effects: &str) -> Option<String> {
        let time_s = time_s(self.at());
        Some(match self {
            Self::Samples { .. } => return None,
            Self::Event { event, trends, names, .. } => {
                let lines = event_text(event, "FILE", names).into_iter();
                let lines: Vec<_> = lines.chain(trends.iter().map(|t| t.text(effects))).collect();
                return (!lines.is_empty()).then(|| lines.join("\n"));
            }
            Self::Device { port, device, .. } => {
                let network = &device["network"]["id"];
                let [firmware, network] = [&device["firmware"], network].map(Value::as_str);
                let named = |name: Option<&str>| name.unwrap_or("unknown").to_owned();
                format!("{port}: {}, network {}", named(firmware), named(network))
            }
            Self::Gap { count, .. } => {
                format!("{count} samples are missing from {time_s:.3} s on")
            }
            Self::EventsLost { count, .. } => format!("{count} results were lost on the line"),
            Self::Restarted { why, .. } => {
                let why = if why.is_empty() { String::new() } else { format!(" ({why})") };
                format!(
                    "the device has restarted{why}; how long it was away is known by this program's clock only"
                )
            }
            Self::Restored { .. } => {
                "it had forgotten its settings and its releases' condition; they were sent again"
                    .to_owned()
            }
            Self::Forgotten { releases, why, .. } => {
                let why = match why {
                    Forgotten::Rig => "another rig is mounted",
                    Forgotten::Network => "another network runs",
                    Forgotten::Contradicted => {
                        "a release showed that the rig is another than was said; see what is mounted"
                    }
                    Forgotten::Damaged => "its flash does not hold it as it was written",
                };
                let from = if *releases == 1 { "release" } else { "releases" };
                format!(
                    "the device forgot what {releases} {from} had taught it of its network's error: {why}"
                )
            }
            Self::Silent { .. } => "the device does not answer; still asking".to_owned(),
            Self::Disconnected { why, .. } => {
                format!("the device is gone ({why}); waiting for it to be plugged in again")
            }
            Self::Back { port, was, .. } => {
                format!("the device is back, now on {port}; it was on {was}")
            }
            Self::Condition { next, .. } => next.to_string(),
            Self::Derivatives { text, .. } => text.clone(),
            Self::Mark { text, .. } => format!("mark at {time_s:.3} s: {text}"),
            Self::TraceEnded { free_bytes, .. } => format!(
                "only {} are free on the disk: the trace ends at {time_s:.3} s, results and records of releases go \
                 on; make room, then end this recording and begin another",
                size(*free_bytes as f64)
            ),
            Self::Record { release, file, missing_samples: 0, .. } => {
                format!("release {release} is kept in {file}")
            }
            Self::Record { release, file, missing_samples, .. } => {
                format!("release {release} is kept in {file}; {missing_samples} of its samples are missing")
            }
        })
    }

    /// Effects of the device's network, where this item tells of it.
    pub fn effects(&self) -> Option<String> {
        let Self::Device { device, .. } = self else { return None };
        let effects = device["network"]["effects"].as_array()?.iter();
        Some(effects.filter_map(Value::as_str).collect::<Vec<_>>().join(" "))
    }
}

/// The windows of the release that is going on.
#[derive(Debug, Default)]
pub struct Windows(Vec<WindowResult>);

impl Windows {
    /// Takes an event; where it ends a release, what of its windows changes with amplitude.
    pub fn take(&mut self, event: &Event) -> Vec<Trend> {
        match event {
            Event::Window(window) => self.0.push(*window),
            Event::Release(_) => return trends(&std::mem::take(&mut self.0)),
            _ => {}
        }
        Vec::new()
    }
}
