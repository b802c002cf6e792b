//! `history`: the steps taken with a model, and the return to any of them.

use super::common::{print_json, print_line, with_words, SCHEMA_VERSION};
use super::csv;
use super::model::{asked, ModelArg};
use crate::answer::Answer;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_model::document::read_text;
use yawrig_model::journal::{path_of, Action, Damage, Journal, JournalStep};
use yawrig_model::revise::RevisionRequest;
use yawrig_model::unfitted;

/// List the steps of the model's journal, or return to one.
///
/// A return is a step of its own, so that nothing is ever lost.
#[derive(Args, Debug, Clone)]
pub struct History {
    /// Return to the model of step N
    #[arg(long = "return", value_name = "N")]
    pub to: Option<usize>,
    /// The reason for the return, for the journal
    #[arg(long, value_name = "TEXT", requires = "to")]
    pub why: Option<String>,
    #[command(flatten)]
    pub model: ModelArg,
    /// Print CSV, a row for each step, units in the header
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
    /// Print one JSON object
    #[arg(short, long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Object<'a> {
    schema_version: u32,
    model: &'a Path,
    journal: PathBuf,
    /// Whether the file differs from what the last step wrote.
    edited: bool,
    steps: &'a [JournalStep],
    /// Lines of the journal that cannot be read.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    damaged: &'a [Damage],
}

/// The steps, and whether the model's file differs from what the last one wrote.
struct Listed {
    journal: Journal,
    edited: bool,
}

impl History {
    pub fn run(&self) -> Result<()> {
        let path = &self.model.model;
        let Listed { journal, edited } = self.listed(&asked(self.why.as_deref()))?;
        if self.json {
            return print_json(&self.object(&journal, edited));
        }
        if self.csv {
            return csv::history(&journal.steps);
        }
        print_line(&text(&journal.steps))?;
        if edited {
            let last = journal.last().map_or(0, |step| step.step);
            yawrig_base::say!(
                "{} is not as step {last} left it: the next step keeps the edit in the journal first",
                path.display(),
            );
        }
        Ok(())
    }

    /// The answer that `--json` prints; `command` is what the journal keeps of a return.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, command: String) -> Result<Answer> {
        let asked = RevisionRequest { command, why: self.why.clone(), keep: false };
        let Listed { journal, edited } = self.listed(&asked)?;
        let steps = journal.steps.len();
        let sentence = format!("{}: {steps} steps", self.model.model.display());
        Answer::new(&self.object(&journal, edited), sentence)
    }

    fn listed(&self, asked: &RevisionRequest) -> Result<Listed> {
        let path = &self.model.model;
        if let Some(number) = self.to {
            let step = unfitted::return_to(path, number, asked)?;
            yawrig_base::say!("{}: step {} returns to step {number}", path.display(), step.step);
        }
        let journal = Journal::new(path)?;
        let Some(last) = journal.last() else {
            return Err(Error::data(format!("{} has no journal", path.display()))
                .help("name the model with --model, or make one: yawrig fit RECORD.csv"));
        };
        if self.to.is_none() {
            journal.warn(path);
        }
        let edited = !path.exists() || read_text(path)? != last.model;
        Ok(Listed { journal, edited })
    }

    fn object<'a>(&'a self, journal: &'a Journal, edited: bool) -> Object<'a> {
        let model = &self.model.model;
        let Journal { steps, damaged, .. } = journal;
        Object {
            schema_version: SCHEMA_VERSION,
            model,
            journal: path_of(model),
            edited,
            steps,
            damaged,
        }
    }
}

fn text(steps: &[JournalStep]) -> String {
    let header = ["step", "time (UTC)", "what", "over noise", "held out over noise", "why"];
    let mut rows = with_words(&header, &[1, 2, 5]);
    for step in steps {
        let after = |digits: fn(&yawrig_model::journal::Residuals) -> f64| {
            step.after.map_or("-".to_owned(), |r| format!("{:.3}", digits(&r)))
        };
        rows.add_row([
            step.step.to_string(),
            step.time_utc.clone(),
            what(step),
            after(|r| r.residual_over_noise),
            after(|r| r.held_out_over_noise),
            step.why.clone().unwrap_or_default(),
        ]);
    }
    rows.trim_fmt()
}

fn what(step: &JournalStep) -> String {
    let named = |id: &Option<String>| id.clone().unwrap_or_default();
    match step.action {
        Action::Fit => "fit".to_owned(),
        Action::Add => format!("add {}", named(&step.added)),
        Action::Remove => format!("remove {}", named(&step.removed)),
        Action::Reject => format!("reject {}", named(&step.rejected)),
        Action::Return => format!("return to {}", step.returned_to.unwrap_or_default()),
        Action::Edit => "edit by hand".to_owned(),
    }
}
