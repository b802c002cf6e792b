//! What long work has to say and how far it has come, for a program to show. Where none listens, nothing is
//! shown.

use std::sync::OnceLock;

static LISTENER: OnceLock<&'static dyn Listener> = OnceLock::new();

/// Who shows messages and progress.
pub trait Listener: Sync {
    fn message(&self, text: String);

    /// `count` of `what` are to be done.
    fn begin(&self, _count: usize, _what: &'static str) -> Option<Box<dyn Counter>> {
        None
    }
}

/// Counts what is done, until it is dropped.
pub trait Counter: Send + Sync {
    fn one(&self);
}

/// Has `listener` told from now on; the first is kept.
pub fn listen(listener: &'static dyn Listener) {
    LISTENER.get_or_init(|| listener);
}

/// Tells the listener `text`, as [`crate::say!`] formats it.
pub fn message(text: String) {
    if let Some(listener) = LISTENER.get() {
        listener.message(text);
    }
}

/// A line for who listens.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => { $crate::message::message(format!($($text)*)) };
}

/// What he should know before he believes a result.
#[macro_export]
macro_rules! warn {
    ($($text:tt)*) => {
        $crate::message::message(format!("yawrig: warning: {}", format_args!($($text)*)))
    };
}

/// How far something that takes long has come.
pub struct Progress(Option<Box<dyn Counter>>);

impl Progress {
    /// Of so many of `what`.
    pub fn new(count: usize, what: &'static str) -> Self {
        Self(LISTENER.get().and_then(|listener| listener.begin(count, what)))
    }

    /// One more is done.
    pub fn one(&self) {
        if let Some(counter) = &self.0 {
            counter.one();
        }
    }
}
