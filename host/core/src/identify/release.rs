//! Where the free decay is: release, hold, end, and the part of it inside the amplitude window.

use super::envelope::{block_of, envelope, strongest_frequency_rad_s, Point, POINTS_PER_CYCLE};
use super::flag::Flag;
use super::samples::{Samples, Stretch};
use super::windows::MIN_SHARE;
use super::{Begin, End, Refusal, Settings, MIN_CYCLES};
use crate::record::{Derivative, Measurand};
use crate::statistics::{median, sample_noise};
use std::f64::consts::TAU;

/// An amplitude this far above the envelope's own noise counts as an oscillation.
const AMPLITUDE_OVER_NOISE: f64 = 4.0;
/// A yaw angle beyond it is more likely one in another unit.
const HALF_TURN_DEG: f64 = 180.0;
/// Share of the largest amplitude below which the oscillation has died out.
const DIED_OUT: f64 = 0.01;
/// The envelope is known to this share: what is released at the upper limit is not to lose a sample.
const ENVELOPE_SHARE: f64 = 0.02;

/// Amplitudes of the motion that are asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Amplitudes {
    from: f64,
    to: f64,
    /// Beyond it the unit is more likely another.
    most: f64,
    only_between: bool,
    derivative: Derivative,
}

impl Amplitudes {
    /// Of a displacement, of whose size nothing is known, all unless some were named.
    pub(crate) fn new(settings: &Settings, measurand: &Measurand) -> Self {
        let Settings { from_deg, to_deg, only_between, .. } = *settings;
        let usual = Self {
            from: from_deg,
            to: to_deg,
            most: from_deg.max(HALF_TURN_DEG),
            only_between,
            derivative: measurand.derivative(),
        };
        let most = f64::INFINITY;
        match measurand.is_of_angle() {
            true => usual,
            false if only_between => Self { most, ..usual },
            false => Self { from: most, to: 0.0, most, ..usual },
        }
    }

    /// Those that the record has.
    pub(crate) fn all(self) -> Self {
        Self { from: self.most, to: 0.0, ..self }
    }

    /// Of what is recorded, about this frequency.
    fn recorded(self, frequency_rad_s: f64) -> Self {
        let recorded = |amplitude| self.derivative.recorded(amplitude, frequency_rad_s);
        Self { from: recorded(self.from), to: recorded(self.to), most: recorded(self.most), ..self }
    }
}

/// The free decay of a record and what of it is analysed.
#[derive(Clone, Debug)]
pub(crate) struct FreeSpan {
    /// Strongest frequency of the record, rad/s, to a few percent.
    pub(crate) frequency_rad_s: f64,
    /// Beginning of the free motion: the release, or the first sample where the release is not in the record.
    pub(crate) release_time_s: f64,
    pub(crate) begin: Begin,
    pub(crate) end: End,
    /// What is analysed.
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    /// Beyond it dry friction takes the amplitude within a cycle: no law that is smooth over the rate holds
    /// the model.
    pub(crate) smooth_to_s: f64,
    pub(crate) flags: Vec<Flag>,
}

impl FreeSpan {
    pub(crate) fn stretch<'a>(&self, samples: &'a Samples<'_>) -> Stretch<'a> {
        samples.between(self.from_s, self.to_s)
    }
}

/// Finds the free decay.
///
/// # Errors
/// No oscillation, or fewer than three cycles of one.
pub(crate) fn find(samples: &Samples<'_>, amplitudes: Amplitudes) -> Result<FreeSpan, Refusal> {
    let (left_alone, found) =
        searched(samples, amplitudes.derivative, |s| (s.left_alone(), s.find(amplitudes)))?;
    let Some((released_s, begin)) = left_alone else { return found };
    // What drove it may have had another frequency.
    let free = samples.after(released_s);
    let mut span = searched(&free, amplitudes.derivative, |search| search.find(amplitudes))??;
    if span.begin != Begin::Held {
        span.begin = begin;
        span.flags.retain(|flag| *flag != Flag::StartsInMidSwing && *flag != Flag::PushedAtStart);
        let driven = begin == Begin::Driven;
        span.flags.push(if driven { Flag::DrivenBefore } else { Flag::PushedAtStart });
    }
    Ok(span)
}

