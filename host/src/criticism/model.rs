//! `model.toml`: a second-order model with any effects, the records it is about, and what is fitted.
//!
//! The file is written by the program and may be edited by hand: an entry with `free = false` keeps its value in the
//! next fit, `min` and `max` bound it.

use super::effects::Effect;
use crate::error::{Error, Result};
use crate::own_effect::{is_file, pointed};
use crate::rig::Axis;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// The version of the file's layout.
pub const SCHEMA_VERSION: u32 = 1;

/// A model as it stands in its file. Angles in rad, moments divided by Izz.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Model {
    /// The sensor's nought is not known and is fitted, to each record its own.
    pub unknown_zero: bool,
    pub records: Vec<RecordEntry>,
    /// Natural frequency and damping under each condition that a fitted record was made under.
    pub modal: BTreeMap<String, ModalEntry>,
    /// In the order in which they were added.
    pub effects: Vec<EffectEntry>,
}

/// One record the model is about.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordEntry {
    /// Relative to the model's own file.
    pub file: String,
    /// Records of one condition share natural frequency and damping.
    pub condition: String,
    /// Not fitted: the model is tried on it.
    pub held_out: bool,
    /// As the campaign has it.
    pub made_under: Option<MadeUnder>,
    /// Line in the model's file, counted from 1.
    pub line: usize,
}

/// Spring, axis and wind of a record, from its campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct MadeUnder {
    pub spring: String,
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModalEntry {
    pub natural_frequency_rad_s: ParameterEntry,
    pub damping_ratio: ParameterEntry,
}

/// An effect with its numbers, in the order of [`Effect::parameters`].
#[derive(Clone, Debug, PartialEq)]
pub struct EffectEntry {
    pub effect: Effect,
    pub parameters: Vec<ParameterEntry>,
}

/// One number of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterEntry {
    /// None: not fitted yet.
    pub value: Option<f64>,
    /// Standard uncertainty; None: taken as known, or not to be had from the record.
    pub u: Option<f64>,
    pub min: f64,
    pub max: f64,
    /// Whether a fit varies it.
    pub free: bool,
}

impl ParameterEntry {
    /// Free within these bounds, not fitted yet.
    pub fn unfitted(min: f64, max: f64) -> Self {
        Self { value: None, u: None, min, max, free: true }
    }
}

/// Bounds of a natural frequency, rad/s.
pub const NATURAL_FREQUENCY: [f64; 2] = [0.0, f64::INFINITY];
/// Bounds of a damping ratio: a self-excited swing has a negative one.
pub const DAMPING_RATIO: [f64; 2] = [-0.5, 0.7];

impl Default for ModalEntry {
    fn default() -> Self {
        let [low, high] = NATURAL_FREQUENCY;
        let [least, most] = DAMPING_RATIO;
        Self {
            natural_frequency_rad_s: ParameterEntry::unfitted(low, high),
            damping_ratio: ParameterEntry::unfitted(least, most),
        }
    }
}

impl EffectEntry {
    /// Free within the effect's own bounds, not fitted yet.
    pub fn unfitted(effect: Effect) -> Self {
        let entry = |p: &super::effects::Parameter| ParameterEntry::unfitted(p.min, p.max);
        Self { effect, parameters: effect.parameters().iter().map(entry).collect() }
    }

    /// Its numbers, in the units and order of [`Effect::parameters`]; None where one is not fitted yet.
    pub fn values(&self) -> Option<Vec<f64>> {
        self.parameters.iter().map(|p| p.value).collect()
    }
}

