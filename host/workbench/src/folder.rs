//! The folder that the program was started in: what can be opened there, and what is read of a record.

use super::app::App;
use serde_json::{json, Value};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_model::document::RecordEntry;
use yawrig_model::records;
use yawrig_records::place::{parted, with_part, Part, Times};
use yawrig_records::{format, Selection};
use yawrig_report::view::Loaded;

/// Records and campaigns in the folder the program was started in.
///
/// # Errors
/// Exit 3 where the folder cannot be read.
pub fn files(app: &App) -> Result<Value> {
    // What is bad data may have been corrected, and be opened again.
    let known: Vec<Option<PathBuf>> = (app.session().releases.iter())
        .filter(|r| r.source.fault().is_none())
        .map(|r| r.source.path.canonicalize().ok())
        .collect();
    let folder =
        std::fs::read_dir(".").map_err(|e| Error::data(format!("cannot list this folder: {e}")))?;
    let mut names: Vec<String> = folder
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| format::is_named_so(path))
        .filter(|path| !known.contains(&path.canonicalize().ok()))
        .filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()))
        .collect();
    names.sort();
    Ok(json!({ "files": names }))
}

/// Adds a record of the folder, read so, to the list; its number.
///
/// # Errors
/// Exit 2 for anything but a file of the folder, 3 where it is not there.
pub fn open(app: &App, file: &str, reading: &Selection) -> Result<usize> {
    let path = Path::new(file);
    let is_plain = path.components().count() == 1 && path.file_name().is_some();
    if !is_plain {
        return Err(Error::usage(format!(
            "{file}: only files of the folder that yawrig was started in"
        ))
        .help("start the workbench with the record's path"));
    }
    let model_path = app.session().model_path.clone();
    let mut entries = records::entries(&[path.to_owned()], reading, &model_path)?;
    let entry: RecordEntry =
        entries.pop().ok_or_else(|| Error::internal("a file without an entry"))?;
    let mut session = app.session();
    let used = session.used_when_new();
    let id = session.include(entry, None, used);
    session.read_again(id);
    session.read_as(id, reading);
    drop(session);
    app.work.want(id);
    Ok(id)
}

/// The times between which a record is read.
pub(super) fn times_of(path: &Path) -> [Option<f64>; 2] {
    match parted(path).1 {
        Some(Part::Between(times)) => [times.from_s, times.to_s],
        _ => [None, None],
    }
}

/// Reads a release between these times of the record that it was opened as, or, where none is said, all of
/// that.
///
/// # Errors
/// Exit 3 where no free decay lies between them; then nothing has changed.
pub fn between(app: &App, id: usize, times: Times) -> Result<()> {
    let (source, model_path) = {
        let session = app.session();
        (session.release(id)?.source.clone(), session.model_path.clone())
    };
    let path = match times == Times::default() {
        true => source.origin.clone(),
        false => {
            // One of several releases, or what is kept of its folder, ends where it did.
            let loaded = source.loaded().map_err(Clone::clone)?;
            let whole = loaded.whole.as_ref().unwrap_or(&loaded.record);
            let from_s = times.from_s.or(whole.time_s.first().copied());
            let to_s = times.to_s.or(whole.time_s.last().copied());
            let (file, _) = parted(&source.origin);
            with_part(&file, Part::Between(Times { from_s, to_s }))
        }
    };
    if path == source.path {
        return Ok(());
    }
    let loaded = Loaded::read(&path, &source.origin, &source.reading, source.wind_speed_m_s)?;
    if let Err(why) = &loaded.decay {
        return Err(why.clone());
    }
    let files = std::slice::from_ref(&path);
    let mut entries = records::entries(files, &source.reading, &model_path)?;
    let entry = entries.pop().ok_or_else(|| Error::internal("a file without an entry"))?;
    app.session().cut(id, entry, path, loaded);
    app.work.want(id);
    Ok(())
}
