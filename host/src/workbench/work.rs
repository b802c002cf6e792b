//! What takes longer than a click: one piece at a time in a thread of its own, what the user asked for before what is
//! made ready in the background.

use super::app::App;
use super::jobs::{self, Job};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt::{self, Task};

/// How long the thread sleeps where nobody wakes it.
const NAP: Duration = Duration::from_millis(200);

/// How long a page may take to be opened after the start.
const FIRST_PAGE: Duration = Duration::from_secs(3);

/// What the worker is at.
#[derive(Clone, Debug, Serialize)]
pub struct Progress {
    pub what: String,
    pub seconds: f64,
    /// Grows as long as it gets on.
    pub looks: u64,
    pub is_stopping: bool,
}

/// How the last piece of work ended, for the page to say.
#[derive(Clone, Debug, Serialize)]
pub struct Ended {
    pub what: String,
    pub message: String,
    pub help: String,
    pub is_error: bool,
    /// Grows with each.
    pub number: u64,
}

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

    /// Works until the user stops the program.
    pub fn run(&self, app: &Arc<App>) {
        while !interrupt::requested() {
            match self.taken() {
                Some(job) => self.run_job(app, &job),
                None if self.make_ready(app) => {}
                None => {
                    let queue = self.queue();
                    if queue.waiting.is_none() {
                        let _ = self.bell.wait_timeout(queue, NAP);
                    }
                }
            }
        }
    }

    /// The next piece that was asked for, from here on the one that Cancel is about.
    fn taken(&self) -> Option<Job> {
        let mut queue = self.queue();
        let job = queue.waiting.take()?;
        self.task.begin();
        queue.running = Some((job.what(), Instant::now()));
        queue.is_stopping = false;
        Some(job)
    }

    fn run_job(&self, app: &Arc<App>, job: &Job) {
        app.tell(&serde_json::json!({"kind": "job", "job": self.progress()}));
        let done = self.pool.install(|| jobs::run(app, job));
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
            Some(Ended { what: job.what(), message, help, is_error, number: queue.count });
        drop(queue);
        self.task.begin();
        app.session().refresh();
        app.tell_state();
    }

    /// Makes views of the next releases ready, those that are looked at first, then the most recent. Whether there was
    /// one to be made. Nothing is made while the first page is still to come: its first picture has the machine to
    /// itself.
    fn make_ready(&self, app: &Arc<App>) -> bool {
        if self.begun.elapsed() < FIRST_PAGE && self.queue().wanted.is_empty() {
            return false;
        }
        let next: Vec<usize> = {
            let session = app.session();
            let wanted = self.queue().wanted.clone();
            let others = (0..session.releases.len()).rev();
            let mut next: Vec<usize> = Vec::new();
            for id in wanted.into_iter().rev().chain(others) {
                let is_missing = id < session.releases.len() && session.view(id).is_none();
                if is_missing && !next.contains(&id) {
                    next.push(id);
                }
            }
            next.truncate(self.pool.current_num_threads());
            next
        };
        if next.is_empty() {
            return false;
        }
        self.task.begin();
        self.pool.install(|| next.par_iter().for_each(|id| jobs::make_view(app, *id)));
        true
    }
}
