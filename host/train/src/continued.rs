//! What an interrupted training leaves behind so that it can go on: its settings and where it stands.

use super::network_training::Settings;
use super::Checkpoint;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;

const SCHEMA_VERSION: u32 = 1;

/// An unfinished training. Training set and start follow from the settings' seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unfinished {
    schema_version: u32,
    pub settings: Settings,
    pub checkpoint: Checkpoint,
    /// Where its network goes.
    pub out: PathBuf,
}

impl Unfinished {
    pub fn new(settings: Settings, checkpoint: Checkpoint, out: PathBuf) -> Self {
        Self { schema_version: SCHEMA_VERSION, settings, checkpoint, out }
    }

    /// Its file beside the network's: `network.yrn.unfinished`.
    pub fn path(out: &Path) -> PathBuf {
        let mut name = out.as_os_str().to_owned();
        name.push(".unfinished");
        name.into()
    }

    /// # Errors
    /// Exit 3 where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string(self)
            .map_err(|e| Error::internal(format!("cannot write the training's state: {e}")))?;
        files::write_atomically(path, text.as_bytes())
    }

    /// # Errors
    /// Exit 3 for a file that cannot be read or is not one of these.
    pub fn read(path: &Path) -> Result<Self> {
        let refuse = |why: String| {
            Error::data(format!("{}: {why}", path.display()))
                .help("give the .unfinished file that an interrupted `train` has left")
        };
        let text = std::fs::read_to_string(path).map_err(|e| refuse(e.to_string()))?;
        let read: Self = serde_json::from_str(&text)
            .map_err(|e| refuse(format!("not an unfinished training: {e}")))?;
        match read.schema_version {
            SCHEMA_VERSION => Ok(read),
            other => Err(refuse(format!("its schema_version is {other}, not {SCHEMA_VERSION}"))),
        }
    }
}
