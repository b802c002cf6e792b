//! A record's bytes, taken in once by a file's name: a pipe gives them only once, and what is said of a file
//! is said of the bytes that were read.

use super::format::{self, Format};
use super::place;
use bytes::Bytes;
use flate2::read::MultiGzDecoder;
use std::collections::HashMap;
use std::fmt::Display;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use yawrig_base::disk::{self, Seen};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_shared::checksum::crc32;

/// A format is told by so many bytes.
const HEAD: u64 = 4096;

/// What a file that was compressed by itself begins with, and most bytes of one.
const GZIP: &[u8] = b"\x1f\x8b";
const LARGEST: u64 = 1 << 30;

/// What standard input is called while its record is read.
const INPUT: &str = "standard-input";

/// What gives its bytes only once.
static TAKEN_IN: LazyLock<Mutex<HashMap<PathBuf, Bytes>>> = LazyLock::new(Mutex::default);

/// What was in the files that were read.
static CONTENTS: LazyLock<Mutex<HashMap<PathBuf, (Seen, Content)>>> = LazyLock::new(Mutex::default);

/// By what the bytes of a file are known again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Content {
    pub bytes: usize,
    pub crc32: String,
}

impl Content {
    fn new(bytes: &[u8]) -> Self {
        Self { bytes: bytes.len(), crc32: format!("{:08x}", crc32(bytes)) }
    }
}

/// What messages call `file`, until [`said`] has them say it as the user does.
pub(super) fn shown(file: &Path) -> &Path {
    if place::is_standard_input(file) {
        Path::new(INPUT)
    } else {
        file
    }
}

/// An error about the record that comes by standard input.
pub(super) fn said(error: Error) -> Error {
    Error {
        message: error.message.replace(INPUT, "standard input"),
        // A command that is printed takes it in again.
        help: error.help.replace(INPUT, "-"),
        ..error
    }
}

/// The format of `file`, or standard input, and all its bytes.
///
/// # Errors
/// Exit 3 where it cannot be read, or is of a relative of the formats that is not read.
pub(super) fn read(file: &Path) -> Result<(Format, Bytes)> {
    // What changes while it is read is taken as it was before, and so read again.
    if let Some(stamp) = stamp(file) {
        let (format, bytes) = read_now(file)?;
        contents().insert(file.to_owned(), (stamp, Content::new(&bytes)));
        return Ok((format, bytes));
    }
    let mut taken_in = taken_in();
    if let Some(bytes) = taken_in.get(file) {
        return Ok((format::of(shown(file), bytes)?, bytes.clone()));
    }
    let (format, bytes) = read_as_it_comes(file)?;
    taken_in.insert(file.to_owned(), bytes.clone());
    Ok((format, bytes))
}

/// Of a pipe, for which another program may be long: read by a thread of its own, so that Ctrl-C ends the
/// wait.
fn read_as_it_comes(file: &Path) -> Result<(Format, Bytes)> {
    let (sender, read) = mpsc::channel();
    let from = file.to_owned();
    std::thread::spawn(move || sender.send(read_now(&from)));
    loop {
        match read.recv_timeout(Duration::from_millis(50)) {
            Ok(read) => return read,
            Err(RecvTimeoutError::Timeout) => interrupt::check()?,
            Err(RecvTimeoutError::Disconnected) => panic!("whatever is read, it is sent"),
        }
    }
}

fn read_now(file: &Path) -> Result<(Format, Bytes)> {
    let shown = shown(file);
    let fail = |e: &dyn Display| cannot_read(shown, e);
    let (mut from, size): (Box<dyn Read>, u64) = if place::is_standard_input(file) {
        (Box::new(std::io::stdin()), 0)
    } else if disk::is_dir(file) {
        let error = fail(&"it is a folder");
        let campaign = file.join("campaign.toml");
        return Err(match disk::exists(&campaign) {
            true => error.help(format!("give the campaign in it: {}", campaign.display())),
            false => error,
        });
    } else {
        let (opened, size) = disk::open(file).map_err(|e| fail(&e))?;
        (Box::new(opened), size)
    };
    let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0));
    from.by_ref().take(HEAD).read_to_end(&mut bytes).map_err(|e| fail(&e))?;
    // A device may never end.
    if !bytes.starts_with(GZIP) {
        format::of(shown, &bytes)?;
    }
    let bytes = whole(shown, bytes, from)?;
    Ok((format::of(shown, &bytes[..bytes.len().min(HEAD as usize)])?, bytes.into()))
}

