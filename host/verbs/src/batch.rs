//! Many records: on all cores, in memory that does not grow with their number, resumable. A stored answer
//! says what it came from; where record, options or program are others now, it is made again.

use crate::flags::named;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use yawrig_base::disk::File;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_base::lock;
use yawrig_core::identify::{identify, Identification, Method, Settings};
use yawrig_core::record::Record;
use yawrig_records::{Content, Selection};

/// Version of what is written.
pub const SCHEMA_VERSION: u32 = 1;
const PROGRAM: &str = concat!("yawrig ", env!("CARGO_PKG_VERSION"));
/// How every line begins.
const LINE_START: &[u8] = br#"{"schema_version":"#;
/// Files identified at the same time before their answers are passed on in order.
const CHUNK: usize = 64;

/// One file's answer, a line of `--jsonl`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Line {
    pub schema_version: u32,
    /// In a file of answers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<Source>,
    #[serde(flatten)]
    pub answer: Answer,
}

/// What an answer came from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Source {
    /// Of the record's bytes.
    pub crc32: String,
    pub bytes: usize,
    /// Methods and settings.
    pub options: String,
    /// Name and version.
    pub program: String,
}

impl Source {
    fn new(Content { bytes, crc32 }: Content, options: &str) -> Self {
        Self { crc32, bytes, options: options.to_owned(), program: PROGRAM.to_owned() }
    }

    /// What was in the record, if that is all that may be another now.
    fn content(self, options: &str) -> Option<Content> {
        let Self { crc32, bytes, .. } = self;
        (self.options == options && self.program == PROGRAM).then_some(Content { bytes, crc32 })
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Answer {
    Identified(Box<Identification>),
    Refused(Refused),
}

/// A file that was refused, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refused {
    pub file: String,
    pub refused: String,
}

/// How many files were answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    pub identified: usize,
    pub refused: usize,
    /// Had an answer already and were skipped.
    pub kept: usize,
    /// Had an answer of another record, other options or another version.
    pub stale: usize,
}

/// How records are read and identified.
#[derive(Clone, Copy, Debug)]
pub struct How<'a> {
    pub methods: &'a [Method],
    pub settings: &'a Settings,
    pub selection: &'a Selection,
}

impl How<'_> {
    /// As a log of answers keeps it.
    fn described(&self) -> String {
        let Self { methods, settings, selection } = self;
        match selection.is_empty() {
            true => format!("{methods:?} {settings:?}"),
            false => format!("{methods:?} {settings:?} {selection:?}"),
        }
    }
}

/// Reads and identifies one file. A file that cannot be used is an answer; only an interruption is an error.
fn answer(file: &Path, how: How<'_>) -> Result<Answer> {
    interrupt::check()?;
    let found = yawrig_records::read_selected(file, how.selection);
    match found.and_then(|record| Ok(identify(&record, how.methods, how.settings)?)) {
        Ok(found) => Ok(Answer::Identified(Box::new(found))),
        Err(error) if error.exit == yawrig_base::error::Exit::Interrupted => Err(error),
        Err(error) => Ok(Answer::Refused(Refused {
            file: file.display().to_string(),
            refused: named(error).to_string(),
        })),
    }
}

/// What `--json` prints of several records.
#[derive(Debug, Serialize)]
pub struct Object {
    pub schema_version: u32,
    pub records: Vec<Identification>,
    pub refused: Vec<Refused>,
}

/// Identifies records in memory on all cores. `each` is called as one is done.
///
/// # Errors
/// Exit 130 when the user stops it.
pub fn in_memory(
    records: &[Record],
    methods: &[Method],
    settings: &Settings,
    each: impl Fn() + Sync,
) -> Result<Object> {
    let stop = interrupt::stop();
    let one = |record: &Record| {
        stop.check()?;
        let found = identify(record, methods, settings).map_err(|e| Refused {
            file: record.file.display().to_string(),
            refused: named(Error::from(e)).to_string(),
        });
        each();
        Ok(found)
    };
    let found: Vec<_> = records.par_iter().map(one).collect::<Result<_>>()?;
    let (mut records, mut refused) = (Vec::new(), Vec::new());
    for one in found {
        match one {
            Ok(found) => records.push(found),
            Err(why) => refused.push(why),
        }
    }
    Ok(Object { schema_version: SCHEMA_VERSION, records, refused })
}

/// Identifies `files` on all cores and hands every answer to `each` in the order of `files`.
///
/// # Errors
/// Those of `each`, and exit 130 when the user stops it.
pub fn in_order(
    files: &[PathBuf],
    how: How<'_>,
    mut each: impl FnMut(Answer) -> Result<()>,
) -> Result<Tally> {
    let mut tally = Tally::default();
    for chunk in files.chunks(CHUNK) {
        let answers: Vec<Answer> =
            chunk.par_iter().map(|file| answer(file, how)).collect::<Result<_>>()?;
        for answer in answers {
            tally.count(&answer);
            each(answer)?;
        }
    }
    Ok(tally)
}

