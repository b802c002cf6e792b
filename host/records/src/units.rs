//! Units of time and of angle, once for what is read, what help says and the book.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A unit by how it is typed, what it is in the first of its kind, and how else it is written.
type Unit = (&'static str, f64, &'static [&'static str]);

/// In seconds. Signs are taken as they stand (`V_S` is no time), words in any case.
const TIME: [Unit; 7] = [
    ("s", 1.0, &["sec", "secs", "second", "seconds", "sekunde", "sekunden"]),
    ("ms", 1e-3, &["msec", "millis", "millisecond", "milliseconds", "millisekunden"]),
    ("us", 1e-6, &["\u{b5}s", "\u{3bc}s", "usec", "micros", "microsecond", "microseconds"]),
    ("ns", 1e-9, &["nsec", "nanos", "nanosecond", "nanoseconds"]),
    ("min", 60.0, &["mins", "minute", "minutes", "minuten"]),
    ("h", 3600.0, &["hr", "hrs", "hour", "hours", "stunde", "stunden"]),
    ("d", 86_400.0, &["day", "days", "tag", "tage"]),
];

/// In degrees.
const ANGLE: [Unit; 8] = [
    ("deg", 1.0, &["degree", "degrees", "\u{b0}", "\u{ba}"]),
    ("rad", 180.0 / PI, &["radian", "radians"]),
    ("mrad", 0.18 / PI, &["milliradian", "milliradians"]),
    ("urad", 0.18e-3 / PI, &["\u{b5}rad", "\u{3bc}rad", "microradians"]),
    ("turns", 360.0, &["turn", "rev", "revs", "revolution", "revolutions"]),
    ("gon", 0.9, &["gons", "gradian", "gradians"]),
    ("arcmin", 1.0 / 60.0, &["arcmins", "arcminute", "arcminutes"]),
    ("arcsec", 1.0 / 3600.0, &["arcsecs", "arcsecond", "arcseconds"]),
];

fn of(table: &[Unit], unit: &str) -> Option<f64> {
    let (unit, lower) = (unit.trim(), unit.trim().to_lowercase());
    let is = |(typed, _, others): &&Unit| {
        *typed == unit || typed.len() > 3 && *typed == lower || others.contains(&lower.as_str())
    };
    table.iter().find(is).map(|(_, size, _)| *size)
}

/// Seconds in a unit of time; `None` for what is none.
pub(super) fn seconds(unit: &str) -> Option<f64> {
    of(&TIME, unit)
}

/// Degrees in a unit of angle, in any case; `None` for what is none.
pub(super) fn degrees(unit: &str) -> Option<f64> {
    of(&ANGLE, &unit.trim().to_lowercase())
}

/// The units of angle as they are typed.
pub fn angles() -> impl Iterator<Item = &'static str> {
    ANGLE.iter().map(|(typed, ..)| *typed)
}

/// What the time of a file is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum TimeUnit {
    /// The unit of this number in the table.
    Of(usize),
    /// Numbers of samples: the rate is needed, too.
    Samples,
}

impl TimeUnit {
    /// All there are.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..TIME.len()).map(Self::Of).chain([Self::Samples])
    }

    /// As it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Of(number) => TIME[number].0,
            Self::Samples => "samples",
        }
    }

    /// What it lasts; `None` of samples.
    pub(super) fn seconds(self) -> Option<f64> {
        match self {
            Self::Of(number) => Some(TIME[number].1),
            Self::Samples => None,
        }
    }
}

impl From<TimeUnit> for &'static str {
    fn from(unit: TimeUnit) -> Self {
        unit.name()
    }
}

impl TryFrom<String> for TimeUnit {
    type Error = String;

    fn try_from(typed: String) -> Result<Self, String> {
        let all: Vec<&str> = Self::all().map(Self::name).collect();
        Self::all()
            .find(|unit| unit.name() == typed)
            .ok_or_else(|| format!("{typed:?} is no unit of a time: {}", all.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_known_by_its_sign_and_by_its_words() {
        for (unit, s) in [("s", 1.0), ("MIN", 60.0), ("Minutes", 60.0), ("\u{b5}s", 1e-6)] {
            assert_eq!(seconds(unit).or(seconds(&unit.to_lowercase())), Some(s), "{unit}");
        }
        assert_eq!((seconds("S"), seconds("M"), seconds("H")), (None, None, None));
        assert_eq!(
            (degrees("Deg"), degrees("\u{b0}"), degrees("mm")),
            (Some(1.0), Some(1.0), None)
        );
    }

    #[test]
    fn the_book_has_the_same_units() {
        let book = include_str!("../../../docs/src/how-to/records.md");
        let times: Vec<&str> = TimeUnit::all().map(TimeUnit::name).collect();
        for all in [times.join(", "), angles().collect::<Vec<_>>().join(", ")] {
            assert!(book.contains(&all), "the book lacks: {all}");
        }
    }
}
