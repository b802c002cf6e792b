//! What takes longer than a click: a queue of one, and how its piece gets on.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt::Task;
use yawrig_session::job::{Ended, Job, Progress};

/// Longest sleep of the worker's thread.
const NAP: Duration = Duration::from_millis(200);

/// How long a page may take to be opened after the start.
const FIRST_PAGE: Duration = Duration::from_secs(3);

#[derive(Default)]
struct Queue {
    waiting: Option<Job>,
    running: Option<(String, Instant)>,
    is_stopping: bool,
    /// Releases that a page wants to see, the latest last.
    wanted: Vec<usize>,
    ended: Option<Ended>,
    count: u64,
}

pub struct Work {
    queue: Mutex<Queue>,
    bell: Condvar,
    task: Task,
    pool: rayon::ThreadPool,
    begun: Instant,
}

impl Work {
    /// # Errors
    /// Where the system has no threads to give.
    pub fn new() -> Result<Self> {
        let task = Task::default();
        let theirs = task.clone();
        let pool = rayon::ThreadPoolBuilder::new()
            .thread_name(|k| format!("fit-{k}"))
            .start_handler(move |_| theirs.is_done_here())
            .build()
            .map_err(|e| Error::internal(format!("cannot start threads: {e}")))?;
        Ok(Self {
            queue: Mutex::default(),
            bell: Condvar::new(),
            task,
            pool,
            begun: Instant::now(),
        })
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// # Errors
    /// Exit 2 where another piece is being worked on.
    pub fn begin(&self, job: Job) -> Result<()> {
        let mut queue = self.queue();
        let busy =
            queue.running.as_ref().map(|r| r.0.clone()).or(queue.waiting.as_ref().map(Job::what));
        if let Some(busy) = busy {
            return Err(Error::usage(format!("not now: {busy} is under way"))
                .help("wait for it, or cancel it"));
        }
        queue.waiting = Some(job);
        queue.ended = None;
        drop(queue);
        self.wake();
        Ok(())
    }

    /// Stops what the user asked for; what is made ready in the background goes on.
    pub fn cancel(&self) {
        let mut queue = self.queue();
        queue.waiting = None;
        if queue.running.is_some() {
            queue.is_stopping = true;
            self.task.stop();
        }
    }

    /// Release `id` is looked at: it comes first.
    pub fn want(&self, id: usize) {
        let mut queue = self.queue();
        queue.wanted.retain(|k| *k != id);
        queue.wanted.push(id);
        drop(queue);
        self.wake();
    }

    pub fn wake(&self) {
        self.bell.notify_all();
    }

    pub fn progress(&self) -> Option<Progress> {
        let queue = self.queue();
        let (what, since) = queue.running.as_ref()?;
        Some(Progress {
            what: what.clone(),
            seconds: since.elapsed().as_secs_f64(),
            looks: self.task.looks(),
            is_stopping: queue.is_stopping,
        })
    }

    pub fn ended(&self) -> Option<Ended> {
        self.queue().ended.clone()
    }

    /// Takes the next job; from here on Cancel refers to it.
    pub fn next(&self) -> Option<Job> {
        let mut queue = self.queue();
        let job = queue.waiting.take()?;
        self.task.begin();
        queue.running = Some((job.what(), Instant::now()));
        queue.is_stopping = false;
        Some(job)
    }

    /// How a piece ended.
    pub fn end(&self, job: &Job, done: Result<String>) {
        let mut queue = self.queue();
        let was_stopped = std::mem::take(&mut queue.is_stopping);
        queue.running = None;
        queue.count += 1;
        let (message, help, is_error) = match done {
            Ok(message) => (message, String::new(), false),
            Err(_) if was_stopped => {
                ("cancelled; nothing is changed".to_owned(), String::new(), false)
            }
            Err(error) => (error.message, error.help, true),
        };
        queue.ended =
            Some(Ended { job: job.clone(), message, help, is_error, number: queue.count });
        drop(queue);
        self.task.begin();
    }

    /// The releases that pages look at, the latest first; none while the first page is still to come, whose
    /// first picture is to have the machine to itself.
    pub fn wanted(&self) -> Option<Vec<usize>> {
        let wanted: Vec<usize> = self.queue().wanted.iter().rev().copied().collect();
        (self.begun.elapsed() >= FIRST_PAGE || !wanted.is_empty()).then_some(wanted)
    }

    /// Until there is something new to do, or for a moment.
    pub fn nap(&self) {
        let queue = self.queue();
        if queue.waiting.is_none() {
            let _ = self.bell.wait_timeout(queue, NAP);
        }
    }

    /// On all cores, where Cancel reaches it.
    pub fn on_all_cores<T: Send>(&self, what: impl FnOnce() -> T + Send) -> T {
        self.pool.install(what)
    }

    /// The same for what nobody has asked for.
    pub fn in_background(&self, what: impl FnOnce() + Send) {
        self.task.begin();
        self.pool.install(what);
    }
}
