//! Files in memory. A folder is there as soon as a file lies in it.

use super::Seen;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

struct Held {
    bytes: Vec<u8>,
    /// Another after each change, of any file.
    version: i64,
}

#[derive(Default)]
struct Files {
    held: BTreeMap<PathBuf, Held>,
    changes: i64,
}

static FILES: Mutex<Files> = Mutex::new(Files { held: BTreeMap::new(), changes: 0 });

fn files() -> MutexGuard<'static, Files> {
    FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From the root, without detours.
fn whole(path: &Path) -> PathBuf {
    let mut out = PathBuf::from("/");
    for part in path.components() {
        match part {
            Component::Normal(name) => out.push(name),
            Component::ParentDir => {
                out.pop();
            }
            _ => {}
        }
    }
    out
}

fn missing() -> Error {
    Error::new(ErrorKind::NotFound, "there is no such file")
}

impl Files {
    fn change<T>(&mut self, path: &Path, how: impl FnOnce(&mut Vec<u8>) -> T) -> T {
        self.changes += 1;
        let version = self.changes;
        let held =
            self.held.entry(whole(path)).or_insert_with(|| Held { bytes: Vec::new(), version });
        held.version = version;
        how(&mut held.bytes)
    }
}

/// From now on these are the bytes of the file at `path`.
pub fn hold(path: &Path, bytes: Vec<u8>) {
    files().change(path, |held| *held = bytes);
}

/// Every file, as seen from the root.
pub fn names() -> Vec<PathBuf> {
    let named = |path: &PathBuf| path.strip_prefix("/").unwrap_or(path).to_owned();
    files().held.keys().map(named).collect()
}

pub fn is_file(path: &Path) -> bool {
    files().held.contains_key(&whole(path))
}

pub fn is_dir(path: &Path) -> bool {
    let path = whole(path);
    let holds = |file: &PathBuf| *file != path && file.starts_with(&path);
    path == Path::new("/") || files().held.keys().any(holds)
}

pub fn exists(path: &Path) -> bool {
    is_file(path) || is_dir(path)
}

/// # Errors
/// Where it is not there.
pub fn canonicalize(path: impl AsRef<Path>) -> Result<PathBuf> {
    match exists(path.as_ref()) {
        true => Ok(whole(path.as_ref())),
        false => Err(missing()),
    }
}

/// # Errors
/// Where it is not there.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<u8>> {
    files().held.get(&whole(path.as_ref())).map(|held| held.bytes.clone()).ok_or_else(missing)
}

/// # Errors
/// Where it is not there, or no text.
pub fn read_to_string(path: impl AsRef<Path>) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|e| Error::new(ErrorKind::InvalidData, e))
}

/// # Errors
/// Where it is not there.
pub fn remove_file(path: impl AsRef<Path>) -> Result<()> {
    files().held.remove(&whole(path.as_ref())).map(drop).ok_or_else(missing)
}

/// # Errors
/// Where it is not there.
pub fn rename(from: impl AsRef<Path>, to: impl AsRef<Path>) -> Result<()> {
    let bytes = read(from.as_ref())?;
    hold(to.as_ref(), bytes);
    remove_file(from)
}

/// A file to be read, and its length.
///
/// # Errors
/// Where it is not there.
pub fn open(path: &Path) -> Result<(File, u64)> {
    let length = read(path)?.len() as u64;
    Ok((File::open(path)?, length))
}

/// None of what is no file, or not there.
pub fn seen(path: &Path) -> Option<Seen> {
    let files = files();
    let held = files.held.get(&whole(path))?;
    Some(Seen { bytes: held.bytes.len() as u64, changed: None, identity: [held.version, 0, 0, 0] })
}

/// An open file.
#[derive(Debug)]
pub struct File {
    path: PathBuf,
    at: Cell<usize>,
}

impl File {
    /// As [`std::fs::File::open`].
    ///
    /// # Errors
    /// Where it is not there.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        canonicalize(path).map(|path| Self { path, at: Cell::default() })
    }

    /// As [`std::fs::File::create`].
    ///
    /// # Errors
    /// None: there is always room for a name.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        hold(path.as_ref(), Vec::new());
        Self::open(path)
    }

    /// Whether it is there or not.
    pub fn open_or_make(path: &Path) -> Self {
        if !is_file(path) {
            hold(path, Vec::new());
        }
        Self { path: whole(path), at: Cell::default() }
    }

    /// # Errors
    /// None.
    pub fn set_len(&self, length: u64) -> Result<()> {
        files().change(&self.path, |held| held.resize(length as usize, 0));
        Ok(())
    }

    /// # Errors
    /// None: what is in memory is in memory.
    pub fn sync_all(&self) -> Result<()> {
        Ok(())
    }
}

impl Read for &File {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let files = files();
        let held = files.held.get(&self.path).ok_or_else(missing)?;
        let at = self.at.get().min(held.bytes.len());
        let rest = &held.bytes[at..];
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        self.at.set(at + count);
        Ok(count)
    }
}

impl Read for File {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        (&*self).read(into)
    }
}

impl Write for File {
    fn write(&mut self, from: &[u8]) -> Result<usize> {
        let (at, end) = (self.at.get(), self.at.get() + from.len());
        files().change(&self.path, |held| {
            held.resize(held.len().max(end), 0);
            held[at..end].copy_from_slice(from);
        });
        self.at.set(end);
        Ok(from.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Seek for File {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let end = seen(&self.path).map_or(0, |seen| seen.bytes) as i64;
        let at = match to {
            SeekFrom::Start(at) => at as i64,
            SeekFrom::End(by) => end + by,
            SeekFrom::Current(by) => self.at.get() as i64 + by,
        };
        let at = usize::try_from(at).map_err(|e| Error::new(ErrorKind::InvalidInput, e))?;
        self.at.set(at);
        Ok(at as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_written_read_and_renamed_as_on_a_disk() {
        let (new, old) = (Path::new("one/./two/../new.txt"), Path::new("one/old.txt"));
        assert_eq!(read(new).unwrap_err().kind(), ErrorKind::NotFound);
        let mut file = File::open_or_make(new);
        file.write_all(b"abcdef").unwrap();
        assert!(is_dir(Path::new("one")) && !exists(Path::new("two")));
        let was = seen(new).unwrap();
        file.set_len(3).unwrap();
        file.seek(SeekFrom::End(0)).unwrap();
        file.write_all(b"!").unwrap();
        file.rewind().unwrap();
        let mut text = String::new();
        file.read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), seen(new).unwrap().bytes), ("abc!", 4));
        assert_ne!(seen(new).unwrap(), was);
        rename(new, old).unwrap();
        assert_eq!((is_file(new), read_to_string(old).unwrap()), (false, "abc!".to_owned()));
        assert_eq!(open(old).unwrap().1, 4);
        assert_eq!(canonicalize(old).unwrap(), Path::new("/one/old.txt"));
        assert!(names().contains(&"one/old.txt".into()));
        remove_file(old).unwrap();
        assert!(!is_dir(Path::new("one")) && remove_file(old).is_err());
    }

    #[test]
    fn what_has_the_same_length_is_seen_to_be_another() {
        let path = Path::new("same.txt");
        hold(path, b"one".to_vec());
        let was = seen(path);
        assert_eq!(seen(path), was);
        hold(path, b"two".to_vec());
        assert_ne!(seen(path), was);
    }
}
