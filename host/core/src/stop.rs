//! Interruption of long work.

use crate::error::{Error, Result};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;

/// A request to stop, shared by who may make it and the work that heeds it: long loops ask several times a
/// second.
///
/// ```
/// use yawrig_core::stop::Stop;
///
/// let program = Stop::default();
/// let task = program.child();
/// task.request();
/// assert!(task.check().is_err() && program.check().is_ok());
/// program.request();
/// assert!(program.child().check().is_err());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<State>);

#[derive(Debug, Default)]
struct State {
    requested: AtomicBool,
    looks: AtomicU64,
    parent: Option<Stop>,
}

impl Stop {
    /// A request of its own, which heeds this one too.
    pub fn child(&self) -> Self {
        Self(Arc::new(State { parent: Some(self.clone()), ..State::default() }))
    }

    /// Asks the work to stop; whether somebody had already.
    pub fn request(&self) -> bool {
        self.0.requested.swap(true, Ordering::SeqCst)
    }

    /// Withdraws the request, for the next piece of work.
    pub fn renew(&self) {
        self.0.looks.store(0, Ordering::Relaxed);
        self.0.requested.store(false, Ordering::SeqCst);
    }

    /// How often the work has looked since it was begun: it grows as long as the work goes on.
    pub fn looks(&self) -> u64 {
        self.0.looks.load(Ordering::Relaxed)
    }

    /// Whether somebody asked for it, here or of the one it is a child of; counts as a look.
    pub fn is_requested(&self) -> bool {
        self.0.looks.fetch_add(1, Ordering::Relaxed);
        self.0.requested.load(Ordering::SeqCst)
            || self.0.parent.as_ref().is_some_and(Self::is_requested)
    }

    /// Ends the work that calls it, by `?`, once it is to stop.
    ///
    /// # Errors
    /// [`Error::Interrupted`] once it was asked for.
    pub fn check(&self) -> Result<()> {
        match self.is_requested() {
            true => Err(Error::Interrupted),
            false => Ok(()),
        }
    }
}
