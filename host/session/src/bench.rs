//! The session, and who is told of it.

use super::session::Session;
use serde_json::Value;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Is given each piece of news.
pub type Told = dyn Fn(&Value) + Send + Sync;

/// A session that several may ask about at once.
pub struct Bench {
    session: Mutex<Session>,
    told: Box<Told>,
}

impl Bench {
    pub fn new(session: Session, told: Box<Told>) -> Self {
        Self { session: Mutex::new(session), told }
    }

    /// Locked for moments only: nothing is read or fitted meanwhile.
    pub fn session(&self) -> MutexGuard<'_, Session> {
        self.session.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn tell(&self, news: &Value) {
        (self.told)(news);
    }
}
