//! Names of records as `{spring}_V{wind}_{axis}_run{n}.csv` says them.

use serde::{Deserialize, Serialize};
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::derivatives::at::{At, Value};
use yawrig_core::derivatives::plausible::ranges::speed_unit;
use yawrig_shared::axis::Axis;

/// Fields that a pattern may have, besides settings; any other name stands for anything.
const FIELDS: [&str; 3] = ["spring", "wind", "axis"];
/// What a field begins with that says a setting, as `{at.ride_height_mm}`.
const SETTING: &str = "at.";

#[derive(Clone, Debug, PartialEq)]
enum Part {
    Text(String),
    Field(String),
}

/// What a name has to look like.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    parts: Vec<Part>,
}

/// What a record's name says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Named {
    pub spring: Option<String>,
    pub axis: Option<Axis>,
    pub wind_speed_m_s: Option<f64>,
    #[serde(default)]
    pub at: At,
    /// Words that stand for an axis or a speed and are understood as none.
    pub unknown: Vec<String>,
}

impl Pattern {
    /// # Errors
    /// Exit 2 where a brace is not closed, two fields follow each other, or no field is named.
    pub fn new(text: &str) -> Result<Self> {
        let fail = |what: &str| {
            Err(Error::usage(format!("{} {text:?}: {what}", settings::name("pattern")))
                .help("write it as \"{spring}_V{wind}_{axis}_run{n}.csv\""))
        };
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(open) = rest.find('{') {
            if open > 0 {
                parts.push(Part::Text(rest[..open].to_owned()));
            }
            let Some(close) = rest[open..].find('}') else { return fail("a { is not closed") };
            if matches!(parts.last(), Some(Part::Field(_))) {
                return fail("two fields with nothing between them");
            }
            parts.push(Part::Field(rest[open + 1..open + close].to_owned()));
            rest = &rest[open + close + 1..];
        }
        if !rest.is_empty() {
            parts.push(Part::Text(rest.to_owned()));
        }
        let known = |part: &Part| matches!(part, Part::Field(f) if FIELDS.contains(&f.as_str()));
        if !parts.iter().any(known) {
            return fail("it has none of the fields {spring}, {wind} and {axis}");
        }
        let settings = parts.iter().filter_map(|part| match part {
            Part::Field(field) => field.strip_prefix(SETTING),
            Part::Text(_) => None,
        });
        let settings = At(settings.map(|name| (name.to_owned(), Value::Number(0.0))).collect());
        if let Some(name) = settings.unusable_name() {
            return fail(&format!("{name:?} cannot be a setting's name"));
        }
        Ok(Self { parts })
    }

    /// What `name` says, if it looks so.
    pub fn named(&self, name: &str) -> Option<Named> {
        let mut found = Vec::new();
        matches(&self.parts, name, &mut found).then(|| {
            let mut named = Named::default();
            for (field, value) in found {
                named.take(field, value);
            }
            if let Some((_, m_s)) = self.unit_of_wind() {
                named.wind_speed_m_s = named.wind_speed_m_s.map(|speed| speed * m_s);
            }
            named
        })
    }
}

impl Pattern {
    /// The unit that stands behind the wind speed in every name, and m/s in one of it.
    fn unit_of_wind(&self) -> Option<(&'static str, f64)> {
        self.parts.windows(2).find_map(|pair| match pair {
            [Part::Field(field), Part::Text(text)] if field == "wind" => speed_unit(text),
            _ => None,
        })
    }
}

/// Fields are as short as what follows them allows.
fn matches<'p, 'n>(parts: &'p [Part], name: &'n str, found: &mut Vec<(&'p str, &'n str)>) -> bool {
    match parts {
        [] => name.is_empty(),
        [Part::Text(text), rest @ ..] => {
            name.strip_prefix(text.as_str()).is_some_and(|name| matches(rest, name, found))
        }
        [Part::Field(field), rest @ ..] => {
            for end in (1..=name.len()).filter(|end| name.is_char_boundary(*end)) {
                found.push((field, &name[..end]));
                if matches(rest, &name[end..], found) {
                    return true;
                }
                found.pop();
            }
            false
        }
    }
}

