//! Files that one program at a time writes to, and any may read.

use crate::disk::File;
#[cfg(not(target_family = "wasm"))]
use std::fs::OpenOptions;
use std::io::Result;
use std::path::Path;

/// Opens `path` to read and write, makes it where it is not there, and keeps other programs from doing the
/// same for as long as the file lives, however this program ends. None where another has it.
///
/// # Errors
/// The system's.
#[cfg(not(target_family = "wasm"))]
pub fn open(path: &Path) -> Result<Option<File>> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    system::open(&options, path)
}

#[cfg(unix)]
mod system {
    use super::{File, OpenOptions, Path, Result};
    use std::fs::TryLockError;
    use std::os::unix::fs::MetadataExt;

    pub fn open(options: &OpenOptions, path: &Path) -> Result<Option<File>> {
        loop {
            let file = options.open(path)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(None),
                Err(TryLockError::Error(e)) if e.kind() == std::io::ErrorKind::Interrupted => {
                    continue
                }
                Err(TryLockError::Error(e)) => return Err(e),
            }
            // The one who had it may have deleted or replaced it: then this is a file without a name.
            let ours = file.metadata()?;
            let is_ours =
                |there: std::fs::Metadata| (ours.dev(), ours.ino()) == (there.dev(), there.ino());
            if path.metadata().is_ok_and(is_ours) {
                return Ok(Some(file));
            }
        }
    }
}

/// Not the system's lock of a region, which readers would meet, too: a file is opened for writing by one
/// only.
#[cfg(windows)]
mod system {
    use super::{File, OpenOptions, Path, Result};
    use std::os::windows::fs::OpenOptionsExt;

    const FILE_SHARE_READ: u32 = 1;
    const FILE_SHARE_DELETE: u32 = 4;
    const ERROR_SHARING_VIOLATION: i32 = 32;

    pub fn open(options: &OpenOptions, path: &Path) -> Result<Option<File>> {
        let mut options = options.clone();
        match options.share_mode(FILE_SHARE_READ | FILE_SHARE_DELETE).open(path) {
            Ok(file) => Ok(Some(file)),
            Err(e) if e.raw_os_error() == Some(ERROR_SHARING_VIOLATION) => Ok(None),
            Err(e) => Err(e),
        }
    }
}

/// The files of a browser's module are seen by no other.
///
/// # Errors
/// None.
#[cfg(target_family = "wasm")]
pub fn open(path: &Path) -> Result<Option<File>> {
    Ok(Some(File::open_or_make(path)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn one_writes_and_others_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let mut ours = open(&path).unwrap().expect("nobody has it");
        ours.write_all(b"a line").unwrap();
        assert!(open(&path).unwrap().is_none(), "it is taken");
        assert_eq!(std::fs::read(&path).unwrap(), b"a line");
        drop(ours);
        assert!(open(&path).unwrap().is_some(), "it is free again");
        assert_eq!(std::fs::read(&path).unwrap(), b"a line");
    }

    // Elsewhere nothing takes the place of a file that is open.
    #[cfg(unix)]
    #[test]
    fn what_is_replaced_meanwhile_is_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let ours = open(&path).unwrap().expect("nobody has it");
        crate::files::write_atomically(&path, b"new").unwrap();
        assert!(open(&path).unwrap().is_some(), "nobody has the new one");
        drop(ours);
    }
}
