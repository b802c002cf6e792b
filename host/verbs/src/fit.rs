//! `fit`: makes a model of records, or fits the one there is again.

use super::model::{answered, asked, print_revision, JudgeArgs, ModelArg};
use super::releases::{warn_of_more, ReleaseArg};
use crate::answer::{Answer, Drawn, OfRecord};
use clap::Args;
use std::path::PathBuf;
use yawrig_base::error::{Error, Result};
use yawrig_model::revise::{self, Revision, RevisionRequest, Wanted};
use yawrig_records::place::is_standard_input;

/// Make a second-order model of records, or fit the model there is to its records again.
///
/// The model is a file that may be edited: a number with `free = false` keeps its value, `min` and `max`
/// bound it.
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
        let revision = self.revision(&asked(None))?;
        print_revision(Some(&self.model.model), &revision, self.judge.json)
    }

    /// The answer that `--json` prints; `command` is what the journal keeps.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, command: String) -> Result<Answer> {
        let asked = RevisionRequest { command, ..RevisionRequest::default() };
        let (revision, fits) = revise::fit_with_models(&self.model.model, &self.wanted()?, &asked)?;
        let fitted = fits.into_iter().map(|(recorded, model)| OfRecord::new(recorded, model));
        let answer = answered(&self.model.model, &revision)?;
        Ok(answer.drawn_from(Drawn::Fitted(fitted.collect())))
    }

    fn revision(&self, asked: &RevisionRequest) -> Result<Revision> {
        revise::fit(&self.model.model, &self.wanted()?, asked)
    }

    fn wanted(&self) -> Result<Wanted> {
        if self.files.iter().chain(&self.hold_out).any(|file| is_standard_input(file)) {
            return Err(Error::usage(
                "a model keeps the names of its records, and standard input has none",
            )
            .help("write the record to a file first"));
        }
        let files = self.release.of(&self.files)?;
        let reading = self.release.selection()?;
        files.iter().for_each(|file| warn_of_more(file, &reading));
        Ok(Wanted {
            files,
            reading,
            hold_out: self.hold_out.clone(),
            unknown_zero: self.judge.unknown_zero,
        })
    }
}