/// What begins with `head` and goes on with `rest`, inflated where it was compressed by itself.
fn whole(shown: &Path, head: Vec<u8>, mut rest: impl Read) -> Result<Vec<u8>> {
    let fail = |e: &dyn Display| cannot_read(shown, e);
    let mut bytes = head;
    if !bytes.starts_with(GZIP) {
        rest.read_to_end(&mut bytes).map_err(|e| fail(&e))?;
        return Ok(bytes);
    }
    let compressed = std::io::Cursor::new(std::mem::take(&mut bytes)).chain(rest);
    // One after the other, as `gzip` reads them.
    let mut inflated = MultiGzDecoder::new(compressed).take(LARGEST + 1);
    inflated.read_to_end(&mut bytes).map_err(|e| fail(&e))?;
    match bytes.len() as u64 > LARGEST {
        true => Err(fail(&format!("it holds more than {} MiB", LARGEST >> 20))),
        false => Ok(bytes),
    }
}

fn cannot_read(shown: &Path, why: &dyn Display) -> Error {
    Error::data(format!("cannot read {}: {why}", shown.display())).help("give the path of a record")
}

/// What is in `file`, a record or any other, now; read only where it is not as this process has read it. None
/// where it cannot be read, or gives its bytes only once and has not yet.
pub fn content(file: &Path) -> Option<Content> {
    let (file, _) = place::parted(file);
    let Some(stamp) = stamp(&file) else { return taken_in().get(&file).map(|b| Content::new(b)) };
    let known = contents().get(&file).cloned();
    match known.filter(|(known, _)| *known == stamp) {
        Some((_, content)) => Some(content),
        None => Some(Content::new(&disk::read(&file).ok()?)),
    }
}

/// Whether `was` is in `file` now, as [`content`] has it; a file of another length is not read.
pub fn holds(file: &Path, was: &Content) -> bool {
    let now = stamp(&place::parted(file).0);
    now.is_none_or(|now| now.bytes == was.bytes as u64) && content(file).as_ref() == Some(was)
}

/// What was in `file` when this process last read its record, whatever has become of it since; none where it
/// has not.
pub fn content_when_read(file: &Path) -> Option<Content> {
    let (file, _) = place::parted(file);
    let read = contents().get(&file).map(|(_, content)| content.clone());
    read.or_else(|| taken_in().get(&file).map(|bytes| Content::new(bytes)))
}

/// None of what gives its bytes only once.
fn stamp(file: &Path) -> Option<Seen> {
    if place::is_standard_input(file) {
        None
    } else {
        disk::seen(file)
    }
}

fn taken_in() -> MutexGuard<'static, HashMap<PathBuf, Bytes>> {
    TAKEN_IN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn contents() -> MutexGuard<'static, HashMap<PathBuf, (Seen, Content)>> {
    CONTENTS.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_in_a_file_is_said_of_the_bytes_that_were_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("r.csv");
        let of = |bytes: &str| Some(Content::new(bytes.as_bytes()));
        std::fs::write(&file, "one").unwrap();
        assert_eq!((content(&file), content_when_read(&file)), (of("one"), None));
        assert_eq!(read(&file).unwrap().1, "one");
        std::fs::write(&file, "longer").unwrap();
        let release = folder.path().join("r.csv#2");
        assert_eq!((content(&release), content_when_read(&release)), (of("longer"), of("one")));
        read(&file).unwrap();
        std::fs::remove_file(&file).unwrap();
        assert_eq!((content(&file), content_when_read(&file)), (None, of("longer")));
    }

    #[test]
    fn a_file_holds_what_it_held_until_it_is_changed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("r.csv");
        std::fs::write(&file, "one").unwrap();
        let was = content(&file).unwrap();
        assert!(holds(&file, &was) && holds(&folder.path().join("r.csv#2"), &was));
        for other in ["two", "three"] {
            std::fs::write(&file, other).unwrap();
            assert!(!holds(&file, &was), "{other}");
        }
        std::fs::remove_file(&file).unwrap();
        assert!(!holds(&file, &was));
    }
}
