//! News for the pages that are open.

use serde_json::{json, Value};
use tokio::sync::broadcast;

/// News that a slow page may have waiting before it has to ask for everything.
const MAX_WAITING: usize = 256;

/// To every page that is open; copies send to the same pages.
#[derive(Clone)]
pub struct News(broadcast::Sender<String>);

impl Default for News {
    fn default() -> Self {
        Self(broadcast::channel(MAX_WAITING).0)
    }
}

impl News {
    pub fn send(&self, news: &Value) {
        // Fails where no page is open.
        let _ = self.0.send(news.to_string());
    }

    /// Everything may be different.
    pub fn all_may_differ(&self) {
        self.send(&json!({"kind": "state"}));
    }

    /// For one page.
    pub fn subscribe(&self) -> broadcast::Receiver<String> {
        self.0.subscribe()
    }
}
