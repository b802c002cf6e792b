//! Which records a model is about: files and campaigns to entries of the model's file.

use super::model::{of_file, MadeUnder, Model, RecordEntry};
use crate::derivatives::campaign::CampaignFile;
use crate::error::{Error, Result};
use std::path::{Component, Path, PathBuf};

/// Entries for `files`, records or campaigns, of a model whose file is `model`.
///
/// # Errors
/// Exit 3 where one is not there, 2 where one is given twice; those of [`CampaignFile::read`].
pub fn entries(files: &[PathBuf], model: &Path) -> Result<Vec<RecordEntry>> {
    let mut all: Vec<RecordEntry> = Vec::new();
    for file in files {
        let entries = if file.extension().is_some_and(|e| e == "toml") {
            of_campaign(file, model)?
        } else {
            vec![entry(file, None, model)?]
        };
        for entry in entries {
            if all.iter().any(|other| other.file == entry.file) {
                return Err(Error::usage(format!("{} is given twice", entry.file))
                    .help("give each record once"));
            }
            all.push(entry);
        }
    }
    Ok(all)
}

fn of_campaign(file: &Path, model: &Path) -> Result<Vec<RecordEntry>> {
    let campaign = CampaignFile::read(file)?;
    let made = |(index, release): (usize, &crate::derivatives::campaign::ReleaseEntry)| {
        let made = MadeUnder {
            spring: release.spring.clone(),
            axis: release.axis,
            wind_speed_m_s: release.wind_speed_m_s,
        };
        entry(&campaign.record_path(index), Some(made), model)
    };
    campaign.campaign.release.iter().enumerate().map(made).collect()
}

fn entry(file: &Path, made_under: Option<MadeUnder>, model: &Path) -> Result<RecordEntry> {
    let file = relative(&real(file)?, &folder(model)?);
    let condition = made_under.as_ref().map_or_else(|| of_file(&file), MadeUnder::condition);
    Ok(RecordEntry { file, condition, held_out: false, made_under, line: 0 })
}

/// The entry of `model` (its file being `path`) for `file`, else a new one.
///
/// # Errors
/// Exit 3 where `file` is not there.
pub fn known_or_new(model: &Model, path: &Path, file: &Path) -> Result<RecordEntry> {
    let new = entry(file, None, path)?;
    Ok(find(model, path, &new).map_or(new, |k| model.records[k].clone()))
}

/// Which of the model's records is `entry`'s.
pub fn find(model: &Model, path: &Path, entry: &RecordEntry) -> Option<usize> {
    let place = |entry: &RecordEntry| Model::record_path(path, entry).canonicalize().ok();
    let wanted = place(entry)?;
    model.records.iter().position(|other| place(other).as_ref() == Some(&wanted))
}

fn real(file: &Path) -> Result<PathBuf> {
    file.canonicalize().map_err(|e| {
        Error::data(format!("cannot read {}: {e}", file.display()))
            .help("give the path of a record (CSV: time_s,yaw_deg) or of a campaign.toml")
    })
}

fn folder(model: &Path) -> Result<PathBuf> {
    let folder = model.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    folder.canonicalize().map_err(|e| crate::files::cannot_write(model, &e))
}

/// `file` as seen from `folder`, both absolute.
fn relative(file: &Path, folder: &Path) -> String {
    let (file, folder): (Vec<Component>, Vec<Component>) =
        (file.components().collect(), folder.components().collect());
    let common = file.iter().zip(&folder).take_while(|(a, b)| a == b).count();
    let mut out: PathBuf = vec![Component::ParentDir; folder.len() - common].iter().collect();
    out.extend(&file[common..]);
    out.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_named_as_seen_from_the_model() {
        let seen = |file, folder| relative(Path::new(file), Path::new(folder));
        assert_eq!(seen("/a/b/r.csv", "/a/b"), "r.csv");
        assert_eq!(seen("/a/b/r.csv", "/a"), "b/r.csv");
        assert_eq!(seen("/a/b/r.csv", "/a/c/d"), "../../b/r.csv");
        assert_eq!(seen("/a/r.csv", "/"), "a/r.csv");
    }
}
