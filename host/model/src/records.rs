//! Which records a model is about: files and campaigns to entries of the model's file.

use crate::document::{of_file, MadeUnder, Model, RecordEntry};
use std::path::{Component, Path, PathBuf};
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_campaign::CampaignFile;
use yawrig_core::record::Record;
use yawrig_records::place::{canonical, is_standard_input};
use yawrig_records::Selection;

/// A record, and what is wrong with it as far as that is known without reading it.
#[derive(Clone, Debug)]
pub struct Listed {
    pub entry: RecordEntry,
    pub fault: Option<Error>,
}

/// Entries for `files`, records or campaigns, of a model whose file is `model`; records are read as `reading`
/// says.
///
/// # Errors
/// Exit 3 where one is not there, 2 where one is given twice; those of [`CampaignFile::read_releases`].
pub fn entries(files: &[PathBuf], reading: &Selection, model: &Path) -> Result<Vec<RecordEntry>> {
    let read = |listed: Listed| listed.fault.map_or(Ok(listed.entry), Err);
    let read = |listed| read(listed).map(|entry| entry.read_as(reading));
    listed(files, model)?.into_iter().map(read).collect()
}

impl RecordEntry {
    /// The same, to be read as `reading` says, if that says anything.
    pub fn read_as(mut self, reading: &Selection) -> Self {
        if !reading.is_empty() {
            self.reading = reading.clone();
        }
        self
    }
}

/// As [`entries`], including records that are missing.
///
/// # Errors
/// Exit 2 where one is given twice; those of [`CampaignFile::read_listed`].
pub fn listed(files: &[PathBuf], model: &Path) -> Result<Vec<Listed>> {
    let mut all: Vec<Listed> = Vec::new();
    for file in files {
        if disk::exists(model) && disk::canonicalize(file).ok() == disk::canonicalize(model).ok() {
            return Err(Error::usage(format!("{} is the model, not a record", file.display()))
                .help(format!(
                    "name it with {}: {}",
                    settings::name("model"),
                    settings::command("fit", &[], &[("model", &file.display().to_string())])
                )));
        }
        let listed = if file.extension().is_some_and(|e| e == "toml") {
            of_campaign(file, model)?
        } else {
            vec![entry(file, None, model)?]
        };
        for listed in listed {
            if all.iter().any(|other| other.entry.file == listed.entry.file) {
                return Err(Error::usage(format!("{} is given twice", listed.entry.file))
                    .help("give each record once"));
            }
            all.push(listed);
        }
    }
    Ok(all)
}

fn of_campaign(file: &Path, model: &Path) -> Result<Vec<Listed>> {
    let campaign = CampaignFile::read_listed(file)?;
    let made = |(index, release): (usize, &yawrig_core::derivatives::campaign::ReleaseEntry)| {
        let made = MadeUnder {
            spring: release.spring.clone(),
            axis: release.axis,
            wind_speed_m_s: release.wind_speed_m_s,
        };
        let Listed { mut entry, fault } = entry(&campaign.record_path(index), Some(made), model)?;
        entry.reading.motion = campaign.campaign.motion;
        if !release.at.is_empty() {
            entry.condition = format!("{}, {}", entry.condition, release.at);
        }
        // In the campaign's words, with its line.
        Ok(Listed { entry, fault: campaign.check_record(index).err().or(fault) })
    };
    campaign.campaign.release.iter().enumerate().map(made).collect()
}

fn entry(file: &Path, made_under: Option<MadeUnder>, model: &Path) -> Result<Listed> {
    let (real, fault) = match canonical(file) {
        Ok(real) => (real, None),
        Err(e) => (where_it_would_be(file), Some(cannot_read(file, &e))),
    };
    let file = match is_standard_input(&real) {
        true => real.display().to_string(),
        false => relative(&real, &folder(model)?),
    };
    let condition = made_under.as_ref().map_or_else(|| of_file(&file), MadeUnder::condition);
    let entry = RecordEntry {
        file,
        condition,
        reading: Selection::default(),
        held_out: false,
        made_under,
        crc32: None,
        line: 0,
    };
    Ok(Listed { entry, fault })
}

/// An entry for a record that is in memory, under its name.
pub fn in_memory(record: &Record) -> RecordEntry {
    let file = record.file.display().to_string();
    RecordEntry {
        condition: of_file(&file),
        file,
        reading: Selection::default(),
        held_out: false,
        made_under: None,
        crc32: None,
        line: 0,
    }
}

/// The entry of `model` (its file being `path`) for `file`, else a new one.
///
/// # Errors
/// Exit 3 where `file` is not there.
pub fn known_or_new(model: &Model, path: &Path, file: &Path) -> Result<RecordEntry> {
    let Listed { entry: new, fault } = entry(file, None, path)?;
    if let Some(fault) = fault {
        return Err(fault);
    }
    Ok(find(model, path, &new).map_or(new, |k| model.records[k].clone()))
}

/// What to say where the record in `file` is not the one that the model was fitted to.
pub fn changed(entry: &RecordEntry, file: &Path) -> Option<String> {
    let (was, is) = (entry.crc32.as_ref()?, yawrig_records::content(file)?.crc32);
    (*was != is).then(|| {
        format!(
            "{} has changed since the model was fitted to it (checksum {was}, now {is}): the model's numbers are those of the \
             earlier file; `yawrig fit` fits it anew",
            file.display()
        )
    })
}

/// Which of the model's records is `entry`'s.
pub fn find(model: &Model, path: &Path, entry: &RecordEntry) -> Option<usize> {
    let place = |entry: &RecordEntry| canonical(&Model::record_path(path, entry)).ok();
    let wanted = place(entry)?;
    model.records.iter().position(|other| place(other).as_ref() == Some(&wanted))
}

fn cannot_read(file: &Path, why: &std::io::Error) -> Error {
    Error::data(format!("cannot read {}: {why}", file.display()))
        .help("give the path of a record (CSV: time_s,yaw_deg) or of a campaign.toml")
}

/// The real path of a file that is not there.
fn where_it_would_be(file: &Path) -> PathBuf {
    let folder = file.parent().and_then(|folder| match folder.as_os_str().is_empty() {
        true => disk::canonicalize(".").ok(),
        false => disk::canonicalize(folder).ok(),
    });
    match (folder, file.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => std::path::absolute(file).unwrap_or_else(|_| file.to_owned()),
    }
}

fn folder(model: &Path) -> Result<PathBuf> {
    let folder = model.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    disk::canonicalize(folder).map_err(|e| yawrig_base::files::cannot_write(model, &e))
}

/// `file` as seen from `folder`, both absolute.
fn relative(file: &Path, folder: &Path) -> String {
    let (file, folder): (Vec<Component>, Vec<Component>) =
        (file.components().collect(), folder.components().collect());
    let common = file.iter().zip(&folder).take_while(|(a, b)| a == b).count();
    let mut out: PathBuf = vec![Component::ParentDir; folder.len() - common].iter().collect();
    out.extend(&file[common..]);
    yawrig_base::files::portable(&out)
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
