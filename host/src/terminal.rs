//! Messages and progress on stderr.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};
use yawrig_base::message::{Counter, Listener};

/// What takes no longer is not worth a bar.
const PATIENCE: Duration = Duration::from_secs(2);

/// Shows messages on stderr, progress where that is a terminal.
pub struct Terminal;

impl Listener for Terminal {
    fn message(&self, text: String) {
        // `eprintln!` would panic where nobody reads it any more (`2>&1 | head`).
        drop(writeln!(std::io::stderr(), "{text}"));
    }

    fn begin(&self, count: usize, what: &'static str) -> Option<Box<dyn Counter>> {
        std::io::stderr().is_terminal().then(|| Box::new(LateBar::new(count, what)) as _)
    }
}

/// A bar that is there only once something has taken long.
struct LateBar {
    bar: ProgressBar,
    begun: Instant,
}

impl LateBar {
    fn new(count: usize, what: &'static str) -> Self {
        let style = ProgressStyle::with_template("{msg:12} [{bar:40}] {pos}/{len} {elapsed}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(count as u64), ProgressDrawTarget::hidden());
        Self { bar: bar.with_style(style).with_message(what), begun: Instant::now() }
    }
}

impl Counter for LateBar {
    fn one(&self) {
        if self.bar.is_hidden() && self.begun.elapsed() > PATIENCE {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.inc(1);
    }
}

impl Drop for LateBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
