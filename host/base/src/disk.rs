//! The disk; in a browser's module, which has none, files in memory that are called as on a disk.

#[cfg(any(test, target_family = "wasm"))]
mod memory;
#[cfg(target_family = "wasm")]
pub use memory::{
    canonicalize, exists, hold, is_dir, is_file, names, open, read, read_to_string, remove_file,
    rename, seen, File,
};
#[cfg(not(target_family = "wasm"))]
pub use std::fs::{canonicalize, read, read_to_string, remove_file, rename, File};
#[cfg(not(target_family = "wasm"))]
pub use system::{exists, is_dir, is_file, open, seen};

/// A file as it was when it was looked at: while it is seen so it holds what it held.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    pub bytes: u64,
    /// When its content was last changed.
    changed: Option<std::time::SystemTime>,
    identity: [i64; 4],
}

#[cfg(not(target_family = "wasm"))]
mod system {
    use super::{File, Seen};
    use std::path::Path;

    pub fn exists(path: &Path) -> bool {
        path.exists()
    }

    pub fn is_file(path: &Path) -> bool {
        path.is_file()
    }

    pub fn is_dir(path: &Path) -> bool {
        path.is_dir()
    }

    /// A file to be read, and its length.
    ///
    /// # Errors
    /// The system's.
    pub fn open(path: &Path) -> std::io::Result<(File, u64)> {
        let file = File::open(path)?;
        let length = file.metadata().map_or(0, |m| m.len());
        Ok((file, length))
    }

    /// None of what is no file, or not there.
    pub fn seen(path: &Path) -> Option<Seen> {
        let m = path.metadata().ok().filter(std::fs::Metadata::is_file)?;
        Some(Seen { bytes: m.len(), changed: m.modified().ok(), identity: identity(&m) })
    }

    /// Device and number on it, and when its entry was last changed.
    #[cfg(unix)]
    fn identity(m: &std::fs::Metadata) -> [i64; 4] {
        use std::os::unix::fs::MetadataExt;
        [m.dev() as i64, m.ino() as i64, m.ctime(), m.ctime_nsec()]
    }

    /// When it was made.
    #[cfg(windows)]
    fn identity(m: &std::fs::Metadata) -> [i64; 4] {
        use std::os::windows::fs::MetadataExt;
        [m.creation_time() as i64, 0, 0, 0]
    }
}
