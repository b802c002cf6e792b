//! `records.toml`: how the records of a folder are read, once it has been said.

use super::table::Selection;
use std::path::{Path, PathBuf};
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::settings;

fn beside(record: &Path) -> PathBuf {
    record.with_file_name("records.toml")
}

/// Keeps `selection` for the records in the folder of `record`; the file's path.
///
/// # Errors
/// Exit 3 where it cannot be written.
pub fn keep(record: &Path, selection: &Selection) -> Result<PathBuf> {
    let file = beside(record);
    let text = toml::to_string(selection)
        .map_err(|e| Error::internal(format!("cannot write {}: {e}", file.display())))?;
    let keep = settings::command("convert", &[], &[("keep", "")]);
    let head =
        format!("# How the records in this folder are read whose names do not say it ({keep}).");
    files::write_atomically(&file, format!("{head}\n{text}").as_bytes())?;
    Ok(file)
}

/// What was kept for `record`; nothing where nothing was.
pub(super) fn for_record(record: &Path) -> Result<Selection> {
    let file = beside(record);
    let Ok(text) = disk::read_to_string(&file) else { return Ok(Selection::default()) };
    toml::from_str(&text).map_err(|e| {
        let line = e.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
        Error::data(format!("{}, line {line}: {}", file.display(), e.message()))
            .help("correct it, or delete it and say again how records are read")
    })
}
