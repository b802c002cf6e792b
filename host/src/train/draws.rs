//! Training and test windows: decays of known natural frequency and damping ratio, cut and told
//! to the network by the device's own code.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use yawrig_shared::features::{features, FeatureKind, Features};
use yawrig_shared::window::{Finding, Limits, Tracker, CYCLES, SAMPLE_RATE_HZ};

/// What windows are drawn from, uniformly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    pub natural_frequency_rad_s: [f64; 2],
    pub damping_ratio: [f64; 2],
    /// Rms of white noise as a share of the window's peak; drawn evenly in its logarithm.
    /// Both nought: no noise.
    pub noise: [f64; 2],
}

impl Default for Ranges {
    /// The rig's whole range (thesis 4.2.1) without noise.
    fn default() -> Self {
        Self {
            natural_frequency_rad_s: [2.5, 26.5],
            damping_ratio: [0.001, 0.1],
            noise: [0.0, 0.0],
        }
    }
}

/// One window and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    pub features: Features,
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
}

/// Draws `count` windows. The same seed gives the same windows on any number of threads.
///
/// A window that noise keeps from being found is drawn again; `None` where ten in a row are.
pub fn draw(ranges: &Ranges, kind: FeatureKind, count: usize, seed: u64) -> Option<Vec<Draw>> {
    (0..count as u64)
        .into_par_iter()
        .map(|index| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(index);
            (0..10).find_map(|_| one(ranges, kind, &mut random))
        })
        .collect()
}

fn between(random: &mut ChaCha8Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * random.random::<f64>()
}

fn one(ranges: &Ranges, kind: FeatureKind, random: &mut ChaCha8Rng) -> Option<Draw> {
    /// Height of the decay at its start; any would do, as the features have none.
    const START_DEG: f64 = 9.0;
    let natural_frequency_rad_s = between(random, ranges.natural_frequency_rad_s);
    let damping_ratio = between(random, ranges.damping_ratio);
    let noise = match ranges.noise {
        [_, high] if high <= 0.0 => 0.0,
        [low, high] => between(random, [low.ln(), high.ln()]).exp(),
    };
    let decay_rate_per_s = damping_ratio * natural_frequency_rad_s;
    let damped_rad_s = natural_frequency_rad_s * (1.0 - damping_ratio * damping_ratio).sqrt();
    let phase_rad = TAU * random.random::<f64>();
    let offset_deg = between(random, [-2.0, 2.0]);
    let step_s = 1.0 / f64::from(SAMPLE_RATE_HZ);
    let jitter_s = step_s * random.random::<f64>();
    let limits = Limits {
        from_deg: f32::INFINITY,
        to_deg: 0.0,
        least_swing_deg: (START_DEG * (4.0 * noise).max(0.04)) as f32,
    };
    let mut tracker = Box::new(Tracker::<f32>::new(0.0, 1.0, limits));
    let cycles = CYCLES as f64 + 2.5;
    let samples = (cycles * TAU / damped_rad_s / step_s) as usize;
    for i in 0..samples {
        let time_s = i as f64 * step_s + jitter_s;
        let swing = (-decay_rate_per_s * time_s).exp() * (damped_rad_s * time_s + phase_rad).cos();
        let error: f64 = random.sample(StandardNormal);
        let yaw_deg = offset_deg + START_DEG * (swing + noise * error);
        if let (_, Some(Finding::Window(window))) = tracker.push(yaw_deg as f32) {
            let features = features(kind, tracker.history(), &window);
            return Some(Draw { features, natural_frequency_rad_s, damping_ratio });
        }
    }
    None
}
