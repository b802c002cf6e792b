//! The journal of a model: every step that was taken with it, one JSON object a line, never shortened.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use yawrig_base::clock;
use yawrig_base::disk;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::settings;
use yawrig_core::fit::fitting::Covariance;
use yawrig_core::quantity::Quantity;

/// The version of a line's layout.
pub const SCHEMA_VERSION: u32 = 1;

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    Fit,
    Add,
    Remove,
    /// An effect was considered and not added; the model stayed as it was.
    Reject,
    /// An earlier step's model was taken up again.
    Return,
    /// The file had been changed since the last step.
    Edit,
}

/// One line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournalStep {
    pub schema_version: u32,
    /// From 1.
    pub step: usize,
    /// RFC 3339, to the second.
    pub time_utc: String,
    /// Name and version of the program.
    pub program: String,
    /// As it was typed.
    pub command: String,
    pub action: Action,
    pub added: Option<String>,
    pub removed: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rejected: Option<String>,
    pub returned_to: Option<usize>,
    /// The user's reason.
    pub why: Option<String>,
    pub before: Option<Residuals>,
    pub after: Option<Residuals>,
    /// `effect.name`: value and standard uncertainty, in the effect's unit.
    pub parameters: BTreeMap<String, Known>,
    /// wn and zeta under each condition.
    pub modal: BTreeMap<String, KnownModal>,
    /// Of the numbers of the first record's model, where the step fitted them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// The whole text of the model's file.
    pub model: String,
}

/// How far a model is from its records.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    pub residual_rms_deg: f64,
    pub residual_over_noise: f64,
    /// Not a number, `null` in the file, where too little of a record was left to predict.
    #[serde(deserialize_with = "number_or_none")]
    pub held_out_over_noise: f64,
}

fn number_or_none<'de, D: serde::Deserializer<'de>>(
    reader: D,
) -> std::result::Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(reader)?.unwrap_or(f64::NAN))
}

/// A quantity whose uncertainty may not be known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    pub value: f64,
    pub u: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnownModal {
    pub natural_frequency_rad_s: Known,
    pub damping_ratio: Known,
}

impl From<Quantity> for Known {
    fn from(quantity: Quantity) -> Self {
        Self { value: quantity.value, u: Some(quantity.u).filter(|u| u.is_finite()) }
    }
}

impl JournalStep {
    /// A step taken now, after which the file holds `model`.
    pub fn now(action: Action, command: &str, model: String) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            step: 0,
            time_utc: humantime::format_rfc3339_seconds(clock::now()).to_string(),
            program: format!("yawrig {}", env!("CARGO_PKG_VERSION")),
            command: command.to_owned(),
            action,
            added: None,
            removed: None,
            rejected: None,
            returned_to: None,
            why: None,
            before: None,
            after: None,
            parameters: BTreeMap::new(),
            modal: BTreeMap::new(),
            covariance: None,
            model,
        }
    }

    pub(super) fn line(&self) -> Result<String> {
        let mut line = serde_json::to_string(self)
            .map_err(|e| Error::internal(format!("cannot write the journal: {e}")))?;
        // What is not a number would be written as null and never be read again.
        serde_json::from_str::<Self>(&line).map_err(|e| {
            Error::new(
                Exit::Quality,
                format!("a result of this step is not a number ({e}); nothing is changed"),
            )
            .help(format!(
                "look at the values and bounds in the model's file; `{}` goes back",
                settings::command("history", &[], &[("return", "N")])
            ))
        })?;
        line.push('\n');
        Ok(line)
    }
}

/// `model.journal.jsonl` beside `model.toml`.
pub fn path_of(model: &Path) -> PathBuf {
    model.with_extension("journal.jsonl")
}

/// A line of a journal that cannot be read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Damage {
    /// From 1.
    pub line: usize,
    pub why: String,
}

/// What a journal holds.
#[derive(Clone, Debug, Default)]
pub struct Journal {
    pub steps: Vec<JournalStep>,
    /// Lines that are passed over; the steps before and after them are there.
    pub damaged: Vec<Damage>,
    /// Bytes of whole lines: beyond them a power cut has left part of one.
    pub(super) whole: usize,
}

impl Journal {
    /// The journal of `model`; empty where there is none.
    ///
    /// # Errors
    /// Exit 3, naming the line: not readable, or not a journal of this program.
    pub fn new(model: &Path) -> Result<Self> {
        let path = path_of(model);
        match disk::read(&path) {
            Ok(bytes) => Self::parse(&bytes, &path),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(e) => Err(Error::data(format!("cannot read {}: {e}", path.display()))
                .help("see to it that you may read it")),
        }
    }

    pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
        let mut journal = Self { whole, ..Self::default() };
        for (k, line) in bytes[..whole].split_inclusive(|b| *b == b'\n').enumerate() {
            let why = match serde_json::from_slice::<JournalStep>(line) {
                Ok(step) if step.schema_version != SCHEMA_VERSION => {
                    let what = format!("schema_version is {}", step.schema_version);
                    return Err(Error::data(format!("{}:{}: {what}", path.display(), k + 1))
                        .help("update yawrig: a later version wrote this journal"));
                }
                Ok(step) if step.step <= journal.count() => {
                    format!("step {} where step {} belongs", step.step, journal.count() + 1)
                }
                Ok(step) => {
                    journal.steps.push(step);
                    continue;
                }
                Err(e) => format!("not a step of a model: {e}"),
            };
            journal.damaged.push(Damage { line: k + 1, why });
        }
        match journal.damaged.first() {
            Some(Damage { line, why }) if journal.steps.is_empty() => {
                Err(Error::data(format!("{}:{line}: {why}", path.display()))
                    .help("move the journal away: a new one begins with the model as it is"))
            }
            _ => Ok(journal),
        }
    }

    /// Says which lines cannot be read.
    pub fn warn(&self, model: &Path) {
        for Damage { line, why } in &self.damaged {
            let file = path_of(model);
            yawrig_base::warn!("{}:{line}: {why}; the other steps are read", file.display());
        }
    }

    /// The number of the last step, damaged lines counted.
    pub(super) fn count(&self) -> usize {
        let damaged = self.damaged.last().map_or(0, |d| d.line);
        self.last().map_or(0, |step| step.step).max(damaged)
    }

    pub fn last(&self) -> Option<&JournalStep> {
        self.steps.last()
    }

    /// Covariance of the numbers of a model whose file reads `text`; none where no step has fitted it so.
    pub fn covariance_of(&self, text: &str) -> Option<&Covariance> {
        let steps = self.steps.iter().rev().filter(|step| step.model == text);
        steps.filter_map(|step| step.covariance.as_ref()).next()
    }

    /// Step `number`, counted from 1.
    ///
    /// # Errors
    /// Exit 2 where there is no such step.
    pub fn step(&self, number: usize) -> Result<&JournalStep> {
        self.steps.iter().find(|step| step.step == number).ok_or_else(|| {
            if let Some(damage) = self.damaged.iter().find(|d| d.line == number) {
                return Error::data(format!("step {number} cannot be read: {}", damage.why))
                    .help("return to another step: yawrig history");
            }
            Error::usage(format!("there is no step {number}")).help(match self.count() {
                0 => "the journal is empty; make a model: yawrig fit RECORD.csv".to_owned(),
                count => format!("the steps are 1 to {count}: yawrig history"),
            })
        })
    }
}
