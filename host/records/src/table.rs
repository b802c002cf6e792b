//! Channels of a file of any format, and how they are chosen from.

use super::place::Times;
use super::quantity::Quantity;
use super::units::TimeUnit;
use serde::{Deserialize, Serialize};
use yawrig_core::record::Called;

/// Fewer samples than this hold no three cycles at any rate: the fastest mode (4.2 Hz) at 20 Hz has 14.
pub(super) const MIN_SAMPLES: usize = 10;

/// Longest record, s.
pub(super) const LONGEST_S: f64 = 86_400.0;

/// Which channels are meant, where their names do not say so.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// Channel of the time, by its name or its number from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// Channel of the yaw angle, or of what else was recorded of the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaw: Option<String>,
    /// What this channel holds, where its unit does not say it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantity: Option<Quantity>,
    /// Of its numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// What the motion is called.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<Called>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_unit: Option<TimeUnit>,
    /// Samples a second, where there is no time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Read from this time of the record's own clock on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// Read up to this time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
}

impl Selection {
    pub(super) fn times(&self) -> Times {
        Times { from_s: self.from_s, to_s: self.to_s }
    }

    /// Names and values of what is said of a whole record.
    pub fn settings(&self) -> Vec<(&'static str, String)> {
        let Self { time, yaw, quantity, unit, motion, time_unit, rate_hz, .. } = self;
        let all = [
            ("quantity", quantity.map(|q| q.name().to_owned())),
            ("unit", unit.clone()),
            ("motion", motion.map(|motion| motion.name().to_owned())),
            ("yaw", yaw.clone()),
            ("time", time.clone()),
            ("time_unit", time_unit.map(|unit| unit.name().to_owned())),
            ("rate_hz", rate_hz.map(|hz| hz.to_string())),
        ];
        all.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }

    /// Whether nothing is said.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The same, and of what is not said here what `kept` says. Times are not chosen so.
    pub(super) fn over(&self, kept: &Self) -> Self {
        let text = |own: &Option<String>, kept: &Option<String>| own.clone().or(kept.clone());
        // What was said of one channel is not said of another.
        let same = self.yaw.is_none() || self.yaw == kept.yaw;
        let of_channel = if same { kept } else { &Self::default() };
        Self {
            time: text(&self.time, &kept.time),
            yaw: text(&self.yaw, &kept.yaw),
            quantity: self.quantity.or(of_channel.quantity),
            unit: text(&self.unit, &of_channel.unit),
            motion: self.motion.or(kept.motion),
            time_unit: self.time_unit.or(kept.time_unit),
            rate_hz: self.rate_hz.or(kept.rate_hz),
            from_s: self.from_s,
            to_s: self.to_s,
        }
    }
}

/// One channel of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// With its group: `run/yaw_deg`.
    pub name: String,
    pub unit: Option<String>,
    /// Seconds between samples, where the channel says so itself.
    pub step_s: Option<f64>,
    /// Its numbers, or why it cannot be read.
    pub values: std::result::Result<Vec<f64>, String>,
}

impl Channel {
    /// Name without group; a stroke in a unit parts none.
    pub(super) fn own_name(&self) -> &str {
        let end = self.name.find(['(', '[']).unwrap_or(self.name.len());
        match self.name[..end].rfind('/') {
            Some(stroke) => &self.name[stroke + 1..],
            None => &self.name,
        }
    }

    /// `run/yaw_deg (4000 numbers, V)`.
    pub(super) fn described(&self) -> String {
        let unit = self.unit.as_ref().map_or(String::new(), |unit| format!(", {unit}"));
        match &self.values {
            Ok(values) => {
                let count = values.iter().filter(|value| value.is_finite()).count();
                format!("{} ({count} numbers{unit})", self.name)
            }
            Err(why) => format!("{} ({why})", self.name),
        }
    }
}
