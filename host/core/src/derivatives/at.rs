//! What a release was made under besides spring, axis and wind: angle of attack, ride height, configuration.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// Names that a release or a point of a table has already.
const TAKEN: [&str; 12] = [
    "method",
    "file",
    "spring",
    "axis",
    "wind_speed_m_s",
    "density_kg_m3",
    "reduced_frequency",
    "validation_mse_deg2",
    "assumed_zero",
    "flags",
    "doubts",
    "notes",
];

/// A setting's value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// In the unit that its name states.
    Number(f64),
    /// As the name of a configuration.
    Text(String),
}

/// Named settings: `ride_height_mm = 40.0`, `wing = "low"`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct At(pub BTreeMap<String, Value>);

impl At {
    /// Whether nothing is stated.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether a wind-off release at this is the reference of one at `other`: nothing that it states is
    /// otherwise there.
    pub fn serves(&self, other: &Self) -> bool {
        self.0.iter().all(|(name, value)| other.0.get(name) == Some(value))
    }

    /// Of wind-off releases and what each was made under, the reference of one made under this: the one that
    /// serves it and shares most of it, the first of such.
    pub fn reference<'a, T>(&self, off: impl Iterator<Item = (T, &'a Self)>) -> Option<T> {
        let serving = off.filter(|(_, at)| at.serves(self));
        let more = |best: (T, &'a Self), next: (T, &'a Self)| {
            if next.1 .0.len() > best.1 .0.len() {
                next
            } else {
                best
            }
        };
        serving.reduce(more).map(|(which, _)| which)
    }

    /// What cannot be the name of a setting: it becomes a column beside those that are there, and a key
    /// without quotes.
    pub fn unusable_name(&self) -> Option<&str> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let is_derivative = |name: &str| name.starts_with("cn_") || name.starts_with("cy_");
        let is_taken = |name: &str| TAKEN.contains(&name) || is_derivative(name);
        let is_usable = |name: &str| !name.is_empty() && name.chars().all(plain) && !is_taken(name);
        self.0.keys().map(String::as_str).find(|name| !is_usable(name))
    }

    /// The value of `name` as it is shown; empty where it is not stated.
    pub fn shown(&self, name: &str) -> String {
        self.0.get(name).map(ToString::to_string).unwrap_or_default()
    }

    /// The names in `all`, each once, in order.
    pub fn names<'a>(all: impl Iterator<Item = &'a Self>) -> Vec<String> {
        let mut names: Vec<String> = all.flat_map(|at| at.0.keys().cloned()).collect();
        names.sort();
        names.dedup();
        names
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// `ride_height_mm 40, wing low`.
impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let each: Vec<String> =
            self.0.iter().map(|(name, value)| format!("{name} {value}")).collect();
        f.write_str(&each.join(", "))
    }
}
