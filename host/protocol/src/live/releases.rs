//! One release after the other, cut out of the samples of a session.

use super::item::{time_s, Item};
use std::collections::VecDeque;
use yawrig_shared::wire::Event;

/// A release's record begins so many samples before it is let go.
const BEFORE: u64 = 1000;
/// Samples that are kept for the release that is going on: ten minutes.
const KEPT: usize = 600_000;

/// The releases of a session.
#[derive(Debug, Default)]
pub struct Releases {
    /// The last samples.
    kept: VecDeque<(u64, f64)>,
    /// Releases that are over and whose last samples have not come yet.
    ended: Vec<Ended>,
    has_begun: bool,
    /// Number after the last sample that came, or is known to be missing.
    next: u64,
    /// Where the last release's record ended.
    cut_at: u64,
}

/// Where a release was let go and where it ended.
#[derive(Clone, Copy, Debug)]
struct Ended {
    release: u32,
    from: u64,
    to: u64,
}

/// The samples of a release.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    pub release: u32,
    /// Number of its last sample in the session.
    pub to: u64,
    /// Session time, s, and yaw angle, deg.
    pub rows: Vec<(f64, f64)>,
    pub missing_samples: u64,
}

impl Releases {
    /// Takes what happened.
    pub fn take(&mut self, item: &Item) {
        match item {
            Item::Samples { first, yaw_deg } => {
                for (number, yaw_deg) in (*first..).zip(yaw_deg) {
                    if self.kept.len() == KEPT {
                        self.kept.pop_front();
                    }
                    self.kept.push_back((number, *yaw_deg));
                }
                self.has_begun = true;
                self.next = first + yaw_deg.len() as u64;
            }
            Item::Gap { first, count } if self.has_begun => {
                self.next = self.next.max(first + count);
            }
            Item::Event { at, event: Event::Release(result), .. } => {
                let lasted = result.finished_sample.wrapping_sub(result.release_sample);
                let from = at.saturating_sub(u64::from(lasted));
                self.ended.push(Ended { release: result.release, from, to: *at });
            }
            _ => {}
        }
    }

    /// The releases whose samples have all come by this item, or will not come any more after it.
    pub fn due(&mut self, by: &Item) -> Vec<Cut> {
        self.cut(matches!(by, Item::Disconnected { .. } | Item::Restarted { .. }))
    }

    /// All that are left: no more samples will come.
    pub fn rest(&mut self) -> Vec<Cut> {
        self.cut(true)
    }

    fn cut(&mut self, last: bool) -> Vec<Cut> {
        let next = self.next;
        let (due, wait) =
            std::mem::take(&mut self.ended).into_iter().partition(|e| last || e.to < next);
        self.ended = wait;
        let due: Vec<Ended> = due;
        let mut cuts = Vec::new();
        for Ended { release, from, to } in due {
            let oldest = self.kept.front().map_or(u64::MAX, |(number, _)| *number);
            // Not into the release before, nor before the session.
            let begun = from.saturating_sub(BEFORE).max(self.cut_at).max(oldest);
            let rows: Vec<(f64, f64)> = (self.kept.iter())
                .filter(|(number, _)| (begun..=to).contains(number))
                .map(|(number, yaw_deg)| (time_s(*number), *yaw_deg))
                .collect();
            self.cut_at = to + 1;
            if rows.is_empty() {
                continue;
            }
            let missing_samples = (to + 1).saturating_sub(begun.min(from)) - rows.len() as u64;
            cuts.push(Cut { release, to, rows, missing_samples });
        }
        let keep_from = (self.next.saturating_sub(BEFORE)).min(self.cut_at);
        while self.kept.front().is_some_and(|(number, _)| *number < keep_from) {
            self.kept.pop_front();
        }
        cuts
    }

    /// Whether a release that is over waits for its last samples.
    pub fn waits(&self) -> bool {
        !self.ended.is_empty()
    }

    /// Number after the last sample that came, or is known to be missing.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Whether a sample has come.
    pub fn has_begun(&self) -> bool {
        self.has_begun
    }
}
