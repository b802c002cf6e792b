//! What is judged, and beside which model.

use crate::releases::warn_of_more;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_core::diagnosis::diagnose::Options;
use yawrig_core::record::Record;
use yawrig_model::document::{Model, RecordEntry};
use yawrig_model::edits;
use yawrig_model::limits::structure;
use yawrig_model::records;
use yawrig_records::Selection;

/// What is judged, and beside which model.
pub(super) enum Case {
    Records(Vec<Record>, Options),
    Campaign(PathBuf, Options),
}

pub(super) fn one(file: &Path, reading: &Selection, options: Options) -> Result<Case> {
    warn_of_more(file, reading);
    Ok(Case::Records(vec![yawrig_records::read_selected(file, reading)?], options))
}

/// `files`, releases of one rig.
pub(super) fn several(files: &[PathBuf], reading: &Selection, options: Options) -> Result<Case> {
    if let Some(file) = files.iter().find(|f| f.extension().is_some_and(|e| e == "toml")) {
        return Err(Error::usage(format!("{} among several records", file.display()))
            .help("give records only, or one campaign.toml alone"));
    }
    let records = files.iter().map(|file| yawrig_records::read_selected(file, reading));
    Ok(Case::Records(records.collect::<Result<_>>()?, options))
}

/// What the model at `path` lacks, in `file` or its own records.
pub(super) fn beside(
    path: &Path,
    file: Option<&Path>,
    reading: &Selection,
    options: Options,
) -> Result<Case> {
    let model = Model::read(path)?;
    edits::warn(&model, path);
    let case = lacking(&model, path, file, reading, options)?;
    for entry in &model.records {
        if let Some(changed) = records::changed(entry, &Model::record_path(path, entry)) {
            yawrig_base::warn!("{changed}");
        }
    }
    Ok(case)
}

fn lacking(
    model: &Model,
    path: &Path,
    file: Option<&Path>,
    reading: &Selection,
    options: Options,
) -> Result<Case> {
    let fitted: Vec<&RecordEntry> = model.records.iter().filter(|r| !r.held_out).collect();
    let options = Options {
        zero_unknown: options.zero_unknown || model.unknown_zero,
        present: structure(model)?,
        ..options
    };
    let wind = |e: &RecordEntry| e.made_under.as_ref().map_or(0.0, |m| m.wind_speed_m_s);
    let entry = match (file, fitted.as_slice()) {
        (Some(file), _) => records::known_or_new(model, path, file)?.read_as(reading),
        (None, [entry]) => (*entry).clone(),
        (None, all) => {
            let read = |entry: &&RecordEntry| {
                yawrig_records::read_selected(&Model::record_path(path, entry), &entry.reading)
            };
            let records = all.iter().map(read).collect::<Result<_>>()?;
            let wind_speeds_m_s = all.iter().map(|e| wind(e)).collect();
            return Ok(Case::Records(records, Options { wind_speeds_m_s, ..options }));
        }
    };
    let wind_speed_m_s = wind(&entry);
    one(&Model::record_path(path, &entry), &entry.reading, Options { wind_speed_m_s, ..options })
}
