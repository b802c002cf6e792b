//! From samples to results: the tracker, the release logic and the network put together.

use crate::estimator::Collector;
use crate::line::Line;
use crate::release::{Step, Watch};
use crate::sampler::Sampler;
use yawrig_shared::derivatives::{reduced_frequency, YawDerivatives};
use yawrig_shared::features::features;
use yawrig_shared::history::BLOCK;
use yawrig_shared::modal::Modal;
use yawrig_shared::network::{Estimate, Network};
use yawrig_shared::window::{Finding, Limits, Tracker, Window};
use yawrig_shared::wire::{
    Condition, Derivatives, Event, Flags, Phase, Refusal, ReleaseResult, Settings, WindowResult,
};

/// Lost samples that are bridged by the last one before them; more end the release.
const BRIDGED: u32 = 20;

/// The release that is going on.
#[derive(Clone, Copy, Debug, Default)]
struct Current {
    begun_sample: u32,
    windows: Collector,
    flags: Flags,
    largest_deg: f32,
    smallest_deg: f32,
    /// Windows that end before this sample saw a gap or an end of the converter.
    spoilt_until: Option<u32>,
}

/// What measuring needs from the rest of the device.
pub struct Context<'a> {
    pub network: Option<&'a Network>,
    pub line: &'a mut Line,
}

/// Everything between the converter and the line.
#[derive(Debug)]
pub struct Measuring {
    sampler: Sampler,
    next_settings: Option<Settings>,
    tracker: Tracker<i16>,
    watch: Watch,
    current: Current,
    releases: u32,
    last_raw: i16,
    lost_samples: u32,
    end_at: Option<u32>,
    condition: Option<Condition>,
    /// Wind-off result of the axis and spring at hand.
    reference: Option<Modal>,
}

impl Measuring {
    pub fn new(settings: Settings) -> Self {
        Self {
            sampler: Sampler::new(settings),
            next_settings: None,
            tracker: Tracker::new(0, settings.degrees_per_count, limits(&settings)),
            watch: Watch::new(),
            current: Current::default(),
            releases: 0,
            last_raw: 0,
            lost_samples: 0,
            end_at: None,
            condition: None,
            reference: None,
        }
    }

    /// `count` samples before the next one were lost. Few are bridged, many end the release.
    pub fn lost(&mut self, count: u32, context: &mut Context) {
        if count == 0 {
            return;
        }
        self.lost_samples = self.lost_samples.saturating_add(count);
        self.current.flags.set(Flags::LOST_SAMPLES);
        if count > BRIDGED {
            self.finish(Flags::CUT_SHORT, context);
            self.tracker.restart(None);
            self.tracker.skip(count);
            self.watch = Watch::new();
        } else {
            for _ in 0..count {
                self.take(self.last_raw, context);
            }
        }
        self.current.spoilt_until = Some(self.now());
    }

    /// The next sample of the converter, 1 ms after the one before.
    pub fn sample(&mut self, counts: u16, context: &mut Context) {
        if self.sampler.saturated(counts) {
            self.current.flags.set(Flags::SATURATED);
            self.current.spoilt_until = Some(self.now());
        }
        self.last_raw = Sampler::centred(counts);
        self.take(self.last_raw, context);
        self.end_if_due(context);
    }

    pub fn settings(&self) -> &Settings {
        self.sampler.settings()
    }

    pub fn phase(&self) -> Phase {
        self.watch.phase()
    }

    pub fn lost_samples(&self) -> u32 {
        self.lost_samples
    }

    pub fn has_reference(&self) -> bool {
        self.reference.is_some()
    }

    /// Index of the next sample: the device's clock.
    pub fn now(&self) -> u32 {
        self.tracker.history().next_index()
    }

