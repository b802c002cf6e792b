//! From samples to results: the tracker, the release logic and the network put together.

mod ending;
mod free;
mod gaps;
mod settings;
mod windows;

use crate::estimator::Collector;
use crate::learning::Learning;
use crate::line::Line;
use crate::reference::Reference;
use crate::refining::Refining;
use crate::release::{Step, Watch};
use crate::sampler::Sampler;
use crate::signal::Signal;
use crate::swings::Swings;
use yawrig_shared::history::BLOCK;
use yawrig_shared::network::Network;
use yawrig_shared::window::{Extreme, Finding, Limits, Tracker};
use yawrig_shared::wire::{Condition, Event, Flags, Measured, Phase, Refined, Settings};

/// Samples until a released model has turned twice: a cycle and a half at 0.3 rad/s.
const PATIENCE: u32 = 31_416;

/// A turn is one of the model's where the block means come back by this many times their noise.
const MIN_SWING_NOISE: f32 = 7.0;
/// The same where no release is known of, and noise alone may go on for hours: its range in thousands of
/// means.
const MIN_TURN_NOISE: f32 = 8.0;

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
    /// Where the last window ended.
    windows_end: u32,
    /// Where it last was seen to turn, or was let go, and how many samples it takes to turn again, once
    /// known.
    turned_sample: u32,
    half_period: u32,
    swings: Swings,
}

/// What measuring needs from the rest of the device.
pub struct Context<'a> {
    pub network: Option<&'a Network>,
    /// The network gives a second-order model's values, and no effect beside it.
    pub second_order: bool,
    pub refining: &'a mut Refining,
    pub line: &'a mut Line,
}

/// Everything between the converter and the line.
// In this order, or else the samples would be made on the stack and then copied.
#[derive(Debug)]
#[repr(C)]
pub struct Measuring {
    tracker: Tracker<i16>,
    sampler: Sampler,
    signal: Signal,
    next_settings: Option<Settings>,
    watch: Watch,
    current: Current,
    releases: u32,
    lost_samples: u32,
    end_at: Option<u32>,
    is_over: bool,
    condition: Option<Condition>,
    next_condition: Option<Condition>,
    board_clock_u_ppm: f32,
    reference: Reference,
    learning: Learning,
}

impl Measuring {
    // Or else it would be made on the stack and then copied.
    #[inline(always)]
    pub fn new(settings: Settings) -> Self {
        Self {
            sampler: Sampler::new(settings),
            signal: Signal::new(settings.degrees_per_count),
            next_settings: None,
            watch: Watch::new(),
            current: Current::default(),
            releases: 0,
            lost_samples: 0,
            end_at: None,
            is_over: false,
            condition: None,
            next_condition: None,
            board_clock_u_ppm: 0.0,
            reference: Reference::new(),
            learning: Learning::new(),
            tracker: Tracker::new(0, settings.degrees_per_count, limits(&settings)),
        }
    }

    /// Readings of the sensor come so many samples from one another.
    pub fn set_spread(&mut self, samples: u32) {
        self.signal.set_spread(samples);
    }

    /// The next sample of the converter, 1 ms after the one before, and what its sensor says is the matter.
    pub fn sample(&mut self, counts: u16, flags: Flags, context: &mut Context) {
        self.current.flags.set(flags);
        let raw = Sampler::centred(counts);
        let at_end = self.sampler.saturated(counts);
        let good = self.signal.sample(raw, at_end);
        if let Some(gap) = self.signal.take_gap() {
            self.gap(gap, context);
        }
        if good == raw && at_end {
            self.current.flags.set(Flags::SATURATED);
            self.spoil(self.now(), context);
        }
        self.take(good, context);
        self.end_if_due(context);
    }

