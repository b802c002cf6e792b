//! Which sessions are stored in a folder, from their logs and the ends of their traces alone.

use super::item::{time_s, Item};
use super::stored::{files, lines, row};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use yawrig_shared::wire::Event;

/// Bytes of a trace that hold its first or its last line.
const END: u64 = 256;

/// A stored session, as a list shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// The common name of its files, for [`super::stored::Stored::open`].
    pub stem: PathBuf,
    /// When it began; of a log that does not say so, when it was last written.
    pub started: SystemTime,
    /// None where the trace cannot be read.
    pub duration_s: Option<f64>,
    pub releases: usize,
    pub marks: usize,
    /// Whether it was ended as it should.
    pub is_finished: bool,
    /// Something in its log or its trace cannot be read.
    pub is_damaged: bool,
}

/// The sessions that lie in these folders, newest first. Folders that cannot be read hold none.
pub fn list(folders: &[PathBuf]) -> Vec<Listed> {
    let mut stems = BTreeSet::new();
    for folder in folders {
        for entry in folder.read_dir().into_iter().flatten().flatten() {
            let path = entry.path();
            let text = path.as_os_str().to_string_lossy();
            let stem = [".jsonl", ".csv.partial"].iter().find_map(|end| text.strip_suffix(end));
            // Two folders may be one.
            if let (Some(stem), Ok(place)) = (stem, folder.canonicalize()) {
                let name = Path::new(stem).file_name().unwrap_or_default().to_owned();
                stems.insert((place, name, PathBuf::from(stem)));
            }
        }
    }
    let mut seen = BTreeSet::new();
    let once =
        stems.into_iter().filter(|(place, name, _)| seen.insert((place.clone(), name.clone())));
    let mut all: Vec<Listed> = once.filter_map(|(_, _, stem)| listed(stem)).collect();
    all.sort_by(|a, b| b.started.cmp(&a.started).then_with(|| b.stem.cmp(&a.stem)));
    all
}

/// None where the files are not those of a session: other logs of this program are lines of JSON, too.
fn listed(stem: PathBuf) -> Option<Listed> {
    let [log, whole, partial] = files(&stem);
    let is_finished = whole.is_file();
    let has_trace = is_finished || partial.is_file();
    // Another log may be long.
    if !has_trace && !begins_a_session(&log) {
        return None;
    }
    let objects: Vec<Option<Value>> = lines(&log)
        .unwrap_or_default()
        .iter()
        .map(|(_, line)| serde_json::from_str(line).ok())
        .collect();
    let event = |object: &Value| object["event"].as_str().map(str::to_owned);
    let kinds: Vec<Option<String>> = objects.iter().flatten().map(event).collect();
    let begins = kinds.first().is_some_and(|kind| kind.as_deref() == Some("session"));
    // A record may have the name of some other log.
    if is_finished && kinds.iter().all(Option::is_none) {
        return None;
    }
    let trace = if is_finished { whole } else { partial };
    let duration_s = duration_s(&trace);
    let started = objects
        .iter()
        .flatten()
        .find_map(|o| humantime::parse_rfc3339(o["started"].as_str()?).ok());
    let written = || [&log, &trace].into_iter().find_map(|f| f.metadata().ok()?.modified().ok());
    let is = |kind: &str| kinds.iter().filter(|k| k.as_deref() == Some(kind)).count();
    let releases = objects.iter().flatten().filter(|object| {
        matches!(Item::from_json(object), Some(Item::Event { event: Event::Release(_), .. }))
    });
    Some(Listed {
        started: started.or_else(written).unwrap_or(SystemTime::UNIX_EPOCH),
        releases: releases.count(),
        marks: is("mark"),
        is_finished,
        is_damaged: !begins || objects.contains(&None) || duration_s.is_none(),
        duration_s,
        stem,
    })
}

/// Whether the first line of a log is that of a session.
fn begins_a_session(log: &Path) -> bool {
    let mut bytes = Vec::new();
    let first = File::open(log).and_then(|file| file.take(4 * END).read_to_end(&mut bytes));
    let line = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    let object: Option<Value> = serde_json::from_slice(line).ok();
    first.is_ok() && object.is_some_and(|object| object["event"] == "session")
}

/// From the first sample to the last.
fn duration_s(trace: &Path) -> Option<f64> {
    let mut file = File::open(trace).ok()?;
    let length = file.metadata().ok()?.len();
    let mut part = |from: u64| {
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(from)).ok()?;
        file.by_ref().take(END).read_to_end(&mut bytes).ok()?;
        Some(String::from_utf8_lossy(&bytes).into_owned())
    };
    let (head, tail) = (part(0)?, part(length.saturating_sub(END))?);
    let Some(first) = head.lines().nth(1) else { return Some(0.0) };
    let first = row(first)?.0;
    // What an interruption has cut off is no line.
    let last = row(tail.rsplit_once('\n')?.0.lines().next_back()?)?.0;
    last.checked_sub(first).map(|count| time_s(count + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_are_told_from_other_logs_and_come_newest_first() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let begun = |year: u32| {
            format!("{{\"event\":\"session\",\"started\":\"{year}-01-01T00:00:00Z\"}}\n")
        };
        let mark = "{\"event\":\"mark\",\"time_s\":1.5,\"text\":\"wind on\"}\n";
        let trace = "time_s,yaw_deg\n1.000,0.500000\n1.001,0.500000\n1.002,0.5";
        write("old.jsonl", &begun(2001));
        write("old.csv.partial", trace);
        write("new.jsonl", &format!("{}{mark}{{\"event\":\"ma", begun(2003)));
        write("new.csv", trace);
        write("inside/torn.jsonl", &format!("{}no JSON\n", begun(2002)));
        // A log that was lost, and logs of other kinds, one beside a record of its name.
        write("inside/alone.csv.partial", trace);
        write("results.jsonl", "{\"file\":\"a.csv\"}\n");
        write("a.jsonl", "{\"file\":\"a.csv\"}\n");
        write("a.csv", trace);
        write("empty.jsonl", "");
        let inside = folder.path().join("inside");
        let found = list(&[folder.path().to_owned(), inside.clone(), inside.join("../inside")]);
        let named: Vec<_> = (found.iter())
            .map(|s| {
                (
                    s.stem.file_name().unwrap().to_str().unwrap(),
                    s.is_finished,
                    s.is_damaged,
                    s.marks,
                )
            })
            .collect();
        let expected = [
            // When its trace was written: now.
            ("alone", false, true, 0),
            ("new", true, false, 1),
            ("torn", false, true, 0),
            ("old", false, false, 0),
        ];
        assert_eq!(named, expected);
        assert_eq!(
            found.iter().map(|s| s.duration_s).collect::<Vec<_>>(),
            [Some(0.002), Some(0.002), None, Some(0.002)]
        );
        assert_eq!(list(&[folder.path().join("nowhere")]), []);
    }
}
