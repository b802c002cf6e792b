//! How far something that takes long has come, on stderr where that is a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// What takes no longer is not worth a bar.
const PATIENCE: Duration = Duration::from_secs(2);

/// A bar that is there only once something has taken long.
pub struct Progress {
    bar: ProgressBar,
    begun: Instant,
    terminal: bool,
}

impl Progress {
    /// Of so many of `what`.
    pub fn of(count: usize, what: &'static str) -> Self {
        let style = ProgressStyle::with_template("{msg:12} [{bar:40}] {pos}/{len} {elapsed}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(count as u64), ProgressDrawTarget::hidden());
        let bar = bar.with_style(style).with_message(what);
        Self { bar, begun: Instant::now(), terminal: std::io::stderr().is_terminal() }
    }

    /// One more is done.
    pub fn one(&self) {
        if self.terminal && self.bar.is_hidden() && self.begun.elapsed() > PATIENCE {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
