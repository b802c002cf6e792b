//! What the host asks of the releases that come: settings, and the condition they are made under.

use super::{limits, Context, Current, Measuring};
use crate::release::Watch;
use crate::sampler::Sampler;
use yawrig_shared::wire::{Condition, Refusal, Settings};

impl Measuring {
    /// New settings, from the next release on; at once where none is running.
    pub fn configure(&mut self, settings: Settings, context: &mut Context) -> Result<(), Refusal> {
        if !Sampler::check(&settings) {
            return Err(Refusal::Settings);
        }
        self.next_settings = Some(settings);
        if !self.is_releasing() {
            self.prepare(context);
            self.tracker.restart(None);
            self.watch = Watch::new();
        }
        Ok(())
    }

    /// What the coming releases are made under: a release that is going on ends under the condition it began
    /// with.
    pub fn set_condition(
        &mut self,
        condition: Condition,
        context: &mut Context,
    ) -> Result<(), Refusal> {
        condition.check().map_err(Refusal::Condition)?;
        self.next_condition = Some(condition);
        if !self.is_releasing() {
            self.take_condition(context);
        }
        Ok(())
    }

    pub(super) fn take_condition(&mut self, context: &mut Context) {
        if let Some(condition) = self.next_condition.take() {
            self.condition = Some(condition);
            self.reference.mount(&condition);
            self.learning.mount(&condition);
            context.refining.mount(&condition);
        }
    }

    /// A new release may begin: settings and condition that were waiting for it take effect.
    pub(super) fn prepare(&mut self, context: &mut Context) {
        self.take_condition(context);
        if let Some(settings) = self.next_settings.take() {
            let was = self.sampler.settings().degrees_per_count;
            let times = settings.degrees_per_count / was;
            self.sampler = Sampler::new(settings);
            self.tracker.configure(settings.degrees_per_count, limits(&settings));
            self.signal.rescale(settings.degrees_per_count, times);
            self.watch.rescale(times);
        }
        self.current = Current::default();
    }

    /// Takes no turn for one that may be noise.
    pub(super) fn set_limits(&mut self, times: f32) {
        let settings = self.sampler.settings();
        let mut limits = limits(settings);
        limits.least_swing_deg = limits.least_swing_deg.max(times * self.signal.block_noise_deg());
        self.tracker.configure(settings.degrees_per_count, limits);
    }
}
