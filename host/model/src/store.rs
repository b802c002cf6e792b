//! A model and its journal on the disk: one process at a time, and consistent after a power cut.
//!
//! A step is written in this order: the new model under a name of its own beside the file, the line in the
//! journal, then the new model in the old one's place; each is on the disk before the next is begun. The next
//! command finds what a crash has left: a new model that the journal knows is put in its place, one that it
//! does not know is deleted, and part of a line is cut off.

use crate::document::{read_text, Model};
use crate::edits;
use crate::journal::{path_of, Action, Journal, JournalStep};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use yawrig_base::disk::{self, File};
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_base::lock;

/// How often a lock is asked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// A model with its journal, locked against other processes.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    journal: Journal,
    file: File,
    /// The model's file as it was found.
    text: Option<String>,
}

impl Store {
    /// Locks and reads the model at `path` and its journal, either of which may be missing, and clears up
    /// after a crash. Waits where another process is at work on the model, and says so.
    ///
    /// # Errors
    /// Exit 3 where they cannot be read or written, 130 where the user stops the waiting.
    pub fn open(path: &Path) -> Result<Self> {
        files::check_writable(path)?;
        let journal_path = path_of(path);
        let mut file = locked(&journal_path)?;
        let mut bytes = Vec::new();
        file.rewind()
            .and_then(|()| file.read_to_end(&mut bytes))
            .map_err(|e| files::cannot_write(&journal_path, &e))?;
        let journal = Journal::parse(&bytes, &journal_path)?;
        journal.warn(path);
        let mut store = Self { path: path.to_owned(), journal, file, text: None };
        store.recover(bytes.len())?;
        if disk::exists(path) {
            store.text = Some(read_text(path)?);
        }
        Ok(store)
    }

    fn recover(&mut self, length: usize) -> Result<()> {
        if length > self.journal.whole {
            yawrig_base::say!(
                "{}: an unfinished last line, left by a crash, is cut off",
                path_of(&self.path).display()
            );
            self.cut()?;
        }
        let next = next_of(&self.path);
        let Ok(text) = disk::read_to_string(&next) else { return Ok(()) };
        match self.journal.last() {
            Some(last) if last.model == text => {
                yawrig_base::say!(
                    "{}: step {}, which a crash had cut short, is completed",
                    self.path.display(),
                    last.step
                );
                self.put_in_place(&next)
            }
            _ => disk::remove_file(&next).map_err(|e| files::cannot_write(&next, &e)),
        }
    }