impl Named {
    fn take(&mut self, field: &str, value: &str) {
        match field {
            "spring" => self.spring = Some(value.to_owned()),
            "axis" => match axis(value) {
                Some(axis) => self.axis = Some(axis),
                None => self.unknown.push(value.to_owned()),
            },
            "wind" => match wind_m_s(value) {
                Some(speed) => self.wind_speed_m_s = Some(speed),
                None => self.unknown.push(value.to_owned()),
            },
            _ => {
                if let Some(name) = field.strip_prefix(SETTING) {
                    self.at.0.insert(name.to_owned(), setting(value));
                }
            }
        }
    }
}

/// `40`, `-2,5` or a configuration's name.
fn setting(word: &str) -> Value {
    let number = word.replace(',', ".").parse().ok().filter(|x: &f64| x.is_finite());
    number.map_or_else(|| Value::Text(word.to_owned()), Value::Number)
}

fn axis(word: &str) -> Option<Axis> {
    match word.to_lowercase().as_str() {
        "mid" | "middle" | "m" | "centre" | "center" | "c" | "mitte" => Some(Axis::Mid),
        "front" | "f" | "fwd" | "forward" | "vorn" | "vorne" => Some(Axis::Front),
        _ => None,
    }
}

/// `10`, `10.5`, `10,5`, `10ms`, `36kmh`, `off`.
fn wind_m_s(word: &str) -> Option<f64> {
    let lower = word.to_lowercase().replace(',', ".");
    if ["off", "aus", "no", "none"].contains(&lower.as_str()) {
        return Some(0.0);
    }
    let digits = lower.trim_end_matches(|c: char| !c.is_ascii_digit());
    let (lower, m_s) = match speed_unit(&lower[digits.len()..]) {
        Some((_, m_s)) => (digits, m_s),
        None => (lower.as_str(), 1.0),
    };
    let number = lower.trim_end_matches("m/s").trim_end_matches("mps").trim_end_matches("ms");
    let speed = number.trim().parse().ok().map(|speed: f64| speed * m_s);
    speed.filter(|speed| speed.is_finite() && *speed >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(pattern: &str, name: &str) -> Option<(Option<String>, Option<Axis>, Option<f64>)> {
        let named = Pattern::new(pattern).unwrap().named(name)?;
        Some((named.spring, named.axis, named.wind_speed_m_s))
    }

    #[test]
    fn names_are_taken_apart() {
        let usual = "{spring}_V{wind}_{axis}_run{n}.csv";
        let k1 = Some("K1".to_owned());
        assert_eq!(
            said(usual, "K1_V10_mid_run3.csv"),
            Some((k1.clone(), Some(Axis::Mid), Some(10.0)))
        );
        assert_eq!(
            said(usual, "K1_V7,5_f_run12.csv"),
            Some((k1.clone(), Some(Axis::Front), Some(7.5)))
        );
        assert_eq!(said(usual, "K1_Voff_mid_run1.csv"), Some((k1, Some(Axis::Mid), Some(0.0))));
        assert_eq!(said(usual, "notes.txt"), None);
        // In km/h, by the pattern or by the name.
        for pattern in ["{spring}_{wind}kmh_{axis}.csv", "{spring}_{wind}_{axis}.csv"] {
            let speed = said(pattern, "K1_36kmh_mid.csv").unwrap().2.unwrap();
            assert!((speed - 10.0).abs() < 1e-12, "{pattern}: {speed}");
        }
        let wings = Pattern::new("{spring}_{wind}_h{at.ride_height_mm}_{at.wing}.csv").unwrap();
        let at = wings.named("K1_10_h-2,5_low.csv").unwrap().at;
        assert_eq!(at.to_string(), "ride_height_mm -2.5, wing low");
        // A field may hold what stands between fields elsewhere.
        assert_eq!(
            said("{spring}_{wind}.txt", "soft_one_0.txt").unwrap().0.as_deref(),
            Some("soft")
        );
        assert_eq!(said("{axis}/{spring}.csv", "front/K 2.csv").unwrap().0.as_deref(), Some("K 2"));
        let odd =
            Pattern::new("{spring}-{wind}-{axis}.csv").unwrap().named("A-on-left.csv").unwrap();
        assert_eq!(odd.unknown, ["on", "left"]);
    }

    #[test]
    fn a_pattern_that_cannot_be_is_refused() {
        let of_settings = ["{spring}_{at.spring}.csv", "{spring}_{at.ride,height}.csv"];
        for text in ["{spring", "{spring}{wind}.csv", "run{n}.csv", ""].iter().chain(&of_settings) {
            assert!(Pattern::new(text).is_err(), "{text}");
        }
    }
}
