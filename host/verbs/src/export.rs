//! `export`: the model as a program of another language, or as a table.

use super::choices::ExportTo;
use super::common::{print_line, SCHEMA_VERSION};
use crate::answer::Answer;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_campaign::simulated::refuse_existing;
use yawrig_model::export;

/// Write a model down for use elsewhere: as a program in Python, MATLAB (and Octave) or C, or as a table
///
/// A program holds the right-hand side of the equation of motion, what the sensor shows, every number with
/// its standard uncertainty, and the initial condition of each of the model's records; it integrates them by
/// itself and needs nothing else (Python: numpy and scipy). The table has model, measurement and residual,
/// sample by sample.
#[derive(Args, Debug, Clone)]
pub struct Export {
    /// The model's file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// What is written
    #[arg(long, value_enum)]
    pub to: ExportTo,
    /// The file to write, ending in .py, .m, .h or .csv
    #[arg(short, long, value_name = "PATH")]
    pub out: PathBuf,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
}

impl Export {
    pub fn run(&self) -> Result<()> {
        print_line(&self.answer()?.sentence)
    }

    /// What is written, and where.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self) -> Result<Answer> {
        if !self.force {
            refuse_existing(&self.out)?;
        }
        files::check_writable(&self.out)?;
        let text = export::exported(&self.model, self.to.into(), &self.out)?;
        files::write_atomically(&self.out, text.as_bytes())?;
        let object =
            json!({ "schema_version": SCHEMA_VERSION, "model": self.model, "out": self.out });
        Answer::new(&object, format!("{} is written", self.out.display()))
    }
}
