//! The records of a model as its fits see them.

use crate::document::{Model, RecordEntry};
use crate::{edits, records};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::effects::Effect;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::fit::joint::{Release, Sharing};
use yawrig_core::record::{Measurand, Record};
use yawrig_records::place;

/// A record of the model as the fits see it.
#[derive(Clone, Debug)]
pub struct Recorded {
    pub entry: RecordEntry,
    pub path: PathBuf,
    pub decay: FreeDecay,
    /// What to say where it is not the record that the model was fitted to.
    pub changed: Option<String>,
}

impl Recorded {
    /// Reads the record at `path`.
    ///
    /// # Errors
    /// Exit 3 where it cannot be read or there is no free decay in it.
    pub fn read(entry: RecordEntry, path: PathBuf) -> Result<Self> {
        let record = yawrig_records::read_selected(&path, &entry.reading)?;
        Self::new(entry, &record, path)
    }

    /// What was read already, from `path`.
    ///
    /// # Errors
    /// Exit 3 where there is no free decay in it.
    pub fn new(entry: RecordEntry, record: &Record, path: PathBuf) -> Result<Self> {
        let mut decay = FreeDecay::from_record(record)?;
        decay.stop = interrupt::stop();
        let changed = records::changed(&entry, &path);
        let warnings = decay.warnings.iter().map(ToString::to_string);
        for warning in warnings.chain(changed.clone()) {
            yawrig_base::warn!("{warning}");
        }
        decay.wind_speed_m_s = entry.made_under.as_ref().map_or(0.0, |m| m.wind_speed_m_s);
        Ok(Self { entry, path, decay, changed })
    }
}

/// Whether all hold the same quantity.
///
/// # Errors
/// Exit 3 naming one that does not.
fn check_same(all: &[Recorded]) -> Result<()> {
    let Some(first) = all.first() else { return Ok(()) };
    match all.iter().find(|other| other.decay.measurand != first.decay.measurand) {
        None => Ok(()),
        Some(other) => Err(yawrig_core::error::Error::OtherMeasurand {
            record: other.path.display().to_string(),
            quantity: other.decay.measurand.quantity().to_owned(),
            unit: other.decay.measurand.unit().to_owned(),
            first: first.path.display().to_string(),
        }
        .into()),
    }
}

/// The records of a model.
#[derive(Clone, Debug)]
pub struct Data {
    pub fitted: Vec<Recorded>,
    pub held_out: Vec<Recorded>,
}

impl Data {
    /// Reads the records of `model`, whose file is `path`.
    ///
    /// # Errors
    /// Exit 3 where one cannot be read or used, or none is to be fitted.
    pub fn new(model: &Model, path: &Path) -> Result<Self> {
        let read = |entry: &RecordEntry| {
            interrupt::check()?;
            let file = Model::record_path(path, entry);
            if entry.line > 0 && !place::is_file(&file) {
                let what = format!("record {} is not there", file.display());
                return Err(Error::data(format!("{}:{}: {what}", path.display(), entry.line))
                    .help("paths are relative to the model's file; correct it"));
            }
            Recorded::read(entry.clone(), file)
        };
        edits::warn(model, path);
        let all: Vec<Recorded> = model.records.par_iter().map(read).collect::<Result<_>>()?;
        check_same(&all)?;
        let (held_out, fitted): (Vec<_>, Vec<_>) = all.into_iter().partition(|r| r.entry.held_out);
        if fitted.is_empty() {
            return Err(Error::data(format!("{}: there is no record to fit", path.display()))
                .help("a [[record]] with held_out = false is needed"));
        }
        Ok(Self { fitted, held_out })
    }

    /// Records in memory, each of a condition of its own, by its name.
    ///
    /// # Errors
    /// Exit 2 where two have one name, 3 where there is no free decay in one.
    pub fn of_records(records: Vec<Record>) -> Result<Self> {
        let mut fitted: Vec<Recorded> = Vec::new();
        for record in records {
            let entry = records::in_memory(&record);
            if fitted.iter().any(|other| other.entry.file == entry.file) {
                return Err(Error::usage(format!("{} is given twice", entry.file))
                    .help("give each record once, and a name of its own"));
            }
            fitted.push(Recorded::new(entry, &record, record.file.clone())?);
        }
        check_same(&fitted)?;
        Ok(Self { fitted, held_out: Vec::new() })
    }

    /// What the records hold.
    pub fn measurand(&self) -> &Measurand {
        &self.fitted[0].decay.measurand
    }

    /// `model` of what the records show: where that is no angle, their sensor's zero is its own.
    pub fn seen(&self, model: Model) -> Model {
        let unknown_zero = model.unknown_zero || !self.measurand().shows_rest();
        Model { unknown_zero, recorded: self.measurand().said(), ..model }
    }

    /// Whether the records can show `effect`.
    ///
    /// # Errors
    /// Exit 2 where they cannot.
    pub fn check_seen(&self, effect: &Effect) -> Result<()> {
        let measurand = self.measurand();
        if effect.is_seen_in(measurand) {
            return Ok(());
        }
        let (quantity, unit) = (measurand.quantity(), measurand.unit());
        let why = match measurand.is_of_angle() {
            true => format!("a {quantity} does not show where the motion comes to rest"),
            false => format!("it is a law of an angle, and the record is a {quantity} in {unit}"),
        };
        Err(Error::usage(format!("{effect}: {why}"))
            .help("`yawrig diagnose` names effects that the record shows"))
    }

    pub(super) fn decays(&self) -> Vec<&FreeDecay> {
        self.fitted.iter().map(|r| &r.decay).collect()
    }

    pub(super) fn releases(&self) -> Vec<Release<'_>> {
        self.fitted.iter().map(|r| Release::whole(&r.decay)).collect()
    }

    /// Records of one condition share wn and zeta; all records share the effects.
    pub(super) fn sharing(&self, effects: usize) -> Sharing {
        let conditions: Vec<&str> =
            self.fitted.iter().map(|r| r.entry.condition.as_str()).collect();
        let modal = conditions
            .iter()
            .map(|c| conditions.iter().position(|other| other == c).expect("it is one of them"))
            .collect();
        Sharing { modal, effects: vec![vec![Some(0); self.fitted.len()]; effects] }
    }
}