impl Model {
    /// Reads and checks `path`.
    ///
    /// # Errors
    /// Exit 3, naming file and line: not there, not TOML, an entry missing, unknown or out of range, an effect that
    /// the library does not hold.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(&read_text(path)?, path)
    }

    /// The model in `text`, which was read from `path`.
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        Reader { text, path }.model()
    }

    /// Every effect with its numbers, in the units and order of [`Effect::parameters`]. Numbers that belong to one
    /// release (size and phase of a line, a drift) are nought where the model is about several.
    ///
    /// # Errors
    /// Exit 3 where one is not fitted yet.
    pub fn effect_values(&self, path: &Path) -> Result<Vec<(Effect, Vec<f64>)>> {
        let known = |entry: &EffectEntry| {
            let value = |(index, p): (usize, &ParameterEntry)| match p.value {
                None if is_own(entry.effect, index) => Some(0.0),
                value => value,
            };
            let values: Option<Vec<f64>> = entry.parameters.iter().enumerate().map(value).collect();
            let values = values.ok_or_else(|| {
                Error::data(format!("{}: {} has no values yet", path.display(), entry.effect))
                    .help(format!("run `yawrig fit --model {}`", path.display()))
            })?;
            Ok((entry.effect, values))
        };
        self.effects.iter().map(known).collect()
    }

    pub fn effect(&self, effect: Effect) -> Option<&EffectEntry> {
        self.effects.iter().find(|e| e.effect == effect)
    }

    /// Where the record `entry` is, the model's file being `path`.
    pub fn record_path(path: &Path, entry: &RecordEntry) -> PathBuf {
        path.parent().unwrap_or(Path::new("")).join(&entry.file)
    }
}

/// Whether parameter `index` of [`Effect::parameters`] belongs to one release: it has as many values as there are
/// releases.
pub fn is_own(effect: Effect, index: usize) -> bool {
    effect.varied_place(index).is_none_or(|number| effect.belongs_to_release(number))
}

/// The text of the model's file.
///
/// # Errors
/// Exit 3 where it cannot be read.
pub fn read_text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|e| {
        Error::data(format!("cannot read {}: {e}", path.display()))
            .help("name the model with --model, or make one: yawrig fit RECORD.csv")
    })
}

