//! Records that this process has read already: each file is parsed once, as long as it stays as it is.

use super::table::Selection;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use yawrig_base::disk::{self, Seen};
use yawrig_base::error::Result;
use yawrig_core::identify::several;
use yawrig_core::record::Record;

/// Samples that are kept, of all records together: some 64 MB.
const MAX_SAMPLES: usize = 4_000_000;

/// All of a file's record, and where its releases are once somebody has asked for them.
pub(super) struct Whole {
    pub(super) record: Record,
    releases: OnceLock<Vec<Range<usize>>>,
}

impl Whole {
    pub(super) fn releases(&self) -> &[Range<usize>] {
        self.releases.get_or_init(|| several::releases(&self.record))
    }
}

/// A file as it was when it was read, and how it was read.
#[derive(PartialEq)]
struct Key {
    file: PathBuf,
    /// None of what gives its bytes only once.
    stamp: Option<Seen>,
    /// As it was asked for, and as is kept for its folder.
    reading: [Selection; 2],
}

/// The oldest first.
static READ: Mutex<Vec<(Key, Arc<Whole>)>> = Mutex::new(Vec::new());

/// The record of `file` as `reading` (what is asked, and what is kept for its folder) has it, which `parse`
/// reads where that was not done yet.
///
/// # Errors
/// Those of `parse`.
pub(super) fn whole(
    file: &Path,
    reading: [&Selection; 2],
    parse: impl FnOnce() -> Result<Record>,
) -> Result<Arc<Whole>> {
    // What changes while it is read is taken as it was before, and so read again.
    let (stamp, reading) = (disk::seen(file), reading.map(Clone::clone));
    let key = Key { file: file.to_owned(), stamp, reading };
    let all = || READ.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, whole)) = all().iter().find(|(known, _)| *known == key) {
        return Ok(Arc::clone(whole));
    }
    let whole = Arc::new(Whole { record: parse()?, releases: OnceLock::new() });
    let mut all = all();
    all.retain(|(known, _)| known.file != key.file || known.reading != key.reading);
    all.push((key, Arc::clone(&whole)));
    let mut samples: usize = all.iter().map(|(_, whole)| whole.record.len()).sum();
    while samples > MAX_SAMPLES {
        samples -= all.remove(0).1.record.len();
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn a_file_is_parsed_once_as_long_as_it_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("r.csv");
        let (parsed, none) = (Cell::new(0), Selection::default());
        let rate = Selection { unit: Some("rad/s".into()), ..Selection::default() };
        let read = |selection: &Selection| {
            let parse = || {
                parsed.set(parsed.get() + 1);
                let length = std::fs::read(&file).unwrap().len();
                Ok(Record::new(&file, vec![0.0; length], vec![0.0; length]))
            };
            whole(&file, [selection, &none], parse).unwrap().record.len()
        };
        std::fs::write(&file, "one").unwrap();
        assert_eq!((read(&none), read(&none), parsed.get()), (3, 3, 1));
        // Read in another way it is another record.
        assert_eq!((read(&rate), read(&none), parsed.get()), (3, 3, 2));
        std::fs::write(&file, "longer").unwrap();
        assert_eq!((read(&none), read(&none), parsed.get()), (6, 6, 3));
        // Another file under the same name and of the same length.
        let other = folder.path().join("other");
        std::fs::write(&other, "sixsix").unwrap();
        std::fs::rename(&other, &file).unwrap();
        assert_eq!((read(&none), parsed.get()), (6, 4));
    }
}
