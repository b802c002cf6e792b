//! `add` and `remove`: an effect into the model and out of it.

use super::model::{asked, print_revision, ModelArg};
use crate::model::effects;
use crate::model::revise;
use clap::Args;
use yawrig_base::error::Result;

/// Add an effect to the model and fit it
#[derive(Args, Debug, Clone)]
pub struct Add {
    /// An effect of the library by its id, or your own from a file ending in .toml
    #[arg(value_name = "EFFECT")]
    pub effect: String,
    #[command(flatten)]
    pub step: StepArgs,
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

#[derive(Args, Debug, Clone)]
pub struct StepArgs {
    /// The reason, for the journal
    #[arg(long, value_name = "TEXT")]
    pub why: Option<String>,
    #[command(flatten)]
    pub model: ModelArg,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

impl Add {
    pub fn run(&self) -> Result<()> {
        let StepArgs { why, model, json } = &self.step;
        let effect = effects::named(&self.effect)?;
        let revision = revise::add(&model.model, effect, &asked(why.as_deref()))?;
        print_revision(Some(&model.model), &revision, *json)
    }
}

impl Remove {
    pub fn run(&self) -> Result<()> {
        let StepArgs { why, model, json } = &self.step;
        let revision = revise::remove(&model.model, &self.effect, &asked(why.as_deref()))?;
        print_revision(Some(&model.model), &revision, *json)
    }
}
