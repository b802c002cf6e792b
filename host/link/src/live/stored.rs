//! A session read back from the files that [`super::recording`] has written.

use super::item::{is_time_s, Item, Windows};
use serde_json::Value;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::STREAM_CHUNK;

/// A stored session.
#[derive(Clone, Debug)]
pub struct Stored {
    /// Its trace: `NAME.csv`, or `NAME.csv.partial` where it was never ended.
    pub trace: PathBuf,
    /// Whether it was ended as it should.
    pub finished: bool,
    /// When it began: RFC 3339, universal time.
    pub started: Option<String>,
    /// All that happened, in the order of its time.
    pub items: Vec<Item>,
}

impl Stored {
    /// Reads a session by any of its files, their common name, or a folder that holds one session.
    ///
    /// # Errors
    /// Exit 3, naming file and line. What an interruption has cut off in the last line is left out.
    pub fn open(path: &Path) -> Result<Self> {
        let [log, whole, partial] = files(&find(path)?);
        let finished = whole.is_file();
        if !finished && !partial.is_file() {
            return Err(Error::data(format!(
                "{}: the trace of this session is not beside its log",
                whole.display()
            ))
            .help("put it back there, or choose another session"));
        }
        let trace = if finished { whole } else { partial };
        let mut started = None;
        let mut windows = Windows::default();
        let mut items = stretches(&samples(&trace)?);
        for (number, line) in lines(&log)? {
            let unreadable = || {
                let what = "this is no line of a session's log: it was changed or cut off";
                Error::data(format!("{}, line {number}: {what}", log.display()))
                    .help("leave this line out of the file, or give another session")
            };
            let object: Value = serde_json::from_str(&line).map_err(|_| unreadable())?;
            match object["event"].as_str() {
                Some("session") => started = object["started"].as_str().map(str::to_owned),
                Some("end") => {}
                _ => {
                    let mut item = Item::from_json(&object).ok_or_else(unreadable)?;
                    if let Item::Event { event, trends, .. } = &mut item {
                        *trends = windows.take(event);
                    }
                    items.push(item);
                }
            }
        }
        // The log has them in the order they came: a window is sent after marks that are set later than it
        // ends.
        items.sort_by_key(Item::at);
        Ok(Self { trace, finished, started, items })
    }
}

/// Log, trace, and trace of a session that was never ended.
pub(super) fn files(stem: &Path) -> [PathBuf; 3] {
    [".jsonl", ".csv", ".csv.partial"].map(|end| {
        let mut name = stem.as_os_str().to_owned();
        name.push(end);
        PathBuf::from(name)
    })
}

fn monitor() -> String {
    format!("`{}`", settings::command("monitor", &[], &[("record", "FOLDER")]))
}

/// The common name of a session's files.
fn find(path: &Path) -> Result<PathBuf> {
    let no_session = |why: String| {
        Error::data(format!("{}: {why}", path.display()))
            .help(format!("give the .jsonl file of a session that {} has stored", monitor()))
    };
    if !path.is_dir() {
        let text = path.as_os_str().to_string_lossy();
        let ends = [".csv.partial", ".jsonl", ".csv"];
        let stem = ends.iter().find_map(|end| text.strip_suffix(end)).unwrap_or(&text);
        let log = PathBuf::from(format!("{stem}.jsonl"));
        if !log.is_file() {
            return Err(no_session(format!("there is no session's log {}", log.display())));
        }
        return Ok(stem.into());
    }
    let entries = path.read_dir().map_err(|e| no_session(e.to_string()))?;
    let mut logs: Vec<PathBuf> = (entries.flatten().map(|entry| entry.path()))
        .filter(|file| file.extension().is_some_and(|e| e == "jsonl"))
        .collect();
    logs.sort();
    match &logs[..] {
        [] => Err(no_session("no session is stored there".to_owned())),
        [log] => Ok(log.with_extension("")),
        [first, .., last] => Err(no_session(format!(
            "{} sessions are stored there, {} to {}",
            logs.len(),
            first.display(),
            last.display()
        ))),
    }
}

/// Whole lines with their numbers.
pub(super) fn lines(file: &Path) -> Result<Vec<(usize, String)>> {
    let bytes = std::fs::read(file).map_err(|e| {
        Error::data(format!("cannot read {}: {e}", file.display()))
            .help(format!("give a session that {} has stored", monitor()))
    })?;
    let text = String::from_utf8_lossy(&bytes);
    let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
    Ok(whole.lines().enumerate().map(|(index, line)| (index + 1, line.to_owned())).collect())
}

/// Number of a sample and its yaw angle in degrees.
pub(super) fn row(line: &str) -> Option<(u64, f64)> {
    let (time_s, yaw_deg) = line.split_once(',')?;
    let time_s: f64 = time_s.parse().ok().filter(|time_s| is_time_s(*time_s))?;
    let yaw_deg: f64 = yaw_deg.parse().ok().filter(|yaw_deg: &f64| yaw_deg.is_finite())?;
    Some(((time_s * f64::from(SAMPLE_RATE_HZ)).round() as u64, yaw_deg))
}

fn samples(trace: &Path) -> Result<Vec<(u64, f64)>> {
    let mut next = 0;
    let mut rows = Vec::new();
    for (number, line) in lines(trace)?.iter().skip(1) {
        let wrong = |what: &str| {
            Error::data(format!("{}, line {number}: {what}", trace.display()))
                .help("leave this line out of the file, or give another session")
        };
        let row = row(line).ok_or_else(|| wrong("not a time and an angle"))?;
        if row.0 < next {
            return Err(wrong("time runs backwards"));
        }
        next = row.0 + 1;
        rows.push(row);
    }
    Ok(rows)
}

/// Stretches without a gap, as long as the device sends them.
fn stretches(samples: &[(u64, f64)]) -> Vec<Item> {
    let mut found: Vec<Item> = Vec::new();
    for &(number, yaw) in samples {
        match found.last_mut() {
            Some(Item::Samples { first, yaw_deg })
                if yaw_deg.len() < STREAM_CHUNK && *first + yaw_deg.len() as u64 == number =>
            {
                yaw_deg.push(yaw);
            }
            _ => found.push(Item::Samples { first: number, yaw_deg: vec![yaw] }),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_in_the_order_of_their_time() {
        let folder = tempfile::tempdir().unwrap();
        let stem = folder.path().join("session");
        let mark =
            |time_s: f64| format!("{{\"event\":\"mark\",\"time_s\":{time_s},\"text\":\"m\"}}\n");
        std::fs::write(stem.with_extension("jsonl"), mark(0.004) + &mark(0.002)).unwrap();
        std::fs::write(stem.with_extension("csv"), "time_s,yaw_deg\n0.001,1\n0.003,2\n").unwrap();
        let stored = Stored::open(&stem).unwrap();
        assert_eq!(stored.items.iter().map(Item::at).collect::<Vec<_>>(), [1, 2, 3, 4]);
    }
}
