//! `add`, `remove` and `reject`: an effect into the model, out of it, or not to be taken into it.

use super::common::{print_line, SCHEMA_VERSION};
use super::model::{answered, asked, print_revision, ModelArg};
use crate::answer::Answer;
use clap::Args;
use serde_json::json;
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::{SourceKind, MEASURED_LAW};
use yawrig_model::revise::{Revision, RevisionRequest};
use yawrig_model::{effects, measured, revise, unfitted};

/// Add an effect to the model and fit it
#[derive(Args, Debug, Clone)]
pub struct Add {
    /// An effect of the library by its id, your own from a file ending in .toml, or measured_law: the law
    /// itself, estimated from the model's records
    #[arg(value_name = "EFFECT")]
    pub effect: String,
    /// measured_law: its damping may put energy in
    #[arg(long)]
    pub may_drive: bool,
    #[command(flatten)]
    pub source: SourceArgs,
    /// Keep it though with it what was held out is predicted worse
    #[arg(long)]
    pub keep: bool,
    #[command(flatten)]
    pub step: StepArgs,
}

/// Where the effect's strength comes from, in a model of a campaign
#[derive(Args, Debug, Clone)]
#[group(multiple = false)]
pub struct SourceArgs {
    /// From the rig: one coefficient whatever the wind [default: what predicts best]
    #[arg(long)]
    pub mechanical: bool,
    /// From the air: none with the wind off, and a power of the wind speed by the coefficient's dimension
    #[arg(long)]
    pub aerodynamic: bool,
    /// A coefficient of its own at each wind speed of the model's records
    #[arg(long)]
    pub each_wind: bool,
}

impl SourceArgs {
    fn asked(&self) -> Option<SourceKind> {
        let all = [
            (self.mechanical, SourceKind::Mechanical),
            (self.aerodynamic, SourceKind::Aerodynamic),
            (self.each_wind, SourceKind::EachWind),
        ];
        all.into_iter().find_map(|(is_asked, source)| is_asked.then_some(source))
    }
}

/// Take an effect out of the model and fit what is left
#[derive(Args, Debug, Clone)]
pub struct Remove {
    /// The effect's id
    #[arg(value_name = "EFFECT")]
    pub effect: String,
    #[command(flatten)]
    pub step: StepArgs,
}

/// Write down, with the reason, that an effect is not to be added; the model stays as it is
///
/// The journal has it as a step: `history` lists it, and the workbench strikes the candidate through.
#[derive(Args, Debug, Clone)]
pub struct Reject {
    /// An effect of the library by its id, or your own from a file ending in .toml
    #[arg(value_name = "EFFECT")]
    pub effect: String,
    /// The reason, for the journal
    #[arg(long, value_name = "TEXT")]
    pub why: String,
    #[command(flatten)]
    pub model: ModelArg,
    /// Print one JSON object
    #[arg(short, long)]
    pub json: bool,
}

#[derive(Args, Debug, Clone)]
pub struct StepArgs {
    /// The reason, for the journal
    #[arg(long, value_name = "TEXT")]
    pub why: Option<String>,
    #[command(flatten)]
    pub model: ModelArg,
    /// Print one JSON object
    #[arg(short, long)]
    pub json: bool,
}

impl StepArgs {
    fn print(&self, revision: impl FnOnce(&RevisionRequest) -> Result<Revision>) -> Result<()> {
        let revision = revision(&asked(self.why.as_deref()))?;
        print_revision(Some(&self.model.model), &revision, self.json)
    }

    fn answer(
        &self,
        command: String,
        revision: impl FnOnce(&RevisionRequest) -> Result<Revision>,
    ) -> Result<Answer> {
        let asked = RevisionRequest { command, why: self.why.clone(), keep: false };
        answered(&self.model.model, &revision(&asked)?)
    }
}

impl Add {
    pub fn run(&self) -> Result<()> {
        self.step.print(|asked| self.revision(asked))
    }

    /// The answer that `--json` prints; `command` is what the journal keeps.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, command: String) -> Result<Answer> {
        self.step.answer(command, |asked| self.revision(asked))
    }

    fn revision(&self, asked: &RevisionRequest) -> Result<Revision> {
        let asked = RevisionRequest { keep: self.keep, ..asked.clone() };
        let model = &self.step.model.model;
        let source = self.source.asked();
        if self.effect == MEASURED_LAW {
            if source.is_some_and(|source| source != SourceKind::Mechanical) {
                return Err(Error::usage("measured_law with a source")
                    .help("leave it out: a law is measured as one of the rig"));
            }
            measured::add(model, !self.may_drive, &asked)
        } else {
            revise::add_from(model, effects::named(&self.effect)?, source, &asked)
        }
    }
}

impl Remove {
    pub fn run(&self) -> Result<()> {
        self.step.print(|asked| self.revision(asked))
    }

    /// As [`Add::answer`].
    pub fn answer(&self, command: String) -> Result<Answer> {
        self.step.answer(command, |asked| self.revision(asked))
    }

    fn revision(&self, asked: &RevisionRequest) -> Result<Revision> {
        revise::remove(&self.step.model.model, &self.effect, asked)
    }
}

impl Reject {
    pub fn run(&self) -> Result<()> {
        let answer = self.answer(asked(None).command)?;
        print_line(if self.json { &answer.json } else { &answer.sentence })
    }

    /// As [`Add::answer`].
    pub fn answer(&self, command: String) -> Result<Answer> {
        let (path, why) = (&self.model.model, self.why.trim());
        if why.is_empty() {
            return Err(Error::usage("--why is empty")
                .help("give the reason: a rejection without one helps nobody"));
        }
        let effect = effects::named(&self.effect)?;
        let asked = RevisionRequest { command, why: Some(why.to_owned()), keep: false };
        let step = unfitted::reject(path, effect.clone(), &asked)?.step;
        let sentence = format!("{}, step {step}: {effect} is rejected: {why}", path.display());
        let object = json!({
            "schema_version": SCHEMA_VERSION, "model": path, "step": step, "rejected": effect, "why": why,
        });
        Answer::new(&object, sentence)
    }
}
