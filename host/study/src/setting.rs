//! How a study is run.

use super::lab::{self, Draws, Fit, Spec};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use yawrig_base::error::Result;
use yawrig_base::interrupt;

/// Whether a study is run in full or just to see that it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    Full,
    /// Few epochs and draws: its numbers mean nothing.
    Quick,
}

/// How a study is run.
pub struct StudySetting<'a> {
    pub size: Size,
    /// Called with each step.
    pub progress: &'a (dyn Fn(&str) + Sync),
}

impl StudySetting<'_> {
    pub fn of(&self, full: usize, quick: usize) -> usize {
        match self.size {
            Size::Full => full,
            Size::Quick => quick,
        }
    }

    /// Draws of a test set.
    pub fn tests(&self) -> usize {
        self.of(2000, 60)
    }

    pub fn epochs(&self, full: usize) -> usize {
        self.of(full, full.min(6))
    }

    pub fn draws(&self, full: usize) -> usize {
        self.of(full, full.min(150))
    }

    /// Trains each on its set, on all cores.
    pub fn fit_all(&self, what: &str, jobs: &[(&Draws, Spec)]) -> Result<Vec<Fit>> {
        let done = AtomicUsize::new(0);
        jobs.par_iter()
            .map(|(draws, spec)| {
                interrupt::check()?;
                let fit = lab::fit(draws, spec)?;
                let count = done.fetch_add(1, Ordering::Relaxed) + 1;
                (self.progress)(&format!("{what}: {count} of {} networks trained", jobs.len()));
                Ok(fit)
            })
            .collect()
    }
}
