//! `-`: the record that comes by standard input. It is taken in once; each reading finds it in a file for as
//! long as it takes, since a format is told, and read, by going back and forth.

use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;
use yawrig_base::error::{Error, Result};
use yawrig_core::record::Record;

static INPUT: OnceLock<std::result::Result<Vec<u8>, String>> = OnceLock::new();

/// What stands behind `-`: nothing, or `#2`; `None` for another name.
pub(super) fn part(named: &Path) -> Option<&str> {
    let part = named.to_str()?.strip_prefix('-')?;
    (part.is_empty() || part.starts_with('#')).then_some(part)
}

/// The record of that name and part, as `read` finds it in a file.
pub(super) fn read(
    named: &Path,
    part: &str,
    read: impl FnOnce(&Path) -> Result<Record>,
) -> Result<Record> {
    let taken_in = INPUT.get_or_init(|| {
        let mut all = Vec::new();
        std::io::stdin().lock().read_to_end(&mut all).map(|_| all).map_err(|e| e.to_string())
    });
    let fail = |e: &dyn std::fmt::Display| {
        Error::data(format!("cannot read standard input: {e}")).help("give a record: - < r.csv")
    };
    let bytes = taken_in.as_ref().map_err(|e| fail(e))?;
    let folder = tempfile::tempdir().map_err(|e| fail(&e))?;
    let file = folder.path().join("record");
    std::fs::write(&file, bytes).map_err(|e| fail(&e))?;
    let shown = file.display().to_string();
    match read(Path::new(&format!("{shown}{part}"))) {
        Ok(record) => Ok(Record { file: named.to_owned(), ..record }),
        // A command that is printed takes it in again.
        Err(e) => Err(Error {
            message: e.message.replace(&shown, "standard input"),
            help: e.help.replace(&shown, "-"),
            ..e
        }),
    }
}