    /// Takes off what follows the journal's whole lines.
    fn cut(&self) -> Result<()> {
        self.file
            .set_len(self.journal.whole as u64)
            .and_then(|()| self.file.sync_all())
            .map_err(|e| files::cannot_write(&path_of(&self.path), &e))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// The text of the model's file; None where there is none.
    pub fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

    /// The model in the file; None where there is none.
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn model(&self) -> Result<Option<Model>> {
        let Some(text) = self.text.as_deref() else { return Ok(None) };
        Ok(Some(edits::seen(
            Model::parse(text, &self.path)?,
            text,
            &self.path,
            &self.journal.steps,
        )))
    }

    /// Whether the file was changed since the last step.
    pub fn is_edited(&self) -> bool {
        self.text.is_some() && self.text.as_deref() != self.journal.last().map(|s| s.model.as_str())
    }

    /// Appends `step` to the journal and puts its model in the file. A file that was edited since the last
    /// step is journaled first. Returns the step's number.
    ///
    /// # Errors
    /// Exit 3 where they cannot be written; then both are as they were.
    pub fn commit(mut self, mut step: JournalStep) -> Result<usize> {
        let mut lines = String::new();
        let mut number = self.journal.count();
        if self.is_edited() {
            number += 1;
            let text = self.text.clone().unwrap_or_default();
            let edit = JournalStep { step: number, ..JournalStep::now(Action::Edit, "", text) };
            lines.push_str(&edit.line()?);
        }
        step.step = number + 1;
        lines.push_str(&step.line()?);
        let next = next_of(&self.path);
        let done = self.write_next(&next, &step.model).and_then(|()| self.append(&lines));
        if let Err(error) = done {
            let _ = disk::remove_file(&next);
            let _ = self.cut();
            return Err(error);
        }
        // From here on the step counts.
        self.journal.whole += lines.len();
        self.put_in_place(&next)?;
        Ok(step.step)
    }

    fn write_next(&self, next: &Path, text: &str) -> Result<()> {
        File::create(next)
            .and_then(|mut file| file.write_all(text.as_bytes()).and_then(|()| file.sync_all()))
            .map_err(|e| files::cannot_write(&self.path, &e))
    }

    fn append(&mut self, lines: &str) -> Result<()> {
        self.file
            .seek(SeekFrom::End(0))
            .and_then(|_| self.file.write_all(lines.as_bytes()))
            .and_then(|()| self.file.sync_all())
            .and_then(|()| sync_folder(&self.path))
            .map_err(|e| files::cannot_write(&path_of(&self.path), &e))
    }

    fn put_in_place(&self, next: &Path) -> Result<()> {
        disk::rename(next, &self.path)
            .and_then(|()| sync_folder(&self.path))
            .map_err(|e| files::cannot_write(&self.path, &e))
    }
}

impl Drop for Store {
    /// Deletes a journal to which nothing was written, while its lock is held.
    fn drop(&mut self) {
        if self.journal.whole == 0 {
            let _ = disk::remove_file(path_of(&self.path));
        }
    }
}

/// Opens (or makes) the journal and takes its lock.
fn locked(path: &Path) -> Result<File> {
    let mut warned = false;
    loop {
        let found = lock::open(path).map_err(|e| match e.kind() {
            ErrorKind::PermissionDenied => files::cannot_write(path, &"you may not write there"),
            _ => files::cannot_write(path, &e),
        })?;
        if let Some(file) = found {
            return Ok(file);
        }
        if !std::mem::replace(&mut warned, true) {
            yawrig_base::say!(
                "{}: another yawrig is at work on this model; waiting",
                path.display()
            );
        }
        interrupt::check()?;
        std::thread::sleep(PATIENCE);
    }
}

/// Temporary name of a new model: `.model.toml.next`.
fn next_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.next"))
}

