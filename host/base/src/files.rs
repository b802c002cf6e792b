//! Files written whole or not at all.

use crate::disk;
use crate::error::{Error, Result};
use std::io::Write;
#[cfg(not(target_family = "wasm"))]
use std::io::{BufWriter, ErrorKind};
use std::path::Path;
#[cfg(not(target_family = "wasm"))]
use tempfile::NamedTempFile;

/// The error of a file that cannot be written.
pub fn cannot_write(path: &Path, why: &dyn std::fmt::Display) -> Error {
    Error::data(format!("cannot write {}: {why}", path.display()))
        .help("choose a folder that exists, that you may write to and that has room")
}

/// Makes the folder `path`, and those it lies in, where they are not there.
///
/// # Errors
/// Names the path and the system's reason.
#[cfg(not(target_family = "wasm"))]
pub fn make_folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists | ErrorKind::NotADirectory => {
            cannot_write(path, &"there is a file where the folder should be")
        }
        _ => cannot_write(path, &e),
    })
}

/// In memory a folder is there with its first file.
///
/// # Errors
/// None.
#[cfg(target_family = "wasm")]
pub fn make_folder(_: &Path) -> Result<()> {
    Ok(())
}

/// A path as a file names it that goes from one system to another: Windows, too, takes `/`.
pub fn portable(path: &Path) -> String {
    let path = path.display().to_string();
    if cfg!(windows) {
        portable_on_windows(&path)
    } else {
        path
    }
}

/// Without the `\\?\` that a path has which was resolved, after which `/` would not do.
fn portable_on_windows(path: &str) -> String {
    let plain = match path.strip_prefix(r"\\?\") {
        Some(resolved) => match resolved.strip_prefix(r"UNC\") {
            Some(share) => format!(r"\\{share}"),
            None => resolved.to_owned(),
        },
        None => path.to_owned(),
    };
    plain.replace('\\', "/")
}

/// Whether [`write_atomically`] will find a place, asked before the work whose result it is to keep.
///
/// # Errors
/// Names the path and the system's reason.
pub fn check_writable(path: &Path) -> Result<()> {
    if disk::is_dir(path) {
        return Err(cannot_write(path, &"it is a folder"));
    }
    #[cfg(not(target_family = "wasm"))]
    temporary(path)?;
    Ok(())
}

/// An empty file in the folder of `path`; gone with this value.
#[cfg(not(target_family = "wasm"))]
fn temporary(path: &Path) -> Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    tempfile::Builder::new().prefix(".yawrig-").tempfile_in(folder).map_err(|e| match e.kind() {
        // Its own message names the temporary file, which the user does not know.
        ErrorKind::NotFound => cannot_write(path, &"there is no such folder"),
        ErrorKind::NotADirectory => cannot_write(path, &"a part of its path is a file"),
        ErrorKind::PermissionDenied => cannot_write(path, &"you may not write there"),
        _ => cannot_write(path, &e),
    })
}

/// Writes `bytes` to a temporary file beside `path` and renames it there.
///
/// # Errors
/// Names the path and the system's reason; nothing half-written is left.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically_with(path, |out| out.write_all(bytes).map_err(|e| cannot_write(path, &e)))
}

/// Has `write` fill a temporary file beside `path` and renames it there once that succeeded.
///
/// # Errors
/// Those of `write`, or names the path and the system's reason; nothing half-written is left.
#[cfg(not(target_family = "wasm"))]
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<()>,
) -> Result<()> {
    let fail = |e: std::io::Error| cannot_write(path, &e);
    let mut file = temporary(path)?;
    let mut buffer = BufWriter::new(file.as_file_mut());
    write(&mut buffer)?;
    buffer.flush().map_err(fail)?;
    drop(buffer);
    file.as_file().sync_all().map_err(fail)?;
    #[cfg(unix)]
    {
        let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o644);
        file.as_file().set_permissions(permissions).map_err(fail)?;
    }
    // Not `persist`, which on Windows does not replace a file that somebody reads.
    let written = file.into_temp_path().keep().map_err(|e| fail(e.error))?;
    std::fs::rename(&written, path).map_err(|e| {
        let _ = std::fs::remove_file(&written);
        fail(e)
    })
}

/// As on a disk.
///
/// # Errors
/// Those of `write`.
#[cfg(target_family = "wasm")]
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<()>,
) -> Result<()> {
    let mut bytes = Vec::new();
    write(&mut bytes)?;
    disk::hold(path, bytes);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_of_windows_is_one_everywhere() {
        for (path, portable) in [
            (r"sub\r 1.csv", "sub/r 1.csv"),
            (r"..\r.csv", "../r.csv"),
            (r"\\?\D:\Messungen\r.csv", "D:/Messungen/r.csv"),
            (r"\\?\UNC\server\share\r.csv", "//server/share/r.csv"),
        ] {
            assert_eq!(portable_on_windows(path), portable);
        }
        assert!(cfg!(windows) || portable(Path::new(r"a\b/c")) == r"a\b/c", "a name may have it");
    }
}
