//! `fit`: makes a model of records, or fits the one there is again.

use super::model::{asked, print_revision, JudgeArgs, ModelArg};
use super::releases::{warn_of_more, ReleaseArg};
use crate::model::revise::{self, Wanted};
use clap::Args;
use std::path::PathBuf;
use yawrig_base::error::Result;

/// Make a second-order model of records, or fit the model there is to its records again.
///
/// The model is a file that may be edited: a number with `free = false` keeps its value, `min` and `max` bound it.
#[derive(Args, Debug, Clone)]
pub struct Fit {
    /// Records (CSV: time_s,yaw_deg) or a campaign.toml; none: those of the model
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Do not fit this record, but try the model on it (repeatable)
    #[arg(long, value_name = "FILE")]
    pub hold_out: Vec<PathBuf>,
    #[command(flatten)]
    pub release: ReleaseArg,
    #[command(flatten)]
    pub model: ModelArg,
    #[command(flatten)]
    pub judge: JudgeArgs,
}

impl Fit {
    pub fn run(&self) -> Result<()> {
        let files = self.release.of(&self.files)?;
        files.iter().for_each(|file| warn_of_more(file));
        let wanted = Wanted {
            files,
            hold_out: self.hold_out.clone(),
            unknown_zero: self.judge.unknown_zero,
        };
        let path = &self.model.model;
        print_revision(Some(path), &revise::fit(path, &wanted, &asked(None))?, self.judge.json)
    }
}
