//! The session and those who work on it.

use super::access::Access;
use super::live::{self, Shown};
use super::news::News;
use super::work::Work;
use serde_json::{json, Value};
use std::path::{Path, PathBuf};
use std::sync::{Arc, MutexGuard};
use yawrig_base::error::Result;
use yawrig_model::records;
use yawrig_records::Selection;
use yawrig_session::{Bench, Session};

pub struct App {
    pub access: Arc<Access>,
    pub news: News,
    pub bench: Bench,
    pub work: Work,
    pub live: Arc<Shown>,
}

impl App {
    pub fn new(access: Access, session: Session) -> Result<Self> {
        let news = News::default();
        let pages = news.clone();
        let told = Box::new(move |news: &Value| pages.send(news));
        Ok(Self {
            access: Arc::new(access),
            bench: Bench::new(session, told),
            work: Work::new()?,
            live: Arc::new(Shown::new(news.clone())),
            news,
        })
    }

    /// As [`Bench::session`].
    pub fn session(&self) -> MutexGuard<'_, Session> {
        self.bench.session()
    }

    /// Sees what another program or the user's editor has made of the model, and says how the work gets on.
    pub fn look_at_files(&self) {
        if let Some(progress) = self.work.progress() {
            self.news.send(&json!({"kind": "job", "job": progress}));
        } else if self.session().refresh() {
            self.news.all_may_differ();
            self.work.wake();
        }
    }

    /// Follows a device; each release that is recorded of it joins the list. The built-in rig before an
    /// emulated one swings `speed` times as fast as a real rig.
    ///
    /// # Errors
    /// Those of [`live::follow`].
    pub fn follow(self: &Arc<Self>, device: &str, speed: f64) -> Result<()> {
        let app = self.clone();
        live::follow(&self.live, device, speed, move |record| app.take_in(record))
    }

    fn take_in(&self, record: &Path) {
        let model_path = self.session().model_path.clone();
        let Ok(entries) =
            records::entries(&[PathBuf::from(record)], &Selection::default(), &model_path)
        else {
            return;
        };
        let mut session = self.session();
        for entry in entries {
            let used = session.used_when_new();
            session.include(entry, None, used);
        }
        drop(session);
        self.news.all_may_differ();
        self.work.wake();
    }
}
