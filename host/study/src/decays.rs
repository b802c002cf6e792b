//! Decays in closed form, represented as in the thesis: three cycles (or other counts) as points and
//! their duration (4.5), or the whole record of eight seconds at 20 Hz (5.4).

use super::lab::Draws;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Thesis 4.2.1, rad/s.
pub const NATURAL_FREQUENCY_RAD_S: [f64; 2] = [2.5, 26.5];
/// Thesis 4.2.1.
pub const DAMPING_RATIO: [f64; 2] = [0.001, 0.1];
/// Whole record, thesis 5.4.1.
pub const RECORD_S: f64 = 8.0;
pub const RECORD_POINTS: usize = 160;

/// White noise in every point; its rms drawn evenly from the range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    None,
    /// On the impulse response of (4.1), whose peak is about wn in rad/s: the thesis's 0.02 to 0.2.
    OfImpulseResponse([f64; 2]),
    /// Share of the peak.
    OfPeak([f64; 2]),
}

impl Noise {
    /// Rms as a share of the peak for one draw.
    fn draw(self, natural_frequency_rad_s: f64, random: &mut ChaCha8Rng) -> f64 {
        match self {
            Self::None => 0.0,
            Self::OfImpulseResponse(range) => between(random, range) / natural_frequency_rad_s,
            Self::OfPeak(range) => between(random, range),
        }
    }
}

pub fn between(random: &mut ChaCha8Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * random.random::<f64>()
}

/// Draws rows on all cores: the same seed, the same rows on any number of threads.
pub fn rows(
    count: usize,
    seed: u64,
    one: impl Fn(&mut ChaCha8Rng) -> (Vec<f64>, [f64; 2]) + Sync,
) -> Draws {
    let drawn: Vec<(Vec<f64>, [f64; 2])> = (0..count as u64)
        .into_par_iter()
        .map(|index| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(index);
            one(&mut random)
        })
        .collect();
    let d = drawn.first().map_or(0, |(row, _)| row.len());
    let truth = drawn.iter().map(|(_, truth)| *truth).collect();
    Draws { rows: drawn.into_iter().flat_map(|(row, _)| row).collect(), d, truth }
}

/// Impulse response, normalised, at `time_s`: exp(-zeta wn t) sin(wd t).
pub fn impulse_response([wn, zeta]: [f64; 2], time_s: f64) -> f64 {
    (-zeta * wn * time_s).exp() * (wn * (1.0 - zeta * zeta).sqrt() * time_s).sin()
}

/// How cycles are represented: so many points over so many cycles, over their largest, and the cycles'
/// duration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycles {
    pub cycles: usize,
    pub points: usize,
    pub noise: Noise,
    /// Points over their root mean square, and the reciprocal of the duration as last input.
    pub reciprocal: bool,
}

impl Cycles {
    /// The thesis's 41 inputs.
    pub fn thesis(noise: Noise) -> Self {
        Self { cycles: 3, points: 40, noise, reciprocal: false }
    }

    /// Times of the points from the first crossing, s.
    pub fn times_s(&self, [wn, zeta]: [f64; 2]) -> Vec<f64> {
        let duration_s = self.cycles as f64 * TAU / (wn * (1.0 - zeta * zeta).sqrt());
        (0..self.points).map(|i| duration_s * i as f64 / self.points as f64).collect()
    }

    /// One response with its true duration, as the thesis's training and test sets have it.
    pub fn row(&self, truth: [f64; 2], random: &mut ChaCha8Rng) -> Vec<f64> {
        let noise = self.noise.draw(truth[0], random);
        let mut row: Vec<f64> = self
            .times_s(truth)
            .into_iter()
            .map(|t| impulse_response(truth, t) + noise * random.sample::<f64, _>(StandardNormal))
            .collect();
        let unit = unit(&row, self.reciprocal);
        row.iter_mut().for_each(|y| *y /= unit);
        let duration_s = self.cycles as f64 * TAU / (truth[0] * (1.0 - truth[1] * truth[1]).sqrt());
        row.push(if self.reciprocal { 1.0 / duration_s } else { duration_s });
        row
    }

    pub fn draw(&self, count: usize, seed: u64) -> Draws {
        rows(count, seed, |random| {
            let truth = [between(random, NATURAL_FREQUENCY_RAD_S), between(random, DAMPING_RATIO)];
            (self.row(truth, random), truth)
        })
    }
}

/// Where a whole record begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Begin {
    /// At the zero crossing of an impulse response, known exactly.
    Impulse,
    /// At a zero crossing known to this rms, rad of the oscillation.
    Crossing { jitter_rad: f64 },
    /// Anywhere in a cycle.
    Anywhere,
}

/// How a record of eight seconds is represented: 160 points above their mean, over their largest or rms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WholeRecord {
    pub begin: Begin,
    pub noise: Noise,
    /// Divided by the root mean square, not by the largest.
    pub by_rms: bool,
    /// Means over 50 ms instead of points: what the 1 kHz record allows.
    pub means: bool,
    /// Damping ratio at the first amplitude over that of small oscillations, less one: drawn within plus and
    /// minus this.
    pub damping_change: f64,
    /// The same of the natural frequency, with the square of the amplitude.
    pub frequency_change: f64,
    /// Share of the draws whose damping ratio is drawn evenly in its logarithm.
    pub small_damping_share: f64,
}