    fn take(&mut self, raw: i16, context: &mut Context) {
        let (block, finding) = self.tracker.push(raw);
        let watching = self.watch.phase();
        match finding {
            Some(Finding::Window(window)) if watching == Phase::Ringing => {
                self.window(&window, context)
            }
            Some(Finding::Extreme { extreme, amplitude_deg: Some(amplitude) })
                if matches!(watching, Phase::Waiting | Phase::Released | Phase::Ringing) =>
            {
                self.extreme(extreme.at, amplitude, context);
            }
            _ => {}
        }
        if let Some(mean) = block {
            let at = self.now().wrapping_sub(BLOCK as u32 / 2 + 1);
            let to_deg = self.sampler.settings().to_deg;
            match self.watch.block(at, mean, self.tracker.midline_deg(), to_deg) {
                Some(Step::LetGo(held)) => {
                    self.prepare();
                    self.current.begun_sample = held.at;
                    self.tracker.restart(Some(held));
                    self.announce(held.at, context);
                }
                Some(Step::AtRest) => {
                    self.at_rest(watching, context);
                }
                Some(Step::Stirred) => {
                    self.prepare();
                    self.tracker.restart(None);
                    self.announce(at, context);
                }
                None => {}
            }
        }
    }

    /// A new release may begin: settings that were waiting for it take effect.
    fn prepare(&mut self) {
        if let Some(settings) = self.next_settings.take() {
            self.sampler = Sampler::new(settings);
            self.tracker.configure(settings.degrees_per_count, limits(&settings));
        }
        self.current = Current::default();
    }

    fn at_rest(&mut self, was: Phase, context: &mut Context) {
        if was == Phase::Ringing {
            self.watch.set_phase(Phase::Ringing);
            self.finish(Flags::CUT_SHORT, context);
            self.watch.set_phase(Phase::Held);
        }
        self.prepare();
        self.announce(self.now(), context);
    }

    fn announce(&mut self, at_sample: u32, context: &mut Context) {
        let phase = self.watch.phase();
        context.line.event(&Event::Phase { phase, release: self.releases, at_sample });
    }

    /// A turning point with a known amplitude.
    fn extreme(&mut self, at: u32, amplitude_deg: f32, context: &mut Context) {
        if self.watch.phase() != Phase::Ringing {
            if self.watch.phase() == Phase::Waiting {
                self.prepare();
                self.current.flags.set(Flags::MID_SWING);
                self.current.begun_sample = at;
            }
            self.current.smallest_deg = f32::INFINITY;
            self.watch.set_phase(Phase::Ringing);
            self.announce(at, context);
        }
        self.current.largest_deg = self.current.largest_deg.max(amplitude_deg);
        self.current.smallest_deg = self.current.smallest_deg.min(amplitude_deg);
        if amplitude_deg < self.sampler.settings().to_deg {
            self.finish(Flags::default(), context);
        }
    }

    /// Three cycles are complete: the network's estimate goes out at once.
    fn window(&mut self, window: &Window, context: &mut Context) {
        let start = window.start.next_sample();
        let spoilt = |until: u32| start.wrapping_sub(until) as i32 <= 0;
        if self.current.spoilt_until.is_some_and(spoilt) {
            return;
        }
        let Some(network) = context.network else {
            self.current.flags.set(Flags::NO_NETWORK);
            return;
        };
        let features = features(network.features, self.tracker.history(), window);
        let estimate = network.estimate(&features);
        let mut flags = Flags::default();
        if !network.range.holds(&estimate) {
            flags.set(Flags::OUT_OF_RANGE);
        }
        let number = self.current.windows.count();
        self.current.windows.add(&estimate, features.amplitude_deg);
        let Estimate { natural_frequency_rad_s, damping_ratio } = estimate;
        context.line.event(&Event::Window(WindowResult {
            release: self.releases,
            window: number,
            start_sample: start,
            end_sample: window.end,
            sent_sample: self.now().wrapping_sub(1),
            amplitude_deg: features.amplitude_deg,
            midline_deg: self.sampler.yaw_deg(window.midline_deg),
            natural_frequency_rad_s,
            damping_ratio,
            flags,
        }));
    }

    /// Ends the release at the host's wish.
    fn end_release(&mut self, context: &mut Context) {
        match self.watch.phase() {
            Phase::Ringing => self.finish(Flags::CUT_SHORT, context),
            Phase::Finished => {}
            // The host waits for a result; there is none to be had from what came.
            _ => {
                self.watch.set_phase(Phase::Ringing);
                self.finish(Flags::CUT_SHORT, context);
            }
        }
        self.tracker.restart(None);
        self.watch = Watch::new();
    }

