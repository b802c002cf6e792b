//! A measured law, its names, and their files.

use crate::model::document::{is_model, Model};
use crate::model::measured::{largest, measured};
use crate::model::model_fit::Data;
use crate::model::records;
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_core::law::estimate::Measured;
use yawrig_core::law::names::{names, Names};

/// Formulas that are written.
const WRITTEN: usize = 6;

/// What was found, and where.
pub struct Found {
    /// The record that was measured.
    pub file: PathBuf,
    pub measured: Measured,
    pub names: Names,
    /// The file of each name.
    pub files: Vec<Option<PathBuf>>,
}

/// Measures and names the law of records, or of a model's beside its effects; the formulas are written to `out`.
///
/// # Errors
/// Exit 3 where a file cannot be used, 6 where no law can be fitted, 130 where the user stops it.
pub fn found(paths: &[PathBuf], dissipative: bool, out: &Path) -> Result<Found> {
    let (model, at) = match paths {
        [model] if is_model(model) => (Model::read(model)?, model.clone()),
        _ => {
            // Entries are relative to a model's file, which lies here.
            let at = PathBuf::from(crate::model::document::DEFAULT);
            let records = records::entries(paths, &at)?;
            (Model { records, ..Model::default() }, at)
        }
    };
    let data = Data::of(&model, &at)?;
    interrupt::check()?;
    let measured = measured(&model, &data, dissipative)?;
    let recorded = largest(&data);
    let names = names(&recorded.decay, &measured)?;
    let mut written = Vec::new();
    for (k, name) in names.ranked.iter().enumerate() {
        let Some(text) = name.text.as_ref().filter(|_| k < WRITTEN) else {
            written.push(None);
            continue;
        };
        files::make_folder(out)?;
        let file = out.join(format!("{}.toml", name.effect.id()));
        let from = recorded.path.display();
        let held_out = name.held_out_over_noise;
        let text = format!("# from {from}, held out {held_out:.3} times the noise\n{text}");
        files::write_atomically(&file, text.as_bytes())?;
        written.push(Some(file));
    }
    Ok(Found { file: recorded.path.clone(), measured, names, files: written })
}