/// What `look` finds in the envelope of `samples`.
fn searched<T>(
    samples: &Samples<'_>,
    derivative: Derivative,
    look: impl FnOnce(&Search<'_>) -> T,
) -> Result<T, Refusal> {
    let frequency = strongest_frequency_rad_s(samples).ok_or(Refusal::NoOscillation)?;
    let period = TAU / frequency;
    let means = samples.all().block_means(block_of(samples, frequency));
    let none = vec![false; means.len()];
    let means = means.stretch(&none);
    let points = envelope(&means, frequency);
    if points.is_empty() {
        return Err(Refusal::TooFewCycles { cycles: means.duration_s() / period });
    }
    let noise = noise_of_means(&means, &points);
    let (begin_s, duration_s) = (samples.all().start_s(), samples.all().duration_s());
    let end_s = begin_s + duration_s;
    Ok(look(&Search { derivative, means, begin_s, end_s, frequency, period, noise, points }))
}

/// Standard deviation of the means' noise: the smaller of two values that the motion itself makes too large,
/// one where it is sampled coarsely, the other where it decays fast.
fn noise_of_means(means: &Stretch<'_>, points: &[Point]) -> f64 {
    let mut scatter: Vec<f64> = points.iter().map(|p| p.scatter_deg).collect();
    sample_noise(means.yaw_deg).min(median(&mut scatter))
}

pub(super) struct Search<'a> {
    /// What the samples are of the motion.
    pub(crate) derivative: Derivative,
    pub(crate) means: Stretch<'a>,
    /// First sample, and one step after the last: the means lie inside.
    pub(crate) begin_s: f64,
    pub(crate) end_s: f64,
    /// Strongest, rad/s, and its period.
    pub(crate) frequency: f64,
    pub(crate) period: f64,
    pub(crate) noise: f64,
    pub(crate) points: Vec<Point>,
}

/// The end of a free motion.
pub(super) struct Ending {
    pub(crate) to_s: f64,
    pub(crate) end: End,
    /// Beyond it dry friction takes the amplitude within a cycle.
    pub(crate) smooth_to_s: f64,
}

/// Consecutive points of the envelope, ends included.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub(crate) first: usize,
    pub(crate) last: usize,
}

