//! A session written to files as it comes.
//!
//! `NAME.csv` is the trace, `NAME.jsonl` everything else, `NAME-release-001.csv` and so on one release
//! each. The trace is `NAME.csv.partial` until the recording is ended: what a power cut leaves can be
//! read.

use super::disk::{free_bytes, RESERVE_BYTES};
use super::item::{time_s, Item};
use super::names::{create, partial, stem, with};
use super::releases::{Cut, Releases};
use serde_json::{json, Value};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_records as record;

const HEADER: &[u8] = b"time_s,yaw_deg\n";
/// Bytes of the trace from one look at what is free on the disk to the next.
const LOOK: u64 = RESERVE_BYTES / 128;

/// A session that is being written.
#[derive(Debug)]
pub struct Recording {
    stem: PathBuf,
    trace: File,
    log: File,
    /// Known before, and to be said with the time of what comes first.
    device: Option<Item>,
    /// What the records of releases are cut out of.
    cutting: Releases,
    releases: u32,
    /// What the record of a release is called, where it has a name of its own.
    names: Vec<(u32, String)>,
    samples: u64,
    missing: u64,
    /// Bytes of the trace's whole lines.
    whole: u64,
    /// Samples that came and were not written.
    lost: u64,
    /// Bytes that are left free on the disk, and those of the trace when that was last looked at.
    reserve: u64,
    looked_at: Option<u64>,
    /// There were fewer: no more of the trace is written.
    trace_ended: bool,
}

/// What a recording has come to.
#[derive(Clone, Debug)]
pub struct Finished {
    pub trace: PathBuf,
    pub log: PathBuf,
    pub samples: u64,
    pub missing_samples: u64,
    /// Samples that came and were not written, the last ones.
    pub lost_samples: u64,
    pub releases: u32,
}

impl Finished {
    /// In a line.
    pub fn to_text(&self) -> String {
        let missing = match self.missing_samples {
            0 => "none missing".to_owned(),
            count => format!("{count} missing"),
        };
        let missing = match self.lost_samples {
            0 => missing,
            lost => format!("{missing}, the last {lost} lost because they could not be written"),
        };
        let Self { samples, releases, .. } = self;
        format!("{}: {samples} samples, {missing}, {releases} releases", self.trace.display())
    }
}

impl Recording {
    /// Whether a recording could begin there.
    ///
    /// # Errors
    /// As [`Self::begin`]; nothing but a folder is left.
    pub fn check(place: &Path) -> Result<()> {
        files::check_writable(&partial(&stem(place)?))
    }

    /// Begins a recording: in a folder, which is made, under the time of day, or in a CSV file that is not
    /// there yet. `device` is what is known of the device.
    ///
    /// # Errors
    /// Exit 3 where it cannot be written, or is there already.
    pub fn begin(place: &Path, device: Option<&Item>) -> Result<Self> {
        let stem = stem(place)?;
        let mut trace = create(&partial(&stem))?;
        let log = create(&with(&stem, ".jsonl"))?;
        trace.write_all(HEADER).map_err(|e| files::cannot_write(&partial(&stem), &e))?;
        let mut recording = Self {
            stem,
            trace,
            log,
            device: None,
            cutting: Releases::default(),
            releases: 0,
            names: Vec::new(),
            samples: 0,
            missing: 0,
            whole: HEADER.len() as u64,
            lost: 0,
            reserve: RESERVE_BYTES,
            looked_at: None,
            trace_ended: false,
        };
        recording.write_log(&json!({
            "schema_version": 1,
            "event": "session",
            "started": humantime::format_rfc3339_millis(SystemTime::now()).to_string(),
            "program": concat!("yawrig ", env!("CARGO_PKG_VERSION")),
            "rate_hz": yawrig_shared::window::SAMPLE_RATE_HZ,
        }))?;
        recording.device = device.cloned();
        Ok(recording)
    }

    /// Where the trace is while the recording goes on.
    pub fn trace(&self) -> PathBuf {
        partial(&self.stem)
    }

    /// The folder of all its files.
    pub fn folder(&self) -> PathBuf {
        self.stem.parent().map(Path::to_owned).unwrap_or_default()
    }

    /// The coming record of this release is called so, without the ending; said before its result is put.
    pub fn name(&mut self, release: u32, stem: &str) {
        self.names.push((release, stem.to_owned()));
    }

    /// Leaves so many bytes free on the disk, in place of what an hour takes.
    pub fn leave_free(&mut self, bytes: u64) {
        (self.reserve, self.looked_at) = (bytes, None);
    }

    /// Samples written so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Whether a release that is over waits for its last samples.
    pub fn waits(&self) -> bool {
        self.cutting.waits()
    }

    /// Writes what happened; the records of releases that are whole by that.
    ///
    /// # Errors
    /// Exit 3 where it cannot be written; what was written before stays.
    pub fn put(&mut self, item: &Item) -> Result<Vec<Item>> {
        if let Some(Item::Device { port, device, .. }) = self.device.take() {
            self.write_log(&Item::Device { at: item.at(), port, device }.to_json())?;
        }
        let mut said = Vec::new();
        // Before anything is written, which may fail.
        self.cutting.take(item);
        match item {
            Item::Samples { first, yaw_deg } => {
                if let Some(ended) = self.look_at_the_disk(*first) {
                    self.write_log(&ended.to_json())?;
                    said.push(ended);
                }
                self.put_samples(*first, yaw_deg)?;
            }
            _ => self.write_log(&item.to_json())?,
        }
        if let Item::Gap { count, .. } = item
            && self.cutting.has_begun()
        {
            self.missing += count;
        }
        let cuts = self.cutting.due(item);
        said.extend(self.write_records(cuts)?);
        Ok(said)
    }

