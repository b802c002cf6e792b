//! How a release ends, and the result that is sent of it.

use super::{Context, Measuring};
use crate::estimator::by_noise;
use crate::learning::Seen;
use crate::reference::Known;
use crate::release::Watch;
use yawrig_shared::modal::Modal;
use yawrig_shared::network::Estimate;
use yawrig_shared::wire::{Event, Flags, Measured, Phase, ReleaseResult};

impl Measuring {
    /// Ends the running release once this many samples have come.
    pub fn end_after(&mut self, samples: u32, context: &mut Context) {
        self.end_at = Some(samples);
        self.end_if_due(context);
    }

    pub(super) fn end_if_due(&mut self, context: &mut Context) {
        if self.end_at.is_some_and(|end| self.now().wrapping_sub(end) as i32 >= 0) {
            self.end_at = None;
            self.end_release(context);
            self.is_over = true;
        }
    }

    /// Ends the release at the host's wish.
    fn end_release(&mut self, context: &mut Context) {
        match self.watch.phase() {
            Phase::Ringing => self.finish(Flags::CUT_SHORT, self.now(), context),
            Phase::Finished => {}
            // The host waits for a result; what came gives none.
            phase => {
                if self.signal.is_stuck() {
                    self.current.flags.set(Flags::STUCK);
                }
                if phase != Phase::Released {
                    self.watch.set_phase(Phase::Ringing);
                }
                self.finish(Flags::CUT_SHORT, self.now(), context);
            }
        }
        self.tracker.restart(None);
        self.watch = Watch::new();
    }

    /// Sends the release's result, if one is running, and begins to refine it from the samples before `end`.
    pub(super) fn finish(&mut self, extra: Flags, end: u32, context: &mut Context) {
        let rings = self.watch.phase() == Phase::Ringing;
        if !self.is_releasing() {
            return;
        }
        self.watch.set_phase(Phase::Finished);
        let current = core::mem::take(&mut self.current);
        let mut flags = current.flags;
        flags.set(extra);
        if current.windows.count() == 0 {
            let small = rings && current.largest_deg < self.sampler.settings().to_deg;
            flags.set(if small { Flags::TOO_SMALL } else { Flags::TOO_FEW_CYCLES });
        }
        let (rms, bias) =
            context.network.map_or(([0.0; 2], [0.0; 2]), |n| (n.test_rms, n.bias_rms));
        let means = current.windows.result(rms, [0.0; 2]);
        let windows = current.windows.count();
        let seen = Seen { release: self.releases, means, windows, single: rms, bias };
        let mut corrected = self.learning.result(&seen);
        if current.windows.count() < 2 {
            // One alone has the network's whole error.
            (0..2).for_each(|output| corrected[output].u = means[output].u);
        }
        let [natural_frequency_rad_s, damping_ratio] = corrected;
        let numbers = context.network.map(|network| current.windows.numbers(network));
        let numbers = numbers.unwrap_or_default();
        let mean = Estimate {
            natural_frequency_rad_s: natural_frequency_rad_s.value,
            damping_ratio: damping_ratio.value,
            numbers: numbers.iter().map(|number| number.value).collect(),
        };
        let outside = context.network.is_some_and(|network| !network.holds(&mean));
        if outside && current.windows.count() > 0 {
            flags.set(Flags::OUT_OF_RANGE);
        }
        let known = Known {
            modal: Modal {
                natural_frequency_rad_s: f64::from(natural_frequency_rad_s.value),
                damping_ratio: f64::from(damping_ratio.value),
            },
            natural_frequency_u: natural_frequency_rad_s.u,
            damping_ratio_u: damping_ratio.u,
            clock_u: self.clock_u(),
        };
        // What its refined estimate is held against is another matter.
        let of_release = flags;
        let derivatives =
            self.reference.judge(self.releases, Some(known), &mut flags, self.condition.as_ref());
        let result = ReleaseResult {
            release: self.releases,
            release_sample: current.begun_sample,
            finished_sample: self.now().wrapping_sub(1),
            windows: current.windows.count(),
            natural_frequency_rad_s,
            damping_ratio,
            numbers,
            derivatives,
            flags,
        };
        context.line.event(&Event::Release(result));
        if current.windows.count() > 1 && context.second_order && !of_release.unusable() {
            self.learning.expect(seen);
        }
        let estimate = current.swings.start().filter(|_| context.second_order);
        let release = crate::refining::Release {
            number: self.releases,
            flags: of_release,
            condition: self.condition,
            clock_u: self.clock_u(),
            windows: (windows > 0).then(|| {
                [0, 1].map(|i| {
                    let Measured { value, u } = corrected[i];
                    let noise = by_noise(u * u, windows, rms[i] * rms[i]);
                    Measured { value, u: libm::sqrtf(noise + bias[i] * bias[i]) }
                })
            }),
        };
        context.refining.finish(release, estimate, end);
        self.releases = self.releases.wrapping_add(1);
        self.announce(self.now(), context);
    }
}
