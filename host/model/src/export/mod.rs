//! A model to take away: its right-hand side, its reading and its numbers as a program of another language,
//! or its readings beside those measured as a table.

mod code;
mod release;
mod table;

pub use code::Target;

use crate::document::{read_text, Model};
use crate::journal::Journal;
use crate::model_fit::{held_against, Data, Recorded};
use rayon::prelude::*;
use release::Release;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_core::effects::Effect;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    Code(Target),
    /// Model, measurement and residual.
    Table,
}

/// What is in the file for the model at `path`, to be called `name`.
///
/// # Errors
/// Exit 3 where the model or a record cannot be used, 2 for a name that the language does not take, and for a
/// program of what is no angle.
pub fn exported(path: &Path, what: What, name: &Path) -> Result<String> {
    let model = Model::read(path)?;
    let effects: Vec<Effect> = model.effects.iter().map(|e| e.effect.clone()).collect();
    let data = Data::new(&model, path)?;
    if let (What::Code(_), false) = (what, data.measurand().is_angle()) {
        let quantity = data.measurand().quantity();
        let why = format!(
            "{}: its records hold a {quantity}, and the programs read an angle",
            path.display()
        );
        return Err(
            Error::usage(why).help(format!("export a table: {}", settings::given("to", "csv")))
        );
    }
    let recorded: Vec<Recorded> = data.fitted.into_iter().chain(data.held_out).collect();
    let of = |recorded: Recorded| {
        let fit = held_against(&model, &recorded, 1.0)?;
        let numbers = release::numbers(&model, &recorded, &fit);
        Ok(Release { recorded, fit, numbers })
    };
    let releases: Vec<Release> = recorded.into_par_iter().map(of).collect::<Result<_>>()?;
    interrupt::check()?;
    match what {
        What::Table => table::written(&releases),
        What::Code(target) => {
            let journal = Journal::new(path)?;
            let covariance = journal.covariance_of(&read_text(path)?);
            code::written(target, path, name, &effects, &releases, covariance)
        }
    }
}
