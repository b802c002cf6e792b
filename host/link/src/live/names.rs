//! What the files of a recording are called.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;

pub(super) fn with(stem: &Path, end: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(end);
    name.into()
}

pub(super) fn partial(stem: &Path) -> PathBuf {
    with(stem, ".csv.partial")
}

fn taken(stem: &Path) -> Option<PathBuf> {
    let files = [with(stem, ".csv"), partial(stem), with(stem, ".jsonl")];
    files.into_iter().find(|file| file.exists())
}

/// The name of a recording at `place`: a CSV file that is not there, or a folder for any number of them.
pub(super) fn stem(place: &Path) -> Result<PathBuf> {
    if place.extension().is_some_and(|e| e == "csv") {
        let stem = place.with_extension("");
        return match taken(&stem) {
            None => Ok(stem),
            Some(file) => Err(Error::data(format!("{} is there already", file.display()))
                .help("give the recording another name: none is ever written over")),
        };
    }
    files::make_folder(place)?;
    let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string().replace(':', "-");
    let numbered = |n: u32| match n {
        1 => place.join(&now),
        n => place.join(format!("{now}-{n}")),
    };
    (1..1000)
        .map(numbered)
        .find(|stem| taken(stem).is_none())
        .ok_or_else(|| files::cannot_write(place, &"too many recordings begin in this second"))
}

pub(super) fn create(file: &Path) -> Result<File> {
    let new = File::options().append(true).create_new(true).open(file);
    new.map_err(|e| files::cannot_write(file, &e))
}