/// Identifies `files` on all cores and appends a line for each to `out` as it comes, in any order. Files that
/// have a line there already are left alone, so that the same call again goes on where it was stopped; where
/// that line came from another record, other options or another version, it is taken out and made again.
///
/// # Errors
/// Exit 3 where `out` cannot be written, holds something else or is being written by another process, 130
/// when the user stops it; whole lines only.
pub fn to_log(
    files: &[PathBuf],
    how: How<'_>,
    out: &Path,
    progress: impl Fn() + Sync,
) -> Result<Tally> {
    let options = how.described();
    // A device file may never end.
    if out.exists() && !out.is_file() {
        return Err(files::cannot_write(out, &"it is not a file"));
    }
    let mut log = locked(out)?;
    let done = finished(out, &log, &options)?;
    let named = |file: &PathBuf| fingerprint(&file.display().to_string());
    // What gives its bytes only once is asked again.
    let is_kept = |file: &PathBuf| {
        interrupt::check()?;
        let was = done.get(&named(file)).and_then(Option::as_ref);
        Ok(was.is_some_and(|was| yawrig_records::holds(file, was)))
    };
    let kept: Vec<bool> = files.par_iter().map(is_kept).collect::<Result<_>>()?;
    let stale: Vec<u64> = files
        .iter()
        .zip(&kept)
        .filter(|(file, kept)| !**kept && done.contains_key(&named(file)))
        .map(|(file, _)| named(file))
        .collect();
    if !stale.is_empty() {
        without(out, log, &stale)?;
        log = locked(out)?;
    }
    log.seek(std::io::SeekFrom::End(0)).map_err(|e| files::cannot_write(out, &e))?;
    let tally = Tally { stale: stale.len(), ..Tally::default() };
    let state = Mutex::new((log, tally));
    files.par_iter().zip(&kept).try_for_each(|(file, kept)| {
        if *kept {
            state.lock().unwrap_or_else(|e| e.into_inner()).1.kept += 1;
        } else {
            let answer = answer(file, how)?;
            let (log, tally) = &mut *state.lock().unwrap_or_else(|e| e.into_inner());
            tally.count(&answer);
            let content = yawrig_records::content_when_read(file);
            let of = content.map(|content| Source::new(content, &options));
            let line = Line { schema_version: SCHEMA_VERSION, of, answer };
            log.write_all(text(&line)?.as_bytes()).map_err(|e| files::cannot_write(out, &e))?;
        }
        progress();
        Ok::<(), Error>(())
    })?;
    Ok(state.into_inner().unwrap_or_else(|e| e.into_inner()).1)
}

/// `out`, until it is dropped this process's alone.
fn locked(out: &Path) -> Result<File> {
    lock::open(out).map_err(|e| files::cannot_write(out, &e))?.ok_or_else(|| {
        Error::data(format!("{} is being written by another yawrig", out.display()))
            .help("wait for it to end, or give --out another file")
    })
}

/// Takes the lines of these files out of `out`, which is whole at every instant and was locked by `log`.
fn without(out: &Path, log: File, stale: &[u64]) -> Result<()> {
    let old = std::fs::read(out).map_err(|e| files::cannot_write(out, &e))?;
    let is_kept = |line: &&[u8]| {
        let named: Option<Named> = serde_json::from_slice(line).ok();
        named.is_none_or(|named| !stale.contains(&fingerprint(&named.file)))
    };
    let kept: Vec<&[u8]> = old.split_inclusive(|b| *b == b'\n').filter(is_kept).collect();
    // What Windows does not replace is a file that is open.
    let open = (!cfg!(windows)).then_some(log);
    files::write_atomically(out, &kept.concat())?;
    drop(open);
    Ok(())
}

/// One line of JSON, its end included.
pub fn line(answer: Answer) -> Result<String> {
    text(&Line { schema_version: SCHEMA_VERSION, of: None, answer })
}

fn text(line: &Line) -> Result<String> {
    let mut text = serde_json::to_string(line).map_err(|e| Error::internal(e.to_string()))?;
    text.push('\n');
    Ok(text)
}

/// What a line of answers is about.
#[derive(Deserialize)]
struct Named {
    file: String,
    #[serde(default)]
    of: Option<Source>,
}

/// The files that have a whole line in `out`, by fingerprints of their names, and what was in them; nothing
/// where options or version were others. A last line without an end, left by a power cut, is taken off.
fn finished(out: &Path, log: &File, options: &str) -> Result<HashMap<u64, Option<Content>>> {
    let mut done = HashMap::new();
    let fail = |e: &dyn std::fmt::Display| Error::data(format!("{}: {e}", out.display()));
    let mut reader = BufReader::new(log);
    let (mut text, mut whole, mut number) = (Vec::new(), 0u64, 0);
    while reader.read_until(b'\n', &mut text).map_err(|e| fail(&e))? > 0 {
        number += 1;
        let foreign = || {
            Error::data(format!("{}, line {number}: not a line of results", out.display()))
                .help("give --out a new file, or one that identify wrote")
        };
        if text.last() != Some(&b'\n') {
            if !text.starts_with(&LINE_START[..text.len().min(LINE_START.len())]) {
                return Err(foreign());
            }
            log.set_len(whole).map_err(|e| fail(&e))?;
            break;
        }
        let named: Named = serde_json::from_slice(&text).map_err(|_| foreign())?;
        done.insert(fingerprint(&named.file), named.of.and_then(|of| of.content(options)));
        whole += text.len() as u64;
        text.clear();
    }
    Ok(done)
}

fn fingerprint(file: &str) -> u64 {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    file.hash(&mut hasher);
    hasher.finish()
}

impl Tally {
    fn count(&mut self, answer: &Answer) {
        match answer {
            Answer::Identified(_) => self.identified += 1,
            Answer::Refused(_) => self.refused += 1,
        }
    }
}
