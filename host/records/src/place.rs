//! `r.csv#2`: one of several releases in one file.

use super::standard_input;
use std::path::{Path, PathBuf};

/// The file that `named` means, and which of its releases, from 1; the whole of it where none is named.
pub fn parted(named: &Path) -> (PathBuf, Option<usize>) {
    let release = || {
        if named.exists() {
            return None;
        }
        let (file, number) = named.to_str()?.rsplit_once('#')?;
        let number = number.parse().ok().filter(|n| *n > 0)?;
        Some((PathBuf::from(file), Some(number)))
    };
    release().unwrap_or_else(|| (named.to_owned(), None))
}

/// The name of release `number` of `file`.
pub fn with_release(file: &Path, number: usize) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(format!("#{number}"));
    name.into()
}

/// As [`Path::is_file`].
pub fn is_file(named: &Path) -> bool {
    parted(named).0.is_file()
}

/// Whether it is `-`, the record that comes by standard input, or a release of it.
pub fn is_standard_input(named: &Path) -> bool {
    standard_input::part(named).is_some()
}

/// As [`Path::canonicalize`]; standard input has its name everywhere.
///
/// # Errors
/// Where the file is not there.
pub fn canonical(named: &Path) -> std::io::Result<PathBuf> {
    if is_standard_input(named) {
        return Ok(named.to_owned());
    }
    let (file, release) = parted(named);
    let real = file.canonicalize()?;
    Ok(release.map_or(real.clone(), |number| with_release(&real, number)))
}
