//! What is opened, and which part of a record is read.

use super::bench::Bench;
use super::session::{Opened, Session};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_model::document::{is_model, RecordEntry};
use yawrig_model::records;
use yawrig_records::place::{parted, with_part, Part, Times};
use yawrig_records::Selection;
use yawrig_report::view::Loaded;

/// Adds a record of the folder, read so, to the list; its number.
///
/// # Errors
/// Exit 2 for anything but a file of the folder, 3 where it is not there.
pub fn open(bench: &Bench, file: &str, reading: &Selection) -> Result<usize> {
    let path = Path::new(file);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        return all_of(bench, path);
    }
    let is_plain = path.components().count() == 1 && path.file_name().is_some();
    if !is_plain {
        return Err(Error::usage(format!(
            "{file}: only files of the folder that yawrig was started in"
        ))
        .help("start the workbench with the record's path"));
    }
    let model_path = bench.session().model_path.clone();
    let mut entries = records::entries(&[path.to_owned()], reading, &model_path)?;
    let entry: RecordEntry =
        entries.pop().ok_or_else(|| Error::internal("a file without an entry"))?;
    let mut session = bench.session();
    let used = session.used_when_new();
    let id = session.include(entry, None, used);
    session.read_again(id);
    session.read_as(id, reading);
    drop(session);
    Ok(id)
}

/// Opens what a campaign or a model names; the first of its releases.
///
/// # Errors
/// Those of [`Session::new`]; exit 2 where a model has been made of what is open.
fn all_of(bench: &Bench, file: &Path) -> Result<usize> {
    let mut session = bench.session();
    if session.standing.model.is_some() && !is_model(file) {
        let what = format!("{} is about what is open already", session.model_path.display());
        return Err(Error::usage(what).help("close it first, or open this on a page of its own"));
    }
    let (own, unknown_zero) = (session.own.clone(), session.unknown_zero);
    let files = vec![file.to_owned()];
    *session = Session::new(&Opened { files, model: None, own, unknown_zero })?;
    Ok(0)
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
pub fn between(bench: &Bench, id: usize, times: Times) -> Result<()> {
    let (source, model_path) = {
        let session = bench.session();
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
    bench.session().cut(id, entry, path, loaded);
    Ok(())
}
