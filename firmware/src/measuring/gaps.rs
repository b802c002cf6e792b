//! Samples that are missing, and what of a release they spoil.

use super::{Context, Measuring};
use crate::release::Watch;
use crate::signal::{Gap, BRIDGED, LONGEST_GAP};
use crate::swings::Swings;
use yawrig_shared::history::BLOCK;
use yawrig_shared::wire::{Flags, Phase};

/// Samples that no window takes: twelve days.
const LONG_AGO: u32 = 1 << 30;

impl Measuring {
    /// `count` samples before the next one were lost.
    pub fn lost(&mut self, count: u32, context: &mut Context) {
        if count == 0 {
            return;
        }
        self.lost_samples = self.lost_samples.saturating_add(count);
        self.current.flags.set(Flags::LOST_SAMPLES);
        // Of many, only what is left beside whole blocks.
        let (blocks, bridged) = match count {
            ..=LONGEST_GAP => (0, count),
            _ => (count / BLOCK as u32, count % BLOCK as u32),
        };
        let from = self.now();
        if blocks > 0 {
            self.give_up(from, context);
        }
        (0..bridged).for_each(|_| self.take(self.signal.last(), context));
        self.tracker.skip(blocks);
        if count > BRIDGED {
            self.signal.rejoin();
            self.after_gap(from, context);
        }
    }

    /// Readings were not the model's for a while.
    pub(super) fn gap(&mut self, gap: Gap, context: &mut Context) {
        let from = self.now().wrapping_sub(gap.length);
        let too_long = gap.length > LONGEST_GAP;
        // A jump without a gap is none of the contact's.
        let disturbed = too_long || gap.jumped && gap.length <= BRIDGED;
        self.current.flags.set(if disturbed { Flags::DISTURBED } else { Flags::SPIKES });
        // And after a release it is a hand that moves the model.
        if too_long || gap.jumped && self.watch.phase() == Phase::Finished {
            self.give_up(from, context);
        }
        if gap.length > BRIDGED || gap.jumped {
            self.after_gap(from, context);
        }
    }

    /// Tracks anew: no turning point in a gap, or before it, is one of what comes.
    fn after_gap(&mut self, from: u32, context: &mut Context) {
        self.spoil(from, context);
        self.restart(None);
        self.current.swings = Swings::default();
        self.current.turned_sample = self.now();
    }

    /// Ends the release that is going on, if one is, and waits for whatever comes.
    pub(super) fn give_up(&mut self, end: u32, context: &mut Context) {
        self.finish(Flags::CUT_SHORT, end, context);
        if self.watch.phase() != Phase::Waiting {
            self.watch = Watch::new();
            self.announce(self.now(), context);
        }
    }

    /// What has come since `from` is of no use for windows, nor for the record.
    pub(super) fn spoil(&mut self, from: u32, context: &mut Context) {
        self.current.spoilt_until = Some(self.now());
        context.refining.interrupt(from, self.current.smallest_deg);
    }

    /// A gap that no window reaches back to is over: the clock wraps around.
    pub(super) fn outlive_gap(&mut self) {
        let since = |until: u32| self.now().wrapping_sub(until);
        self.current.spoilt_until =
            self.current.spoilt_until.filter(|until| since(*until) < LONG_AGO);
    }

    pub(super) fn is_spoilt(&self, start: u32) -> bool {
        self.current.spoilt_until.is_some_and(|until| start.wrapping_sub(until) as i32 <= 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A glitch, and sixty days in which nothing happens: what begins then is not before it.
    #[test]
    fn what_begins_weeks_after_a_gap_is_not_spoilt_by_it() {
        let mut measuring = Measuring::new(yawrig_shared::wire::Settings::default());
        measuring.current.spoilt_until = Some(measuring.now());
        let hour = 3_600_000 / BLOCK as u32;
        for hours in 1..60 * 24 {
            measuring.tracker.skip(hour);
            measuring.outlive_gap();
            assert!(!measuring.is_spoilt(measuring.now()), "after {hours} hours");
        }
    }
}
