//! A record of a session, read once and when it is first wanted.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use yawrig_base::error::Error;
use yawrig_records::place::{parted, Part};
use yawrig_records::Selection;
use yawrig_report::view::Loaded;

/// A record, read once and when it is first wanted.
#[derive(Debug)]
pub struct RecordSource {
    pub path: PathBuf,
    /// The record of which it is what lies between two times, or itself.
    pub origin: PathBuf,
    pub reading: Selection,
    pub wind_speed_m_s: f64,
    pub(super) loaded: OnceLock<std::result::Result<Loaded, Error>>,
}

impl RecordSource {
    pub fn loaded(&self) -> std::result::Result<&Loaded, &Error> {
        let read = || Loaded::read(&self.path, &self.origin, &self.reading, self.wind_speed_m_s);
        self.loaded.get_or_init(read).as_ref()
    }

    /// Why nothing can be said about it, once it has been read.
    pub fn fault(&self) -> Option<&Error> {
        match self.loaded.get()? {
            Err(error) => Some(error),
            Ok(loaded) => loaded.decay.as_ref().err(),
        }
    }
}

/// The record that a release is cut from: what it was opened as, but for times between which it was opened.
pub(super) fn origin(path: &Path) -> PathBuf {
    match parted(path) {
        (file, Some(Part::Between(_))) => file,
        _ => path.to_owned(),
    }
}
