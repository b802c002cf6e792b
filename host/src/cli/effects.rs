//! `add` and `remove`: an effect into the model and out of it.

use super::model::{asked, print_revision, ModelArg};
use crate::criticism::effects::Effect;
use crate::criticism::revise;
use crate::error::Result;
use clap::Args;

/// Add an effect to the model and fit it
#[derive(Args, Debug, Clone)]
pub struct Add {
    #[command(flatten)]
    pub effect: EffectArgs,
}

/// Take an effect out of the model and fit what is left
#[derive(Args, Debug, Clone)]
pub struct Remove {
    #[command(flatten)]
    pub effect: EffectArgs,
}

#[derive(Args, Debug, Clone)]
pub struct EffectArgs {
    /// An effect of the library
    #[arg(value_name = "EFFECT", value_enum)]
    pub effect: Effect,
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
        let EffectArgs { effect, why, model, json } = &self.effect;
        let revision = revise::add(&model.model, *effect, &asked(why.as_deref()))?;
        print_revision(Some(&model.model), &revision, *json)
    }
}

impl Remove {
    pub fn run(&self) -> Result<()> {
        let EffectArgs { effect, why, model, json } = &self.effect;
        let revision = revise::remove(&model.model, *effect, &asked(why.as_deref()))?;
        print_revision(Some(&model.model), &revision, *json)
    }
}
