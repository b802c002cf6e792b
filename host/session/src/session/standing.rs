//! The model and its journal as they are on the disk.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::Path;
use std::sync::Arc;
use yawrig_base::disk::{self, Seen};
use yawrig_base::error::Error;
use yawrig_model::document::{read_text, Model};
use yawrig_model::edits;
use yawrig_model::journal::{path_of, Journal, JournalStep};
use yawrig_model::records::{self};

/// The model and its journal as they are on the disk.
#[derive(Clone, Debug, Default)]
pub struct Standing {
    pub model: Option<Arc<Model>>,
    pub steps: Arc<Vec<JournalStep>>,
    /// The file was changed since the last step.
    pub is_edited: bool,
    /// Records that have changed since the model was fitted to them.
    pub changed: Vec<String>,
    /// Why it cannot be used.
    pub fault: Option<Error>,
    /// Hash of the model's text; 0 without one.
    pub key: u64,
}

impl Standing {
    pub fn read(path: &Path) -> Self {
        let journal = Journal::new(path);
        let fault = journal.as_ref().err().cloned();
        let steps = Arc::new(journal.map(|j| j.steps).unwrap_or_default());
        if !disk::exists(path) {
            return Self { steps, fault, ..Self::default() };
        }
        let read = || {
            let text = read_text(path)?;
            let model = Model::parse(&text, path)?;
            let model = edits::seen(model, &text, path, &steps);
            Ok((text, model))
        };
        match read() {
            Ok((text, model)) => {
                let mut hasher = DefaultHasher::new();
                text.hash(&mut hasher);
                Self {
                    is_edited: steps.last().map(|s| s.model.as_str()) != Some(text.as_str()),
                    changed: model
                        .records
                        .iter()
                        .filter(|e| records::changed(e, &Model::record_path(path, e)).is_some())
                        .map(|e| e.file.clone())
                        .collect(),
                    key: hasher.finish().max(1),
                    model: Some(Arc::new(model)),
                    steps,
                    fault,
                }
            }
            Err(error) => Self { steps, fault: Some(error), ..Self::default() },
        }
    }
}

/// Fingerprint of the files' state, without reading them.
pub(super) type Stamp = [Option<Seen>; 2];

pub(super) fn stamp(path: &Path) -> Stamp {
    [disk::seen(path), disk::seen(&path_of(path))]
}
