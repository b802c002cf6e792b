//! Which stretch of the samples is a free swing: what the record for the refined estimate holds.

use super::{Context, Measuring};
use crate::estimator::Collector;
use crate::swings::Swings;
use yawrig_shared::window::Extreme;
use yawrig_shared::wire::{Flags, Phase};

/// A swing that overshoots its rest by this share of where it began is an oscillation: damping ratios up to
/// 0.5.
const MIN_OVERSHOOT: f32 = 0.16;

impl Measuring {
    /// What was seen before this turning point is no part of the free oscillation: a hand has turned the
    /// model there, or has pushed it in mid-release.
    pub(super) fn anew(&mut self, from: Extreme, context: &mut Context) {
        // Of two motions the larger tells more: noise in a hold is none of a release.
        let swing_deg = self.tracker.swing().map_or(0.0, |swing| 0.5 * swing.size_deg());
        if self.current.windows.count() > 0 && swing_deg < self.current.largest_deg {
            self.current.flags.set(Flags::DISTURBED);
            self.spoil(from.at, context);
        } else if self.may_swing() {
            context.refining.abandon();
            self.record(from, context);
            (self.current.swings, self.current.windows) = (Swings::default(), Collector::default());
            self.current.begun_sample = from.at;
            (self.current.largest_deg, self.current.smallest_deg) = (0.0, f32::INFINITY);
        }
    }

    /// Whether turning points are those of a release, one that nobody saw beginning among them.
    pub(super) fn may_swing(&self) -> bool {
        self.is_releasing() || self.watch.phase() == Phase::Waiting
    }

    /// How long the model's swings take, at least.
    pub(super) fn swing_samples(&self) -> u32 {
        if let Some(swing) = self.tracker.swing() {
            let one = swing.to.at.wrapping_sub(swing.from.at);
            return self.tracker.half_period().unwrap_or(one);
        }
        // Before it has turned, half of what has passed, the rest of it still.
        let since = self.now().wrapping_sub(self.current.turned_sample) / 2;
        if self.watch.phase() == Phase::Released {
            since
        } else {
            0
        }
    }

    /// The record for the refined estimate begins as the model leaves the first turning point from which it
    /// swings within the range. What came before is kept until then: of a release that never falls to the
    /// range it is all there is.
    pub(super) fn record(&mut self, extreme: Extreme, context: &mut Context) {
        let height_deg = self.tracker.swing().map(|swing| 0.5 * swing.size_deg());
        let from_deg = self.sampler.settings().from_deg;
        if context.refining.is_confirmed() {
            return;
        }
        let is_recording = context.refining.is_recording();
        match height_deg.filter(|_| is_recording) {
            Some(height_deg) if height_deg > from_deg => context.refining.is_above(self.now()),
            Some(height_deg) if context.refining.confirm(height_deg) => {}
            _ => {
                let least_deg = self.tracker.limits().least_swing_deg;
                context.refining.begin(self.now(), least_deg, extreme.yaw_deg);
            }
        }
    }

    /// A model that is damped so heavily that it is seen to turn only once: its rest shows its swing's
    /// mid-line.
    pub(super) fn died_at_once(&mut self, context: &mut Context) {
        let swing = self.tracker.swing().or_else(|| self.tracker.unfinished_swing());
        let Some(swing) = swing else { return };
        let rest_deg = self.watch.rest_deg();
        let [from, to] = [swing.from, swing.to].map(|end| end.yaw_deg - rest_deg);
        // Any less damped one, and it is none that a hand has turned to its rest.
        if -to / from < MIN_OVERSHOOT {
            return;
        }
        self.current.swings.add_halves(&swing, from, to);
        self.watch.set_phase(Phase::Ringing);
        self.current.largest_deg = to.abs();
        self.finish(Flags::default(), self.now(), context);
        self.watch.set_phase(Phase::Held);
    }

    /// Its swings are seen no longer: so ends one that began below the range; any other is cut short, at
    /// `end`.
    pub(super) fn die_down(&mut self, end: u32, context: &mut Context) {
        let below = self.current.largest_deg < self.settings().to_deg;
        if below && self.watch.phase() == Phase::Ringing {
            self.finish(Flags::default(), self.current.turned_sample, context);
        } else {
            self.finish(Flags::CUT_SHORT, end, context);
        }
    }
}