fn sync_folder(path: &Path) -> std::io::Result<()> {
    // Elsewhere the system keeps its folders by itself.
    if !cfg!(unix) {
        return Ok(());
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    File::open(folder)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::journal::Residuals;

    fn take(path: &Path, text: &str) -> usize {
        Store::open(path)
            .unwrap()
            .commit(JournalStep::now(Action::Fit, "fit", text.into()))
            .unwrap()
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = folder.read_dir().unwrap().flatten();
        let mut names: Vec<String> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    fn models(path: &Path) -> Vec<String> {
        Journal::new(path).unwrap().steps.into_iter().map(|s| s.model).collect()
    }

    #[test]
    fn steps_are_kept_in_order_and_the_last_is_in_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        assert_eq!(take(&path, "a"), 1);
        assert_eq!(take(&path, "b"), 2);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "b");
        assert_eq!(models(&path), ["a", "b"]);
        assert_eq!(names(folder.path()), ["m.journal.jsonl", "m.toml"]);
    }

    #[test]
    fn a_store_that_nothing_is_put_in_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        drop(Store::open(&path).unwrap());
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn an_edited_file_is_journaled_before_it_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        std::fs::write(&path, "from a colleague").unwrap();
        assert_eq!(take(&path, "a"), 2);
        std::fs::write(&path, "by hand").unwrap();
        assert!(Store::open(&path).unwrap().is_edited());
        assert_eq!(take(&path, "b"), 4);
        assert_eq!(models(&path), ["from a colleague", "a", "by hand", "b"]);
        assert_eq!(Journal::new(&path).unwrap().steps[2].action, Action::Edit);
    }

    /// Every state in which a crash can leave the three files.
    #[test]
    fn a_crash_at_any_point_leaves_a_state_that_the_next_command_puts_right() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        take(&path, "a");
        let old = std::fs::read(path_of(&path)).unwrap();
        take(&path, "b");
        let new = std::fs::read(path_of(&path)).unwrap();
        let next = next_of(&path);
        // The new model written, in part or whole, and the journal without its line or with a part of it.
        for waiting in ["", "b"] {
            for length in old.len()..new.len() {
                std::fs::write(&path, "a").unwrap();
                std::fs::write(&next, waiting).unwrap();
                std::fs::write(path_of(&path), &new[..length]).unwrap();
                let store = Store::open(&path).unwrap();
                assert_eq!((store.text(), store.is_edited()), (Some("a"), false));
                drop(store);
                assert_eq!(std::fs::read(path_of(&path)).unwrap(), old);
                assert_eq!(names(folder.path()), ["m.journal.jsonl", "m.toml"]);
            }
        }
        // The line written, the new model not in its place.
        std::fs::write(&path, "a").unwrap();
        std::fs::write(&next, "b").unwrap();
        std::fs::write(path_of(&path), &new).unwrap();
        let store = Store::open(&path).unwrap();
        assert_eq!((store.text(), store.is_edited()), (Some("b"), false));
        drop(store);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "b");
        assert_eq!(names(folder.path()), ["m.journal.jsonl", "m.toml"]);
        // A copy of an older model put there by the user is not taken for a crash.
        std::fs::write(&path, "a").unwrap();
        let store = Store::open(&path).unwrap();
        assert_eq!((store.text(), store.is_edited()), (Some("a"), true));
    }

    #[test]
    fn two_at_once_take_their_steps_one_after_the_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        std::thread::scope(|scope| {
            for k in 0..8 {
                let path = &path;
                scope.spawn(move || take(path, &k.to_string()));
            }
        });
        let mut all = models(&path);
        assert_eq!(all.last(), std::fs::read_to_string(&path).ok().as_ref());
        all.sort();
        assert_eq!(all, ["0", "1", "2", "3", "4", "5", "6", "7"]);
    }

    #[test]
    fn a_journal_of_something_else_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        let text = "{\"not\": 1}\n{\"a\": \"step\"}\n";
        std::fs::write(path_of(&path), text).unwrap();
        let error = Store::open(&path).unwrap_err().to_string();
        assert!(error.contains("m.journal.jsonl:1: not a step"), "{error}");
        assert_eq!(std::fs::read_to_string(path_of(&path)).unwrap(), text);
    }

    #[test]
    fn a_damaged_line_hides_its_own_step_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        for text in ["a", "b", "c"] {
            take(&path, text);
        }
        let text = std::fs::read_to_string(path_of(&path)).unwrap();
        std::fs::write(path_of(&path), text.replacen("\"step\":2", "\"step\":null", 1)).unwrap();
        assert_eq!(take(&path, "d"), 4);
        assert_eq!(models(&path), ["a", "c", "d"]);
        let journal = Journal::new(&path).unwrap();
        assert_eq!(journal.damaged[0].line, 2);
        assert_eq!(journal.step(3).unwrap().model, "c");
        assert!(journal.step(2).unwrap_err().to_string().contains("cannot be read"));
        assert!(std::fs::read_to_string(path_of(&path)).unwrap().contains("\"step\":null"));
    }

    #[test]
    fn a_step_that_could_not_be_read_again_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        take(&path, "a");
        let before = std::fs::read(path_of(&path)).unwrap();
        let mut step = JournalStep::now(Action::Fit, "fit", "b".into());
        let residuals = |residual_rms_deg, held_out_over_noise| Residuals {
            residual_rms_deg,
            residual_over_noise: 1.0,
            held_out_over_noise,
        };
        step.after = Some(residuals(f64::NAN, 1.0));
        let refused = Store::open(&path).unwrap().commit(step.clone()).unwrap_err();
        assert!(refused.to_string().contains("not a number"), "{refused}");
        assert_eq!(std::fs::read(path_of(&path)).unwrap(), before);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "a");
        // Too short a record has nothing to predict: that is no fault.
        step.after = Some(residuals(1.0, f64::NAN));
        assert_eq!(Store::open(&path).unwrap().commit(step).unwrap(), 2);
        assert_eq!(models(&path), ["a", "b"]);
    }
}
