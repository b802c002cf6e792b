//! What came of a diagnosis.

use crate::commands::Words;
use crate::flags;
use std::path::PathBuf;
use yawrig_core::diagnosis::diagnose::{Diagnosed, SECOND_ORDER};
use yawrig_core::record::Record;
use yawrig_model::law::LawAnswer;
use yawrig_model::revise::quoted;
use yawrig_records::Selection;

/// What came of it.
pub(super) struct Outcome {
    /// None of a campaign, whose releases are its own.
    pub(super) records: Vec<Record>,
    pub(super) campaign: Option<PathBuf>,
    pub(super) diagnosed: Diagnosed,
    pub(super) law: Option<LawAnswer>,
    /// Whether the user has said so.
    pub(super) zero_unknown: bool,
    pub(super) model: &'static str,
    pub(super) seconds: f64,
    /// Which make the model of the answer; none of records that are in no file.
    pub(super) commands: Vec<Words>,
}

impl Outcome {
    /// What was judged.
    pub(super) fn name(&self) -> String {
        match &self.campaign {
            Some(path) => path.display().to_string(),
            None => self.records.iter().map(Record::name).collect::<Vec<_>>().join(" "),
        }
    }

    /// The command that fits the model of the verdict, where it is not that of the verdict's names alone: the
    /// effects act about the angle of rest, not about the sensor's zero.
    pub(super) fn about_rest(&self, reading: &Selection) -> Option<String> {
        let d = &self.diagnosed.diagnosis;
        let [record] = &self.records[..] else { return None };
        let is_told = d.effects.iter().any(|e| e.is_own() || e.is_random());
        if d.only().is_none()
            || !d.about_rest
            || self.zero_unknown
            || !record.measurand.shows_rest()
            || self.model != SECOND_ORDER
            || is_told
        {
            return None;
        }
        let effects = d.effects.iter().filter(|e| !e.moves_rest());
        let effects: String = effects.map(|e| format!(" --effect {e}")).collect();
        let (file, reading) = (quoted(&record.name()), flags::of(&reading.settings()));
        Some(format!("yawrig compare {file}{reading} --no-model --unknown-zero{effects}"))
    }
}
