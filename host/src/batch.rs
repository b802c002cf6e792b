//! Many records: on all cores, in memory that does not grow with their number, resumable.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_core::identify::{identify, Identification, Method, Settings};

/// Version of what is written.
pub const SCHEMA_VERSION: u32 = 1;
/// How every line begins.
const LINE_START: &[u8] = br#"{"schema_version":"#;
/// Files identified at the same time before their answers are passed on in order.
const CHUNK: usize = 64;

/// One file's answer, a line of `--jsonl`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Line {
    pub schema_version: u32,
    #[serde(flatten)]
    pub answer: Answer,
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
}

/// Reads and identifies one file. A file that cannot be used is an answer; only an interruption is an error.
fn answer(file: &Path, methods: &[Method], settings: &Settings) -> Result<Answer> {
    interrupt::check()?;
    match yawrig_records::read(file).and_then(|record| Ok(identify(&record, methods, settings)?)) {
        Ok(found) => Ok(Answer::Identified(Box::new(found))),
        Err(error) if error.exit == yawrig_base::error::Exit::Interrupted => Err(error),
        Err(error) => Ok(Answer::Refused(Refused {
            file: file.display().to_string(),
            refused: error.to_string(),
        })),
    }
}

/// Identifies `files` on all cores and hands every answer to `each` in the order of `files`.
///
/// # Errors
/// Those of `each`, and exit 130 when the user stops it.
pub fn in_order(
    files: &[PathBuf],
    methods: &[Method],
    settings: &Settings,
    mut each: impl FnMut(Answer) -> Result<()>,
) -> Result<Tally> {
    let mut tally = Tally::default();
    for chunk in files.chunks(CHUNK) {
        let answers: Vec<Answer> =
            chunk.par_iter().map(|file| answer(file, methods, settings)).collect::<Result<_>>()?;
        for answer in answers {
            tally.count(&answer);
            each(answer)?;
        }
    }
    Ok(tally)
}

/// Identifies `files` on all cores and appends a line for each to `out` as it comes, in any order. Files that have a
/// line there already are left alone, so that the same call again goes on where it was stopped.
///
/// # Errors
/// Exit 3 where `out` cannot be written or holds something else, 130 when the user stops it; whole lines only.
pub fn to_log(
    files: &[PathBuf],
    methods: &[Method],
    settings: &Settings,
    out: &Path,
    progress: impl Fn() + Sync,
) -> Result<Tally> {
    let done = finished(out)?;
    let log = OpenOptions::new()
        .create(true)
        .append(true)
        .open(out)
        .map_err(|e| files::cannot_write(out, &e))?;
    let state = Mutex::new((log, Tally::default()));
    files.par_iter().try_for_each(|file| {
        if done.contains(&fingerprint(&file.display().to_string())) {
            state.lock().unwrap_or_else(|e| e.into_inner()).1.kept += 1;
        } else {
            let answer = answer(file, methods, settings)?;
            let (log, tally) = &mut *state.lock().unwrap_or_else(|e| e.into_inner());
            tally.count(&answer);
            log.write_all(line(answer)?.as_bytes()).map_err(|e| files::cannot_write(out, &e))?;
        }
        progress();
        Ok::<(), Error>(())
    })?;
    Ok(state.into_inner().unwrap_or_else(|e| e.into_inner()).1)
}

/// One line of JSON, its end included.
pub fn line(answer: Answer) -> Result<String> {
    let line = Line { schema_version: SCHEMA_VERSION, answer };
    let mut text = serde_json::to_string(&line).map_err(|e| Error::internal(e.to_string()))?;
    text.push('\n');
    Ok(text)
}

/// The files that have a whole line in `out`, by fingerprint: eight bytes each whatever their names. A last line
/// without an end, left by a power cut, is taken off.
fn finished(out: &Path) -> Result<HashSet<u64>> {
    #[derive(Deserialize)]
    struct Named {
        file: String,
    }
    let mut done = HashSet::new();
    // A device file may never end.
    if out.exists() && !out.is_file() {
        return Err(files::cannot_write(out, &"it is not a file"));
    }
    let log = match File::open(out) {
        Ok(log) => log,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(done),
        Err(e) => return Err(files::cannot_write(out, &e)),
    };
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
            let log = OpenOptions::new().write(true).open(out).map_err(|e| fail(&e))?;
            log.set_len(whole).map_err(|e| fail(&e))?;
            break;
        }
        let named: Named = serde_json::from_slice(&text).map_err(|_| foreign())?;
        done.insert(fingerprint(&named.file));
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
