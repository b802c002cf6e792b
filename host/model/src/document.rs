//! `model.toml`: a second-order model with any effects, the records it is about, and what is fitted.
//!
//! The file is written by the program and may be edited by hand: an entry with `free = false` keeps its value
//! in the next fit, `min` and `max` bound it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::effects::Effect;
use yawrig_core::record::Said;
use yawrig_records::format::{is_named_so, is_record};
use yawrig_records::place::is_standard_input;
use yawrig_records::Selection;
use yawrig_shared::axis::Axis;

/// The model that is worked on where none is named.
pub const DEFAULT: &str = "model.toml";
/// The version of the file's layout.
pub const SCHEMA_VERSION: u32 = 1;

/// A model as it stands in its file. Angles in rad, moments divided by Izz.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Model {
    /// The sensor's zero is not known and is fitted, to each record its own.
    pub unknown_zero: bool,
    /// What its records hold, where that is no angle in deg.
    pub recorded: Said,
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
    /// How it is read, as far as its file does not say it.
    pub reading: Selection,
    /// Not fitted: the model is tried on it.
    pub held_out: bool,
    /// As the campaign has it.
    pub made_under: Option<MadeUnder>,
    /// Of the bytes of the file that the model was fitted to.
    pub crc32: Option<String>,
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
    /// Standard uncertainty; None: taken as known, or not to be obtained from the record; not a number where
    /// the value was edited since it was fitted, and u is another value's.
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

/// Bounds of a natural frequency, rad/s: three cycles in the longest record, a day, and two samples a cycle
/// at the highest rate, 10 kHz. Zero and infinity, which earlier files state, are no motion.
pub const NATURAL_FREQUENCY: [f64; 2] = [2e-4, 31_416.0];
/// Bounds of a damping ratio: a self-excited oscillation has a negative one.
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
        let entry = |p: &yawrig_core::effects::Parameter| ParameterEntry::unfitted(p.min, p.max);
        Self { effect: effect.clone(), parameters: effect.parameters().iter().map(entry).collect() }
    }

    /// Its numbers, in the units and order of [`Effect::parameters`]; None where one is not fitted yet.
    pub fn values(&self) -> Option<Vec<f64>> {
        self.parameters.iter().map(|p| p.value).collect()
    }
}

impl Model {
    /// Every effect with its numbers, in the units and order of [`Effect::parameters`]. Numbers that belong
    /// to one release (size and phase of a line, a drift) are zero where the model is about several.
    ///
    /// # Errors
    /// Exit 3 where one is not fitted yet.
    pub fn effect_values(&self, path: &Path) -> Result<Vec<(Effect, Vec<f64>)>> {
        let known = |entry: &EffectEntry| {
            let value = |(index, p): (usize, &ParameterEntry)| match p.value {
                None if is_own(&entry.effect, index) => Some(0.0),
                value => value,
            };
            let values: Option<Vec<f64>> = entry.parameters.iter().enumerate().map(value).collect();
            let values = values.ok_or_else(|| {
                Error::data(format!("{}: {} has no values yet", path.display(), entry.effect)).help(
                    format!(
                        "run `{}`",
                        settings::command("fit", &[], &[("model", &path.display().to_string())])
                    ),
                )
            })?;
            Ok((entry.effect.clone(), values))
        };
        self.effects.iter().map(known).collect()
    }

    pub fn effect(&self, effect: Effect) -> Option<&EffectEntry> {
        self.effects.iter().find(|e| e.effect == effect)
    }

    /// The constant moment, which nothing but a sensor that was not zeroed looks like.
    pub fn rest(&self) -> Option<&EffectEntry> {
        self.effects.iter().find(|e| e.effect.moves_rest())
    }

    /// Where the record `entry` is, the model's file being `path`.
    pub fn record_path(path: &Path, entry: &RecordEntry) -> PathBuf {
        let file = Path::new(&entry.file);
        match is_standard_input(file) {
            true => file.to_owned(),
            false => path.parent().unwrap_or(Path::new("")).join(file),
        }
    }
}

/// Whether parameter `index` of [`Effect::parameters`] belongs to one release: it has as many values as there
/// are releases.
pub fn is_own(effect: &Effect, index: usize) -> bool {
    effect.varied_place(index).is_none_or(|number| effect.belongs_to_release(number))
}

/// Whether a file is a model's rather than a campaign's or a record: users may name any.
pub fn is_model(file: &Path) -> bool {
    // A pipe is read by whoever takes it for a record.
    if is_named_so(file) || !disk::is_file(file) {
        return false;
    }
    let text = disk::read_to_string(file).unwrap_or_default();
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("record"))
}

/// What to do where there is no model.
pub(crate) fn how_to_name() -> String {
    let make = settings::command("fit", &["RECORD.csv"], &[]);
    format!("name the model with {}, or make one: {make}", settings::name("model"))
}

/// The text of the model's file.
///
/// # Errors
/// Exit 3 where it cannot be read.
pub fn read_text(path: &Path) -> Result<String> {
    let named = path.display();
    let text = disk::read_to_string(path)
        .map_err(|e| Error::data(format!("cannot read {named}: {e}")).help(how_to_name()))?;
    match is_record(&text) {
        true => Err(Error::data(format!("{named} is a record, not a model")).help(format!(
            "make a model of it: {}",
            settings::command("fit", &[&named.to_string()], &[("model", "model.toml")])
        ))),
        false => Ok(text),
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
