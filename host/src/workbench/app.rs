//! The session, who works on it and who is told.

use super::access::Access;
use super::live::Live;
use super::session::Session;
use super::work::Work;
use serde_json::json;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::broadcast;
use yawrig_base::error::Result;

/// News that a slow page may have waiting before it is told to ask for everything.
const MOST_NEWS: usize = 256;

pub struct App {
    pub access: Arc<Access>,
    pub news: broadcast::Sender<String>,
    session: Mutex<Session>,
    pub work: Work,
    pub live: Live,
}

impl App {
    pub fn new(access: Access, session: Session) -> Result<Self> {
        Ok(Self {
            access: Arc::new(access),
            news: broadcast::channel(MOST_NEWS).0,
            session: Mutex::new(session),
            work: Work::new()?,
            live: Live::default(),
        })
    }

    /// Held for moments only: nothing is read or fitted under it.
    pub fn session(&self) -> MutexGuard<'_, Session> {
        self.session.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn tell(&self, news: &serde_json::Value) {
        // Fails where no page is open.
        let _ = self.news.send(news.to_string());
    }

    /// Everything may be different.
    pub fn tell_state(&self) {
        self.tell(&json!({"kind": "state"}));
    }

    /// Sees what another program or the user's editor has made of the model, and says how the work gets on.
    pub fn look_at_files(&self) {
        if let Some(progress) = self.work.progress() {
            self.tell(&json!({"kind": "job", "job": progress}));
        } else if self.session().refresh() {
            self.tell_state();
            self.work.wake();
        }
    }
}