#[derive(Deserialize)]
struct Version {
    schema_version: Spanned<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawModel {
    #[serde(rename = "schema_version")]
    _schema_version: u32,
    #[serde(default)]
    unknown_zero: bool,
    #[serde(default)]
    record: Vec<Spanned<RawRecord>>,
    #[serde(default)]
    modal: BTreeMap<Spanned<String>, RawModal>,
    #[serde(default)]
    effect: Vec<RawEffect>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRecord {
    file: String,
    condition: Option<String>,
    #[serde(default)]
    held_out: bool,
    spring: Option<String>,
    axis: Option<Axis>,
    wind_speed_m_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawModal {
    natural_frequency_rad_s: Option<Spanned<RawParameter>>,
    damping_ratio: Option<Spanned<RawParameter>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEffect {
    id: Spanned<String>,
    definition: Option<Spanned<String>>,
    #[serde(default)]
    parameters: BTreeMap<Spanned<String>, Spanned<RawParameter>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawParameter {
    value: Option<f64>,
    u: Option<f64>,
    unit: Option<String>,
    min: Option<f64>,
    max: Option<f64>,
    free: Option<bool>,
}

/// What an entry of a number must keep to.
struct Law<'a> {
    name: String,
    unit: &'a str,
    min: f64,
    max: f64,
}

struct Reader<'a> {
    text: &'a str,
    path: &'a Path,
}

impl Reader<'_> {
    fn line(&self, span: &Range<usize>) -> usize {
        let end = span.start.min(self.text.len());
        self.text.as_bytes()[..end].iter().filter(|byte| **byte == b'\n').count() + 1
    }

    fn error(&self, span: &Range<usize>, what: impl std::fmt::Display) -> Error {
        Error::data(pointed(self.path, self.text, span.clone(), &what.to_string()))
    }

    fn name(&self) -> std::path::Display<'_> {
        Path::new(self.path.file_name().unwrap_or_default()).display()
    }

    fn malformed(&self, e: &toml::de::Error) -> Error {
        self.error(&e.span().unwrap_or(0..0), e.message().trim_end())
            .help("correct the entry; `yawrig history --return N` goes back to any step")
    }

    fn model(&self) -> Result<Model> {
        let version: Version = toml::from_str(self.text).map_err(|e| self.malformed(&e))?;
        if *version.schema_version.get_ref() != SCHEMA_VERSION {
            let what = format!("schema_version is {}", version.schema_version.get_ref());
            return Err(self
                .error(&version.schema_version.span(), what)
                .help(format!("this program reads schema_version {SCHEMA_VERSION}")));
        }
        let raw: RawModel = toml::from_str(self.text).map_err(|e| self.malformed(&e))?;
        let mut records: Vec<RecordEntry> = Vec::new();
        for entry in &raw.record {
            let record = self.record(entry)?;
            if let Some(other) = records.iter().find(|r| r.file == record.file) {
                let what = format!("{} is listed already, on line {}", other.file, other.line);
                return Err(self.error(&entry.span(), what).help("list each record once"));
            }
            records.push(record);
        }
        let mut modal = BTreeMap::new();
        for (condition, entry) in &raw.modal {
            if !records.iter().any(|r| r.condition == *condition.get_ref()) {
                let what = format!("no record has the condition \"{}\"", condition.get_ref());
                let help = "conditions are named by [[record]]; correct or delete the table";
                return Err(self.error(&condition.span(), what).help(help));
            }
            modal.insert(condition.get_ref().clone(), self.modal(entry)?);
        }
        let mut effects: Vec<EffectEntry> = Vec::new();
        for entry in &raw.effect {
            let id = entry.id.get_ref();
            if effects.iter().any(|e| e.effect.id() == id) {
                let what = format!("{id} is in the model twice");
                return Err(self.error(&entry.id.span(), what).help("delete one [[effect]]"));
            }
            let effect = self.effect(entry)?;
            if raw.unknown_zero && effect.effect == Effect::StaticOffset {
                let what =
                    "static_offset beside unknown_zero: a constant moment cannot be told from it";
                return Err(self.error(&entry.id.span(), what).help("delete one of the two"));
            }
            effects.push(effect);
        }
        Ok(Model { unknown_zero: raw.unknown_zero, records, modal, effects })
    }

    fn record(&self, entry: &Spanned<RawRecord>) -> Result<RecordEntry> {
        let raw = entry.get_ref();
        let made_under = match (&raw.spring, raw.axis, raw.wind_speed_m_s) {
            (None, None, None) => None,
            (Some(spring), Some(axis), Some(wind_speed_m_s))
                if wind_speed_m_s.is_finite() && wind_speed_m_s >= 0.0 =>
            {
                Some(MadeUnder { spring: spring.clone(), axis, wind_speed_m_s })
            }
            _ => {
                return Err(self
                    .error(
                        &entry.span(),
                        "spring, axis and wind_speed_m_s (0 or more) belong together",
                    )
                    .help("give all three, or none"))
            }
        };
        let condition = match (&raw.condition, &made_under) {
            (Some(condition), _) => condition.clone(),
            (None, Some(made)) => made.condition(),
            (None, None) => of_file(&raw.file),
        };
        Ok(RecordEntry {
            file: raw.file.clone(),
            condition,
            held_out: raw.held_out,
            made_under,
            line: self.line(&entry.span()),
        })
    }

    fn modal(&self, raw: &RawModal) -> Result<ModalEntry> {
        let law =
            |name: &str, unit, [min, max]: [f64; 2]| Law { name: name.into(), unit, min, max };
        let wn = law("natural_frequency_rad_s", "rad/s", NATURAL_FREQUENCY);
        let zeta = law("damping_ratio", "1", DAMPING_RATIO);
        let mut entry = ModalEntry::default();
        if let Some(raw) = &raw.natural_frequency_rad_s {
            entry.natural_frequency_rad_s = self.parameter(raw, &wn)?;
        }
        if let Some(raw) = &raw.damping_ratio {
            entry.damping_ratio = self.parameter(raw, &zeta)?;
        }
        Ok(entry)
    }

    fn effect(&self, raw: &RawEffect) -> Result<EffectEntry> {
        let id = raw.id.get_ref();
        let effect = match &raw.definition {
            Some(definition) => {
                let file = self.path.with_file_name(format!("{id} in {}", self.name()));
                Effect::defined(&file, definition.get_ref())?
            }
            None if is_file(id) => {
                Effect::load(&self.path.parent().unwrap_or(Path::new("")).join(id))?
            }
            None => Effect::named(id).map_err(|e| {
                self.error(&raw.id.span(), e.message)
                    .help(format!("{}, with its text as definition", e.help))
            })?,
        };
        if raw.definition.is_some() && effect.id() != id {
            let what = format!("the definition is that of \"{effect}\", not of \"{id}\"");
            return Err(self.error(&raw.id.span(), what).help("give both the same id"));
        }
        if effect == Effect::Buffeting {
            return Err(self
                .error(&raw.id.span(), "buffeting is random and cannot be simulated")
                .help("delete the entry; `yawrig diagnose` judges it by a filter"));
        }
        let mut entry = EffectEntry::unfitted(effect);
        for (name, parameter) in &raw.parameters {
            let known = effect.parameters();
            let Some(at) = known.iter().position(|p| p.name == name.get_ref()) else {
                let names: Vec<&str> = known.iter().map(|p| p.name).collect();
                let what = format!("{effect} has no parameter \"{}\"", name.get_ref());
                let help = format!("its parameters: {}", names.join(", "));
                return Err(self.error(&name.span(), what).help(help));
            };
            let p = &known[at];
            let law =
                Law { name: format!("{effect}.{}", p.name), unit: p.unit, min: p.min, max: p.max };
            entry.parameters[at] = self.parameter(parameter, &law)?;
        }
        let numbers = || entry.parameters.iter().enumerate();
        let shared = || numbers().filter(|(index, _)| !is_own(effect, *index)).map(|(_, p)| p);
        if shared().any(|p| p.value.is_some()) && shared().any(|p| p.value.is_none()) {
            let what = format!("{effect} has values for some of its parameters only");
            return Err(self.error(&raw.id.span(), what).help("give all of them, or none"));
        }
        // Size and phase of a line are fitted as cosine and sine part.
        let line = || numbers().filter(|(index, _)| effect.varied_place(*index).is_none());
        let kept = |(index, p): (usize, &ParameterEntry)| {
            let known = &effect.parameters()[index];
            !p.free || (p.min, p.max) != (known.min, known.max)
        };
        if line().any(kept) && line().any(|(_, p)| p.free) {
            let names: Vec<&str> = line().map(|(i, _)| effect.parameters()[i].name).collect();
            let what = format!(
                "{effect}: {} are free within no bounds, or all fixed",
                names.join(" and ")
            );
            return Err(self
                .error(&raw.id.span(), what)
                .help("free them and delete their bounds, or fix all"));
        }
        Ok(entry)
    }

    fn parameter(&self, entry: &Spanned<RawParameter>, law: &Law) -> Result<ParameterEntry> {
        let (raw, name) = (entry.get_ref(), &law.name);
        let wrong = |what: String, help: String| Err(self.error(&entry.span(), what).help(help));
        if let Some(unit) = raw.unit.as_ref().filter(|unit| *unit != law.unit) {
            let what = format!("{name} is in {}, not in {unit}", law.unit);
            return wrong(what, format!("convert the value and write unit = \"{}\"", law.unit));
        }
        let (min, max) = (raw.min.unwrap_or(law.min), raw.max.unwrap_or(law.max));
        if !(min <= max && min >= law.min && max <= law.max) {
            let what = format!("{name}: min = {min}, max = {max}");
            return wrong(what, format!("keep {} <= min <= max <= {}", law.min, law.max));
        }
        let free = raw.free.unwrap_or(true);
        match raw.value {
            None if !free => {
                return wrong(format!("{name} is not free and has no value"), "give value".into())
            }
            Some(value) if !(value.is_finite() && min <= value && value <= max) => {
                let what = format!("{name}: value {value} is not between min {min} and max {max}");
                return wrong(what, "move the value or the bounds".into());
            }
            _ => {}
        }
        if raw.u.is_some_and(|u| !(u.is_finite() && u >= 0.0)) {
            let what = format!("{name}: u is not a standard uncertainty");
            return wrong(what, "give 0 or a positive number, or delete it".into());
        }
        Ok(ParameterEntry { value: raw.value, u: raw.u, min, max, free })
    }
}

impl MadeUnder {
    /// Its name as a condition.
    pub fn condition(&self) -> String {
        format!("{} {} {} m/s", self.spring, self.axis, self.wind_speed_m_s)
    }
}

/// The condition of a record of which nothing else is known: its own.
pub fn of_file(file: &str) -> String {
    Path::new(file).with_extension("").to_string_lossy().into_owned()
}
