//! Ctrl-C as a request that long loops heed, so that files and child processes are put away on the way out;
//! and tasks that can be stopped while the program goes on.

use crate::error::Result;
use std::cell::RefCell;
use std::sync::LazyLock;
use yawrig_core::stop::Stop;

static PROGRAM: LazyLock<Stop> = LazyLock::new(Stop::default);

thread_local! {
    static TASK: RefCell<Option<Stop>> = const { RefCell::new(None) };
}

/// Work that can be stopped by itself. The threads that do it say so with [`Task::is_done_here`].
#[derive(Clone, Debug)]
pub struct Task(Stop);

impl Default for Task {
    fn default() -> Self {
        Self(PROGRAM.child())
    }
}

impl Task {
    /// From now on [`requested`], [`check`] and [`stop`] in this thread also heed this task.
    pub fn is_done_here(&self) {
        TASK.set(Some(self.0.clone()));
    }

    pub fn stop(&self) {
        self.0.request();
    }

    /// Ready for the next piece of work.
    pub fn begin(&self) {
        self.0.renew();
    }

    /// How often its threads have asked since it began: it grows as long as the work goes on.
    pub fn looks(&self) -> u64 {
        self.0.looks()
    }
}

/// From now on everything is asked to stop; whether it was already.
pub fn request() -> bool {
    PROGRAM.request()
}

/// What work begun in this thread heeds, wherever it is done.
pub fn stop() -> Stop {
    TASK.with_borrow(|task| task.clone()).unwrap_or_else(|| PROGRAM.clone())
}

/// Whether the user has asked to stop.
pub fn requested() -> bool {
    TASK.with_borrow(|task| task.as_ref().unwrap_or(&PROGRAM).is_requested())
}

/// `Err` with exit code 130 once the user has asked to stop.
pub fn check() -> Result<()> {
    Ok(stop().check()?)
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
