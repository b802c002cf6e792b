//! Ctrl-C as a flag that long loops ask, so that files and child processes are put away on the way out; and tasks
//! that can be stopped while the program goes on.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use yawrig_expression::error::{Error, Result};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

thread_local! {
    static TASK: RefCell<Option<Task>> = const { RefCell::new(None) };
}

/// Work that can be stopped by itself. The threads that do it say so with [`Task::is_done_here`].
#[derive(Clone, Debug, Default)]
pub struct Task(Arc<State>);

#[derive(Debug, Default)]
struct State {
    stopped: AtomicBool,
    looks: AtomicU64,
}

impl Task {
    /// From now on [`requested`] and [`check`] in this thread also heed this task.
    pub fn is_done_here(&self) {
        TASK.set(Some(self.clone()));
    }

    pub fn stop(&self) {
        self.0.stopped.store(true, Ordering::SeqCst);
    }

    /// Ready for the next piece of work.
    pub fn begin(&self) {
        self.0.looks.store(0, Ordering::Relaxed);
        self.0.stopped.store(false, Ordering::SeqCst);
    }

    /// How often its threads have asked since it began: it grows as long as the work goes on.
    pub fn looks(&self) -> u64 {
        self.0.looks.load(Ordering::Relaxed)
    }

    fn is_stopped(&self) -> bool {
        self.0.looks.fetch_add(1, Ordering::Relaxed);
        self.0.stopped.load(Ordering::SeqCst)
    }
}

/// From now on everything is asked to stop; whether it was already.
pub fn request() -> bool {
    INTERRUPTED.swap(true, Ordering::SeqCst)
}

/// Whether the user has asked to stop.
pub fn requested() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
        || TASK.with_borrow(|task| task.as_ref().is_some_and(Task::is_stopped))
}

/// `Err` with exit code 130 once the user has asked to stop.
pub fn check() -> Result<()> {
    if requested() {
        Err(Error::interrupted())
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_is_stopped_in_its_own_threads_only() {
        let task = Task::default();
        let theirs = task.clone();
        let asked = std::thread::spawn(move || {
            theirs.is_done_here();
            let before = requested();
            theirs.stop();
            let stopped = requested();
            theirs.begin();
            (before, stopped, requested())
        });
        assert_eq!(asked.join().unwrap(), (false, true, false));
        assert_eq!(task.looks(), 1);
        task.stop();
        assert!(check().is_ok());
    }
}