impl Search<'_> {
    fn find(&self, amplitudes: Amplitudes) -> Result<FreeSpan, Refusal> {
        let asked = amplitudes.recorded(self.frequency);
        let of_motion = |recorded| asked.derivative.of_motion(recorded, self.frequency);
        let largest = self.points.iter().map(|p| p.amplitude_deg).fold(0.0, f64::max);
        let least = self.least();
        let everything = self
            .longest_run(|p| p.amplitude_deg >= least)
            .filter(|_| largest > 0.0)
            .ok_or(Refusal::NoOscillation)?;
        let inside = |p: &Point| {
            p.amplitude_deg <= (1.0 + ENVELOPE_SHARE) * asked.from
                && p.amplitude_deg >= asked.to.max(least)
        };
        if largest > asked.most {
            return Err(Refusal::BeyondHalfTurn { peak_deg: of_motion(largest) });
        }
        let mut flags = Vec::new();
        let windowed = self.longest_run(inside).filter(|r| self.cycles(*r) >= MIN_CYCLES);
        let chosen = windowed.unwrap_or(everything);
        if windowed.is_none() {
            if asked.only_between {
                let of = |at: usize| self.points[at].amplitude_deg;
                let least_deg = (chosen.first..=chosen.last).map(of).fold(largest, f64::min);
                let (most_deg, least_deg) = (of_motion(largest), of_motion(least_deg));
                return Err(Refusal::Elsewhere { most_deg, least_deg });
            }
            flags.push(Flag::AmplitudeOutsideWindow);
        }
        let around = self.grown(chosen, |p| p.amplitude_deg >= least);
        let onset = self.onset(around, &mut flags);
        let Ending { to_s: free_to_s, mut end, smooth_to_s } = self.end(around, &mut flags);
        let mut from = onset.free_from_s;
        let mut to = free_to_s;
        if windowed.is_some() {
            from = from.max(self.start_inside(chosen, from, asked.from));
            let inside = self.end_inside(chosen, free_to_s);
            if inside < to {
                (to, end) = (inside, End::Amplitude);
            }
            let is_asked = asked.to > 0.0 || asked.most.is_finite();
            let above = is_asked && self.points[chosen.last].amplitude_deg > 1.3 * asked.to;
            if above && chosen.last + 1 == self.points.len() {
                flags.push(Flag::EndsAboveWindow);
            }
        }
        let cycles = (to - from) / self.period;
        // The frequency is known to a few percent only here.
        if cycles < MIN_SHARE * MIN_CYCLES {
            // Noise alone stands above itself for a moment, though never by much.
            if largest < 2.0 * AMPLITUDE_OVER_NOISE * self.amplitude_noise() {
                return Err(Refusal::NoOscillation);
            }
            return Err(Refusal::TooFewCycles { cycles: cycles.max(0.0) });
        }
        Ok(FreeSpan {
            frequency_rad_s: self.frequency,
            release_time_s: onset.release_s,
            begin: onset.begin,
            end,
            from_s: from,
            to_s: to,
            smooth_to_s,
            flags,
        })
    }

    /// The least amplitude of an oscillation.
    pub(super) fn least(&self) -> f64 {
        let largest = self.points.iter().map(|p| p.amplitude_deg).fold(0.0, f64::max);
        (AMPLITUDE_OVER_NOISE * self.amplitude_noise()).max(DIED_OUT * largest)
    }

    /// A sinusoid's amplitude from n samples of noise s is known to s sqrt(2/n).
    pub(super) fn amplitude_noise(&self) -> f64 {
        self.noise * (2.0 / (self.period / self.means.step_s).max(1.0)).sqrt()
    }

    /// The longest stretch of points for which `accept` holds, gaps shorter than a cycle bridged.
    pub(super) fn longest_run(&self, accept: impl Fn(&Point) -> bool) -> Option<Run> {
        let mut best: Option<Run> = None;
        let mut open: Option<Run> = None;
        for (i, point) in self.points.iter().enumerate() {
            if accept(point) {
                let first = match open {
                    Some(run) if i - run.last <= POINTS_PER_CYCLE => run.first,
                    _ => i,
                };
                let run = Run { first, last: i };
                open = Some(run);
                if best.is_none_or(|b| run.last - run.first > b.last - b.first) {
                    best = Some(run);
                }
            }
        }
        best
    }

    /// `run` and the points on both sides of it for which `accept` holds without a gap.
    fn grown(&self, run: Run, accept: impl Fn(&Point) -> bool) -> Run {
        let first = (0..run.first)
            .rev()
            .take_while(|&i| accept(&self.points[i]))
            .last()
            .unwrap_or(run.first);
        let last = (run.last + 1..self.points.len())
            .take_while(|&i| accept(&self.points[i]))
            .last()
            .unwrap_or(run.last);
        Run { first, last }
    }

    /// Cycles from half a cycle before the first point to half a cycle after the last.
    fn cycles(&self, run: Run) -> f64 {
        (self.points[run.last].time_s - self.points[run.first].time_s) / self.period + 1.0
    }

    /// Time from which the envelope is inside the window: the crossing, or `free_from` where it starts
    /// inside.
    fn start_inside(&self, run: Run, free_from: f64, from_deg: f64) -> f64 {
        // Only points whose whole cycle is free count.
        let whole = free_from + 0.49 * self.period;
        let free = self.points.partition_point(|p| p.time_s < whole);
        let first = run.first.saturating_sub(1).max(free).min(run.last);
        let inside = (first..run.last)
            .find(|&i| self.points[i].amplitude_deg <= from_deg)
            .unwrap_or(run.last);
        if inside > first {
            return crossing(self.points[inside - 1], self.points[inside], from_deg);
        }
        // The amplitude before the first point, from its fall over the next cycle.
        let p = self.points[first];
        let next = self.points[(first + POINTS_PER_CYCLE).min(run.last)];
        let rate = (p.amplitude_deg / next.amplitude_deg).ln() / (next.time_s - p.time_s);
        let amplitude = p.amplitude_deg * ((p.time_s - free_from) * rate).exp();
        if rate > 0.0 && amplitude > (1.0 + ENVELOPE_SHARE) * from_deg {
            (p.time_s - (from_deg / p.amplitude_deg).ln() / rate).max(free_from)
        } else {
            free_from
        }
    }

    /// Time to which the envelope is inside the window.
    fn end_inside(&self, run: Run, free_to: f64) -> f64 {
        let p = self.points[run.last];
        match self.points.get(run.last + 1) {
            // Its half cycle beyond the centre belongs to the free decay as long as that goes on.
            Some(_) => p.time_s + 0.5 * self.period / POINTS_PER_CYCLE as f64,
            None => free_to,
        }
        .min(free_to)
    }
}

/// Time at which the amplitude passes `level` between two points, exponentially.
fn crossing(a: Point, b: Point, level: f64) -> f64 {
    let share = (a.amplitude_deg / level).ln() / (a.amplitude_deg / b.amplitude_deg).ln();
    a.time_s + share.clamp(0.0, 1.0) * (b.time_s - a.time_s)
}
