//! What goes into the device's log, and when: a result once it is said, a start with the first sample.

use super::Core;
use crate::journal::Moment;
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::wire::{Event, LogEntry, Logged, Refusal};

impl<F: NorFlash, const LOCKABLE: bool> Core<F, LOCKABLE> {
    pub(super) fn take_up_log(&mut self) {
        self.journal.open(self.store.flash());
    }

    pub(super) fn is_log_behind(&self) -> bool {
        self.journal.is_behind(self.line.next_event())
    }

    /// Writes the next of what has come since.
    pub(super) fn keep_log(&mut self) {
        if self.is_log_behind() {
            self.log_next();
        }
    }

    #[inline(never)]
    fn log_next(&mut self) {
        let when = Moment {
            at_sample: self.measuring.now(),
            lost_samples: self.measuring.lost_samples(),
            network: self.running_id(),
        };
        if !self.journal.has_begun() {
            self.journal.begin(self.store.flash(), &self.start, when);
            return;
        }
        let mut next = self.journal.next_event;
        while let Some(event) = self.line.next_of(&mut next) {
            let what = match event {
                Event::Release(release) => Logged::Release(release),
                Event::Refined(refined) => Logged::Refined(refined),
                Event::Phase { .. } | Event::Window(_) => continue,
            };
            let condition = self.measuring.condition_of_release();
            self.journal.add(self.store.flash(), condition, what, when);
            break;
        }
        self.journal.next_event = next;
    }

    /// Writes all of it.
    pub(super) fn keep_all_of_log(&mut self) {
        while self.is_log_behind() {
            self.log_next();
        }
    }

    /// Its first entry of this number or a higher one, with all that has happened up to now in it.
    pub(super) fn log_entry(&mut self, from: u32) -> Result<Option<LogEntry>, Refusal> {
        if !self.journal.is_there() {
            return Err(Refusal::NoLog);
        }
        self.keep_all_of_log();
        Ok(self.journal.entry_from(self.store.flash(), from))
    }
}
