//! Several models against the same records.

use crate::appraisal::Appraisal;
use crate::comparison::{compare, Comparison};
use crate::document::{Model, RecordEntry};
use crate::model_fit::{held_against, Recorded};
use crate::records;
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::bic;
use yawrig_records::place::canonical;
use yawrig_records::Selection;

/// One of the models.
#[derive(Clone, Debug, Serialize)]
pub struct Side {
    pub model: PathBuf,
    /// Numbers that were fitted: natural frequencies, damping ratios, those of effects.
    pub numbers: usize,
    /// Difference of BIC in favour of this model against the first, on the independent residuals of the
    /// better one.
    pub bic_gain: f64,
    #[serde(flatten)]
    pub appraisal: Appraisal,
    #[serde(skip)]
    squares: f64,
    #[serde(skip)]
    independent: f64,
}

impl Side {
    fn bic(&self) -> bic::Score {
        let Self { squares: sum_of_squares, independent, numbers, .. } = *self;
        bic::Score { sum_of_squares, independent, numbers }
    }
}

/// Holds each of `models` against `files`, or the records that all of them are about.
///
/// # Errors
/// Exit 2 where they are about different records and none is named; as [`compare`].
pub fn side_by_side(
    models: &[PathBuf],
    files: &[PathBuf],
    reading: &Selection,
) -> Result<Vec<Side>> {
    if files.is_empty() {
        check_same_records(models)?;
    }
    let mut sides: Vec<Side> =
        models.iter().map(|m| side(m, files, reading)).collect::<Result<_>>()?;
    let Some(first) = sides.first().cloned() else { return Ok(sides) };
    for side in &mut sides {
        side.bic_gain = side.bic().gain_over(&first.bic());
    }
    Ok(sides)
}

fn check_same_records(models: &[PathBuf]) -> Result<()> {
    let of = |path: &PathBuf| {
        let model = Model::read(path)?;
        let place = |e: &RecordEntry| canonical(&Model::record_path(path, e)).ok();
        let mut places: Vec<Option<PathBuf>> = model.records.iter().map(place).collect();
        places.sort();
        Ok(places)
    };
    let all: Vec<Vec<Option<PathBuf>>> = models.iter().map(of).collect::<Result<_>>()?;
    match all.windows(2).position(|pair| pair[0] != pair[1]) {
        None => Ok(()),
        Some(k) => {
            let [a, b] = [k, k + 1].map(|k| models[k].display().to_string());
            Err(Error::usage(format!("{a} and {b} are about different records")).help(format!(
                "name the records to hold them against: {}",
                settings::command("compare", &["RECORD.csv"], &[("model", &a), ("model", &b)])
            )))
        }
    }
}

fn side(path: &Path, files: &[PathBuf], reading: &Selection) -> Result<Side> {
    let model = Model::read(path)?;
    let comparison = Comparison {
        model: Some(path.to_owned()),
        files: files.to_vec(),
        reading: reading.clone(),
        ..Comparison::default()
    };
    let appraisal = compare(&comparison)?.appraisal;
    let mut entries: Vec<RecordEntry> =
        model.records.iter().filter(|e| !e.held_out).cloned().collect();
    if !files.is_empty() {
        let known =
            |file: &PathBuf| Ok(records::known_or_new(&model, path, file)?.read_as(reading));
        entries = files.iter().map(known).collect::<Result<_>>()?;
    }
    let fitted = |entry: &RecordEntry| {
        let recorded = Recorded::read(entry.clone(), Model::record_path(path, entry))?;
        let fit = held_against(&model, &recorded, 1.0)?;
        let squares = fit.count as f64 * fit.over_noise(&recorded.decay).powi(2);
        Ok((squares, fit.effective_count()))
    };
    let fits: Vec<(f64, f64)> = entries.par_iter().map(fitted).collect::<Result<_>>()?;
    let (squares, independent) = fits.iter().fold((0.0, 0.0), |(s, n), (a, b)| (s + a, n + b));
    let modal = model.modal.values().flat_map(|m| [m.natural_frequency_rad_s, m.damping_ratio]);
    let of_effects = model.effects.iter().flat_map(|e| e.parameters.iter().copied());
    let numbers = modal.chain(of_effects).filter(|p| p.free).count();
    Ok(Side { model: path.to_owned(), numbers, bic_gain: 0.0, appraisal, squares, independent })
}
