//! Work beside Python: without its lock, heeding Ctrl-C, telling how far it is.

use crate::error::raised;
use pyo3::prelude::*;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::sync::Arc;
use std::time::Duration;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt::Task;

/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(25);
/// What the program's own main thread has.
const STACK: usize = 8 << 20;

/// Where work is done.
#[derive(Clone, Copy, PartialEq)]
pub enum On {
    OneThread,
    AllCores,
}

/// How many are done, of how many.
#[derive(Default)]
pub struct Counter {
    done: AtomicUsize,
    all: AtomicUsize,
}

impl Counter {
    pub fn set(&self, done: usize, all: usize) {
        self.all.store(all, Ordering::Relaxed);
        self.done.fetch_max(done, Ordering::Relaxed);
    }
}

/// Does `work` in threads of its own, which stop on Ctrl-C while this one goes back to Python at once.
pub fn worked<T: Send + 'static>(
    py: Python<'_>,
    on: On,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Counter) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let (task, counter) = (Task::default(), Arc::new(Counter::default()));
    let (sender, mut receiver) = channel();
    let counted = counter.clone();
    let job = move || {
        let done = catch_unwind(AssertUnwindSafe(|| work(&counted)));
        let defect = |_| Err(Error::internal("a defect in yawrig; its message is on stderr"));
        // Nobody waits for it after Ctrl-C.
        let _ = sender.send(done.unwrap_or_else(defect));
    };
    begin(on, &task, job).map_err(|e| raised(py, Error::internal(e)))?;
    let mut told = 0;
    loop {
        let got = py.detach(|| {
            let got = receiver.recv_timeout(LOOK);
            (receiver, got)
        });
        receiver = got.0;
        let seen =
            py.check_signals().and_then(|()| tell(py, progress.as_ref(), &counter, &mut told));
        if let Err(stopped) = seen {
            task.stop();
            return Err(stopped);
        }
        match got.1 {
            Ok(answer) => return answer.map_err(|e| raised(py, e)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(raised(py, Error::internal("the work ended without an answer")))
            }
        }
    }
}

fn begin(
    on: On,
    task: &Task,
    job: impl FnOnce() + Send + 'static,
) -> std::result::Result<(), String> {
    let task = task.clone();
    // A pool of its own, for one thread, too: whatever a thread of it does heeds this task, and that of all
    // of rayon is not there in a process that was forked.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(if on == On::OneThread { 1 } else { 0 })
        .stack_size(STACK)
        .start_handler(move |_| task.is_done_here())
        .build();
    pool.map(|pool| pool.spawn(job)).map_err(|e| e.to_string())
}

fn tell(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    counter: &Counter,
    told: &mut usize,
) -> PyResult<()> {
    let (done, all) = (counter.done.load(Ordering::Relaxed), counter.all.load(Ordering::Relaxed));
    if let Some(progress) = progress.filter(|_| done > *told) {
        progress.call1(py, (done, all))?;
        *told = done;
    }
    Ok(())
}
