//! The law that was measured last, and what it is the law of.

use std::path::PathBuf;
use yawrig_core::law::estimate::{Curve, Measured};
use yawrig_model::document::Model;
use yawrig_model::law::{File, LawAnswer};

/// A law that is drawn.
pub struct ShownLaw {
    /// Effects beside which it was measured, and what it was measured from.
    pub about: String,
    /// The record that it was measured from.
    pub file: PathBuf,
    pub curve: Curve,
    /// With its uncertainty; none for a first law.
    pub measured: Option<Measured>,
    /// With the formulas that it may be.
    pub found: Option<LawAnswer>,
    /// Of the files that its formulas have once they are added.
    pub folder: PathBuf,
}

impl ShownLaw {
    /// Its formulas as files, which are not written yet.
    pub fn files(&self) -> Vec<File> {
        self.found.iter().flat_map(|found| found.files(&self.folder)).collect()
    }
}

/// What a law of `model` depends on.
pub fn about(model: &Model) -> String {
    let effects = model.effects.iter().map(|e| e.effect.id());
    let files = model.records.iter().filter(|r| !r.held_out).map(|r| r.file.as_str());
    effects.chain(["of"]).chain(files).collect::<Vec<_>>().join("\n")
}
