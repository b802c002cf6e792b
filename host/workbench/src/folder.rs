//! The folder that the program was started in: what can be opened there.

use super::app::App;
use serde_json::{json, Value};
use std::path::PathBuf;
use yawrig_base::error::{Error, Result};
use yawrig_records::format;

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