impl WholeRecord {
    /// Chapter 5's.
    pub fn thesis(noise: Noise) -> Self {
        Self {
            begin: Begin::Impulse,
            noise,
            by_rms: false,
            means: false,
            damping_change: 0.0,
            frequency_change: 0.0,
            small_damping_share: 0.0,
        }
    }

    /// One record and the energy-weighted means of its natural frequency and damping ratio.
    pub fn row(&self, truth: [f64; 2], random: &mut ChaCha8Rng) -> (Vec<f64>, [f64; 2]) {
        let noise = self.noise.draw(truth[0], random);
        let phase_rad = match self.begin {
            Begin::Impulse => 0.0,
            Begin::Crossing { jitter_rad } => jitter_rad * random.sample::<f64, _>(StandardNormal),
            Begin::Anywhere => TAU * random.random::<f64>(),
        };
        let share = |random: &mut ChaCha8Rng, most: f64| match most {
            0.0 => 0.0,
            most => between(random, [-most, most]),
        };
        let damping_change = share(random, self.damping_change);
        let frequency_change = share(random, self.frequency_change);
        let (mut row, truth) = decay(truth, phase_rad, [damping_change, frequency_change]);
        // A point mean over 50 samples of the 1 kHz record.
        let (smoothing, noise) = match self.means {
            true => (half_sine(truth[0] * 0.025), noise / 50.0_f64.sqrt()),
            false => (1.0, noise),
        };
        for y in &mut row {
            *y = *y * smoothing + noise * random.sample::<f64, _>(StandardNormal);
        }
        (normalised(row, self.by_rms), truth)
    }

    pub fn draw(&self, count: usize, seed: u64) -> Draws {
        rows(count, seed, |random| {
            let wn = between(random, NATURAL_FREQUENCY_RAD_S);
            let zeta = match random.random::<f64>() < self.small_damping_share {
                true => between(random, DAMPING_RATIO.map(f64::ln)).exp(),
                false => between(random, DAMPING_RATIO),
            };
            self.row([wn, zeta], random)
        })
    }
}

/// sin x / x: what a mean over half a width of x leaves of a sinusoid.
fn half_sine(x: f64) -> f64 {
    x.sin() / x
}

/// Above their mean, over their largest or root mean square (thesis appendix D).
pub fn normalised(mut row: Vec<f64>, by_rms: bool) -> Vec<f64> {
    let mean = row.iter().sum::<f64>() / row.len() as f64;
    row.iter_mut().for_each(|y| *y -= mean);
    let unit = unit(&row, by_rms);
    row.iter_mut().for_each(|y| *y /= unit);
    row
}

/// What a row is divided by: its root mean square or its largest.
fn unit(row: &[f64], by_rms: bool) -> f64 {
    let unit = match by_rms {
        true => (row.iter().map(|y| y * y).sum::<f64>() / row.len() as f64).sqrt(),
        false => row.iter().fold(0.0, |m: f64, y| m.max(y.abs())),
    };
    unit.max(f64::MIN_POSITIVE)
}

/// A free decay whose damping ratio is `zeta (1 + c a)` and natural frequency `wn (1 + f a^2)` at amplitude
/// a, from 1 on, by averaging over a cycle; and the means over its energy.
fn decay(
    [wn, zeta]: [f64; 2],
    phase_rad: f64,
    [damping_change, frequency_change]: [f64; 2],
) -> (Vec<f64>, [f64; 2]) {
    const SUBSTEPS: usize = 8;
    let step_s = RECORD_S / (RECORD_POINTS * SUBSTEPS) as f64;
    let decay_1_s = zeta * wn;
    // a' = -s a (1 + c a) has the logistic curve as its solution.
    let amplitude = |t: f64| {
        let e = (-decay_1_s * t).exp();
        e / (1.0 + damping_change * (1.0 - e))
    };
    let root = (1.0 - zeta * zeta).sqrt();
    let frequency = |a: f64| wn * (1.0 + frequency_change * a * a);
    let mut phase_rad = phase_rad;
    let (mut energy, mut of_wn, mut of_zeta) = (0.0, 0.0, 0.0);
    let mut row = Vec::with_capacity(RECORD_POINTS);
    for k in 0..RECORD_POINTS * SUBSTEPS {
        let t = k as f64 * step_s;
        if k % SUBSTEPS == 0 {
            row.push(amplitude(t) * phase_rad.sin());
        }
        let a = amplitude(t + 0.5 * step_s);
        phase_rad += frequency(a) * root * step_s;
        energy += a * a;
        of_wn += a * a * frequency(a);
        of_zeta += a * a * zeta * (1.0 + damping_change * a);
    }
    (row, [of_wn / energy, of_zeta / energy])
}