    /// Ends the trace where little of the disk is left.
    fn look_at_the_disk(&mut self, at: u64) -> Option<Item> {
        if self.trace_ended || self.looked_at.is_some_and(|before| self.whole < before + LOOK) {
            return None;
        }
        self.looked_at = Some(self.whole);
        let free_bytes = free_bytes(&self.folder()).filter(|free| *free < self.reserve)?;
        self.trace_ended = true;
        Some(Item::TraceEnded { at, free_bytes })
    }

    fn put_samples(&mut self, first: u64, yaw_deg: &[f64]) -> Result<()> {
        let mut text = String::with_capacity(20 * yaw_deg.len());
        for (number, yaw_deg) in (first..).zip(yaw_deg) {
            // Into a string: cannot fail.
            let _ = writeln!(text, "{:.3},{yaw_deg:.6}", time_s(number));
        }
        // Whole lines at a time, so that the file can be read at any moment.
        if self.trace_ended {
            self.lost += yaw_deg.len() as u64;
            return Ok(());
        }
        let failed = self.trace.write_all(text.as_bytes()).err();
        let written = match failed {
            None => text.as_str(),
            Some(_) => self.whole_lines_of(&text),
        };
        let samples = written.lines().count() as u64;
        self.samples += samples;
        self.whole += written.len() as u64;
        self.lost += yaw_deg.len() as u64 - samples;
        failed.map_or(Ok(()), |e| Err(self.full(&e)))
    }

    /// What of `text` came to the disk before it was full, cut back to its last whole line.
    fn whole_lines_of<'t>(&self, text: &'t str) -> &'t str {
        let there = self.trace.metadata().map_or(self.whole, |about| about.len());
        let written = there.saturating_sub(self.whole).min(text.len() as u64) as usize;
        let end =
            text.as_bytes()[..written].iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
        // Where even that fails a reader meets part of a line, as after a power cut.
        let _ = self.trace.set_len(self.whole + end as u64);
        &text[..end]
    }

    fn full(&self, why: &std::io::Error) -> Error {
        let what = format!(
            "cannot write {}: {why}; {} samples are kept, {} are lost",
            self.trace().display(),
            self.samples,
            self.lost
        );
        Error::data(what).help("make room, or record to another disk")
    }

    /// Writes the records of these releases.
    fn write_records(&mut self, cuts: Vec<Cut>) -> Result<Vec<Item>> {
        let mut records = Vec::new();
        for Cut { release, to, rows, missing_samples } in cuts {
            self.releases += 1;
            let file = self.release_file(release);
            record::write_samples(&file, rows.into_iter())?;
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let item = Item::Record { at: to, release, file: name, missing_samples };
            self.write_log(&item.to_json())?;
            // A release is what the session is for: it survives a power cut from here on.
            let synced = self.trace.sync_data().and_then(|()| self.log.sync_data());
            synced.map_err(|e| files::cannot_write(&self.trace(), &e))?;
            records.push(item);
        }
        Ok(records)
    }

    /// By the device's number, which begins anew where that is restarted.
    fn release_file(&mut self, release: u32) -> PathBuf {
        let again = |n: u32| if n == 1 { String::new() } else { format!("-{n}") };
        let named = self.names.iter().position(|(number, _)| *number == release);
        let stem = match named.map(|place| self.names.remove(place)) {
            Some((_, name)) => self.folder().join(name),
            None => with(&self.stem, &format!("-release-{release:03}")),
        };
        (1..)
            .map(|n| with(&stem, &format!("{}.csv", again(n))))
            .find(|file| !file.exists())
            .unwrap_or_else(|| with(&self.stem, "-release.csv"))
    }

    fn write_log(&mut self, object: &Value) -> Result<()> {
        let line = format!("{object}\n");
        let before = self.log.metadata().map(|about| about.len());
        let done = self.log.write_all(line.as_bytes());
        if let (Err(_), Ok(before)) = (&done, before) {
            // Part of a line is no event.
            let _ = self.log.set_len(before);
        }
        done.map_err(|e| files::cannot_write(&with(&self.stem, ".jsonl"), &e))
    }

    /// Ends the recording: the trace gets its name.
    ///
    /// # Errors
    /// Exit 3; the trace stays where it is.
    pub fn finish(mut self) -> Result<(Finished, Vec<Item>)> {
        let is_full = self.lost > 0 && !self.trace_ended;
        let cuts = self.cutting.rest();
        let records = match self.write_records(cuts) {
            Err(_) if is_full => Vec::new(),
            records => records?,
        };
        self.write_log(&json!({
            "schema_version": 1,
            "event": "end",
            "time_s": time_s(self.cutting.next()),
            "samples": self.samples,
            "missing_samples": self.missing,
            "lost_samples": self.lost,
        }))
        .or_else(|full| if is_full { Ok(()) } else { Err(full) })?;
        let (from, to) = (self.trace(), with(&self.stem, ".csv"));
        let fail = |e: std::io::Error| files::cannot_write(&to, &e);
        self.trace.sync_all().and_then(|()| self.log.sync_all()).map_err(fail)?;
        // A link does not take the place of a file that has come there meanwhile.
        match std::fs::hard_link(&from, &to) {
            Ok(()) => std::fs::remove_file(&from).map_err(fail)?,
            Err(e) if e.kind() == ErrorKind::AlreadyExists => return Err(fail(e)),
            // A file system without links.
            Err(_) => std::fs::rename(&from, &to).map_err(fail)?,
        }
        let finished = Finished {
            trace: to,
            log: with(&self.stem, ".jsonl"),
            samples: self.samples,
            missing_samples: self.missing,
            lost_samples: self.lost,
            releases: self.releases,
        };
        Ok((finished, records))
    }
}