    /// Sends the release's result, if one is running.
    fn finish(&mut self, extra: Flags, context: &mut Context) {
        if self.watch.phase() != Phase::Ringing {
            return;
        }
        self.watch.set_phase(Phase::Finished);
        let current = core::mem::take(&mut self.current);
        let mut flags = current.flags;
        flags.set(extra);
        if current.windows.count() == 0 {
            let small = current.largest_deg < self.sampler.settings().to_deg;
            flags.set(if small { Flags::TOO_SMALL } else { Flags::TOO_FEW_CYCLES });
        }
        let (rms, bias) =
            context.network.map_or(([0.0; 2], [0.0; 2]), |n| (n.test_rms, n.bias_rms));
        let [natural_frequency_rad_s, damping_ratio] = current.windows.result(rms, bias);
        let mean = Estimate {
            natural_frequency_rad_s: natural_frequency_rad_s.value,
            damping_ratio: damping_ratio.value,
        };
        let outside = context.network.is_some_and(|network| !network.range.holds(&mean));
        if outside && current.windows.count() > 0 {
            flags.set(Flags::OUT_OF_RANGE);
        }
        let usable = !flags.unusable();
        let modal = Modal {
            natural_frequency_rad_s: f64::from(natural_frequency_rad_s.value),
            damping_ratio: f64::from(damping_ratio.value),
        };
        let derivatives = if usable { self.derivatives(&modal) } else { None };
        let result = ReleaseResult {
            release: self.releases,
            release_sample: current.begun_sample,
            finished_sample: self.now().wrapping_sub(1),
            windows: current.windows.count(),
            natural_frequency_rad_s,
            damping_ratio,
            derivatives,
            flags,
        };
        context.line.event(&Event::Release(result));
        self.releases = self.releases.wrapping_add(1);
        self.announce(self.now(), context);
    }

    /// New settings, from the next release on; at once where none is running.
    pub fn configure(&mut self, settings: Settings) -> Result<(), Refusal> {
        if !Sampler::check(&settings) {
            return Err(Refusal::Settings);
        }
        self.next_settings = Some(settings);
        if !matches!(self.watch.phase(), Phase::Ringing | Phase::Released) {
            self.prepare();
            self.tracker.restart(None);
            self.watch = Watch::new();
        }
        Ok(())
    }

    /// What the coming releases are made under.
    pub fn set_condition(&mut self, condition: Condition) {
        self.condition = Some(condition);
    }

    /// Ends the running release once this many samples have come.
    pub fn end_after(&mut self, samples: u32, context: &mut Context) {
        self.end_at = Some(samples);
        self.end_if_due(context);
    }

    fn end_if_due(&mut self, context: &mut Context) {
        if self.end_at.is_some_and(|end| self.now().wrapping_sub(end) as i32 >= 0) {
            self.end_at = None;
            self.end_release(context);
        }
    }

    /// Derivatives of a wind-on release against the wind-off one before it, which this becomes
    /// where the wind is off.
    fn derivatives(&mut self, modal: &Modal) -> Option<Derivatives> {
        let Condition { wind, model, inertia_kg_m2 } = self.condition?;
        if wind.speed_m_s == 0.0 {
            self.reference = Some(*modal);
            return None;
        }
        let reference = self.reference?;
        if inertia_kg_m2 <= 0.0 {
            return None;
        }
        let YawDerivatives { cn_beta, cn_r } =
            YawDerivatives::from_releases(modal, &reference, inertia_kg_m2, &wind, &model);
        Some(Derivatives {
            cn_beta: cn_beta as f32,
            cn_r: cn_r as f32,
            reduced_frequency: reduced_frequency(modal, &wind, &model) as f32,
        })
    }
}

fn limits(settings: &Settings) -> Limits {
    Limits {
        from_deg: settings.from_deg,
        to_deg: settings.to_deg,
        least_swing_deg: 0.4 * settings.to_deg,
    }
}