    /// Whether the host has ended the record, and nothing has come since.
    pub fn is_over(&self) -> bool {
        self.is_over
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

    /// Says how well the board knows its clock.
    pub fn set_board_clock(&mut self, u_ppm: f32) {
        self.board_clock_u_ppm = u_ppm;
    }

    pub fn clock_u_ppm(&self) -> f32 {
        self.sampler.settings().clock_u_ppm.unwrap_or(self.board_clock_u_ppm)
    }

    fn clock_u(&self) -> f32 {
        1e-6 * self.clock_u_ppm()
    }

    /// What the next release will be measured with: what came last, also while a release goes on without it.
    pub fn next_settings(&self) -> &Settings {
        self.next_settings.as_ref().unwrap_or(self.sampler.settings())
    }

    /// What the next release will be made under, as far as announced.
    pub fn condition(&self) -> Option<Condition> {
        self.next_condition.or(self.condition)
    }

    /// What the last release was made under, as far as announced.
    pub fn condition_of_release(&self) -> Option<Condition> {
        self.condition
    }

    /// The wind-off release that results are held against.
    pub fn reference(&self) -> Option<u32> {
        self.reference.release()
    }

    /// Another network runs: what the one before made of a wind-off release is none of its results.
    pub fn network_changed(&mut self) {
        self.reference.forget();
    }

    /// What is learnt of the network that runs.
    pub fn learning(&self) -> &Learning {
        &self.learning
    }

    pub fn learning_mut(&mut self) -> &mut Learning {
        &mut self.learning
    }

    /// What of it a reset is to leave in RAM: releases so far, and the reference.
    pub fn kept(&self) -> (u32, Reference) {
        (self.releases, self.reference)
    }

    /// The same, from before a reset.
    pub fn recall(&mut self, releases: u32, reference: Reference) {
        (self.releases, self.reference) = (releases, reference);
    }

    /// Releases so far.
    pub fn releases(&self) -> u32 {
        self.releases
    }

    /// A release has been refined: what it shows of the network's error holds for those that come.
    pub fn refined(&mut self, refined: &Refined) {
        if !refined.flags.of_record().unfit_as_reference() {
            let Refined { natural_frequency_rad_s: wn, damping_ratio, .. } = refined;
            let wn = Measured { value: wn.value as f32, u: wn.u };
            self.learning.learn(refined.release, [wn, *damping_ratio]);
        }
    }

    /// Index of the next sample: the device's clock.
    pub fn now(&self) -> u32 {
        self.tracker.history().next_index()
    }

    fn take(&mut self, raw: i16, context: &mut Context) {
        self.is_over = false;
        let (block, finding) = self.tracker.push(raw);
        let watching = self.watch.phase();
        match finding {
            Some(Finding::Window(window)) if watching == Phase::Ringing => {
                self.window(&window, context)
            }
            Some(Finding::Extreme { extreme, amplitude_deg }) => {
                let moves = self.may_swing();
                if moves {
                    self.record(extreme, context);
                }
                if let Some(amplitude) = amplitude_deg.filter(|_| moves) {
                    self.extreme(extreme.at, amplitude, context);
                }
                self.current.turned_sample = self.now();
            }
            Some(Finding::Anew { from }) => {
                self.anew(from, context);
                self.current.turned_sample = self.now();
            }
            _ => {}
        }
        if let Some(mean) = block {
            self.signal.block(mean);
            self.judge();
            self.outlive_gap();
            if watching == Phase::Waiting {
                // The noise is only just being known.
                self.set_limits(MIN_TURN_NOISE);
            }
            context.refining.follow(self.tracker.history());
            let at = self.now().wrapping_sub(BLOCK as u32 / 2 + 1);
            let to_deg = self.sampler.settings().to_deg;
            let noise = self.signal.block_noise_deg();
            let swing = self.swing_samples();
            match self.watch.block(at, mean, noise, swing, self.tracker.midline_deg(), to_deg) {
                Some(Step::LetGo(held)) => self.let_go(held, context),
                Some(Step::AtRest) => {
                    self.at_rest(watching, context);
                }
                Some(Step::Stirred) => {
                    self.prepare(context);
                    self.restart(None);
                    self.announce(at, context);
                }
                None => self.time_out(context),
            }
        }
    }

    fn let_go(&mut self, held: Extreme, context: &mut Context) {
        let Current { spoilt_until, flags, .. } = self.current;
        let in_gap = self.is_spoilt(held.at);
        self.prepare(context);
        context.refining.abandon();
        if in_gap {
            // Where and when it was let go nobody saw.
            (self.current.spoilt_until, self.current.flags) = (spoilt_until, flags);
        }
        self.current.begun_sample = held.at;
        self.current.turned_sample = held.at;
        self.restart(Some(held).filter(|_| !in_gap));
        self.announce(held.at, context);
    }

    /// A model that does not turn for three cycles swings no longer, or nobody sees it.
    fn time_out(&mut self, context: &mut Context) {
        let patience = match self.current.half_period {
            0 => PATIENCE,
            half_period => 6 * half_period,
        };
        if self.is_releasing() && self.now().wrapping_sub(self.current.turned_sample) > patience {
            self.die_down(self.now(), context);
            self.give_up(self.now(), context);
            self.restart(None);
        }
    }

    /// What is the matter with the signal goes down on the release that is going on.
    fn judge(&mut self) {
        let flags = &mut self.current.flags;
        let moving = matches!(self.watch.phase(), Phase::Released | Phase::Ringing);
        for (found, flag) in [
            (moving && self.signal.is_stuck(), Flags::STUCK),
            (self.signal.is_noisy(), Flags::NOISY),
            (self.signal.is_senseless(), Flags::NO_SENSOR),
        ] {
            if found {
                flags.set(flag);
            }
        }
    }

    /// Tracks anew.
    fn restart(&mut self, held: Option<Extreme>) {
        self.set_limits(MIN_SWING_NOISE);
        self.tracker.restart(held);
    }

    fn at_rest(&mut self, was: Phase, context: &mut Context) {
        if was == Phase::Ringing {
            self.watch.set_phase(Phase::Ringing);
            // It was caught some time after that.
            self.die_down(self.current.windows_end, context);
            self.watch.set_phase(Phase::Held);
        }
        if was == Phase::Released {
            self.died_at_once(context);
        }
        self.prepare(context);
        self.announce(self.now(), context);
    }

    fn announce(&mut self, at_sample: u32, context: &mut Context) {
        let phase = self.watch.phase();
        context.line.event(&Event::Phase { phase, release: self.releases, at_sample });
    }

    /// A turning point with a known amplitude.
    fn extreme(&mut self, at: u32, amplitude_deg: f32, context: &mut Context) {
        if let Some(swing) = self.tracker.swing() {
            self.current.swings.add(&swing);
            context.refining.set_cycle(2.0 * self.current.swings.samples());
        }
        if self.watch.phase() != Phase::Ringing {
            if self.watch.phase() == Phase::Waiting {
                let swings = self.current.swings;
                self.prepare(context);
                self.current.swings = swings;
                self.current.flags.set(Flags::MID_SWING);
                self.current.begun_sample = at;
            }
            self.current.smallest_deg = f32::INFINITY;
            self.watch.set_phase(Phase::Ringing);
            self.announce(at, context);
        }
        self.current.half_period = self.tracker.half_period().unwrap_or_default();
        self.current.largest_deg = self.current.largest_deg.max(amplitude_deg);
        self.current.smallest_deg = self.current.smallest_deg.min(amplitude_deg);
        // One that began below the range goes on while its swings are seen: its record is refined.
        let to_deg = self.sampler.settings().to_deg;
        if amplitude_deg < to_deg && self.current.largest_deg >= to_deg {
            self.finish(Flags::default(), self.now(), context);
        }
    }

    /// The model has been let go, and the release is not over yet.
    pub fn is_releasing(&self) -> bool {
        matches!(self.watch.phase(), Phase::Ringing | Phase::Released)
    }
}

fn limits(settings: &Settings) -> Limits {
    Limits {
        from_deg: settings.from_deg,
        to_deg: settings.to_deg,
        least_swing_deg: 0.4 * settings.to_deg,
    }
}
