//! Training and test windows: decays of known natural frequency and damping ratio, cut and told
//! to the network by the device's own code.

use super::augmented::{self, Augmented};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_shared::features::{features, FeatureKind, Features};
use yawrig_shared::modal::Modal;
use yawrig_shared::window::{Finding, Limits, Tracker, CYCLES, SAMPLE_RATE_HZ};

/// What windows are drawn from, uniformly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    pub natural_frequency_rad_s: [f64; 2],
    pub damping_ratio: [f64; 2],
    /// Rms of white noise as a share of the window's peak; drawn evenly in its logarithm.
    /// Both zero: no noise.
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
    /// Those of effects that the network is to say.
    pub numbers: Vec<f64>,
}

impl Draw {
    fn new(features: Features, modal: &Modal, numbers: Vec<f64>) -> Self {
        let Modal { natural_frequency_rad_s, damping_ratio } = *modal;
        Self { features, natural_frequency_rad_s, damping_ratio, numbers }
    }
}

/// Draws `count` windows, of the second-order response or of a `model` with effects. The same seed gives the
/// same windows on any number of threads.
///
/// A window that noise or the effects keep from being found is drawn again.
///
/// # Errors
/// Exit 2 where too many in a row are not found, exit 130 once the user has asked to stop.
pub fn draw(
    ranges: &Ranges,
    kind: FeatureKind,
    model: Option<&Augmented>,
    count: usize,
    seed: u64,
) -> Result<Vec<Draw>> {
    (0..count as u64)
        .into_par_iter()
        .map(|index| {
            interrupt::check()?;
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(index);
            match model {
                None => (0..10).find_map(|_| one(ranges, kind, &mut random)),
                // Where friction is strong slow oscillations stop before three cycles are over.
                Some(model) => (0..200).find_map(|_| augmented(ranges, kind, model, &mut random)),
            }
            .ok_or_else(|| no_windows(ranges, model))
        })
        .collect()
}

fn no_windows(ranges: &Ranges, model: Option<&Augmented>) -> Error {
    match model {
        None => Error::usage(format!(
            "noise of {} of the peak leaves no windows to train on",
            ranges.noise[1]
        ))
        .help(format!("choose a smaller {}", settings::name("noise"))),
        Some(_) => Error::usage(
            "the model's effects leave hardly any three cycles to train on in these ranges",
        )
        .help(format!(
            "give the range around the model's own with {} and {}",
            settings::name("natural_frequency"),
            settings::name("damping")
        )),
    }
}

fn between(random: &mut ChaCha8Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * random.random::<f64>()
}

fn modal(ranges: &Ranges, random: &mut ChaCha8Rng) -> Modal {
    Modal {
        natural_frequency_rad_s: between(random, ranges.natural_frequency_rad_s),
        damping_ratio: between(random, ranges.damping_ratio),
    }
}

/// Rms of the noise as a share of the peak.
fn noise(ranges: &Ranges, random: &mut ChaCha8Rng) -> f64 {
    match ranges.noise {
        [_, high] if high <= 0.0 => 0.0,
        [low, high] => between(random, [low.ln(), high.ln()]).exp(),
    }
}

fn one(ranges: &Ranges, kind: FeatureKind, random: &mut ChaCha8Rng) -> Option<Draw> {
    /// Height of the decay at its start; any would do, as the features have none.
    const START_DEG: f64 = 9.0;
    let modal = modal(ranges, random);
    let noise = noise(ranges, random);
    let (decay_rate_per_s, damped_rad_s) =
        (modal.decay_rate_per_s(), modal.damped_frequency_rad_s());
    let phase_rad = TAU * random.random::<f64>();
    let offset_deg = between(random, [-2.0, 2.0]);
    let step_s = 1.0 / f64::from(SAMPLE_RATE_HZ);
    let jitter_s = step_s * random.random::<f64>();
    let cycles = CYCLES as f64 + 2.5;
    let samples = (cycles * TAU / damped_rad_s / step_s) as usize;
    let readings = (0..samples).map(|i| {
        let time_s = i as f64 * step_s + jitter_s;
        let swing = (-decay_rate_per_s * time_s).exp() * (damped_rad_s * time_s + phase_rad).cos();
        offset_deg + START_DEG * swing
    });
    let features = first_window(readings, START_DEG, noise, kind, random)?;
    Some(Draw::new(features, &modal, Vec::new()))
}

/// A window of a model with effects.
fn augmented(
    ranges: &Ranges,
    kind: FeatureKind,
    model: &Augmented,
    random: &mut ChaCha8Rng,
) -> Option<Draw> {
    let modal = modal(ranges, random);
    let noise = noise(ranges, random);
    let offset_deg = between(random, [-2.0, 2.0]);
    let numbers: Vec<f64> = model.asked().map(|asked| between(random, asked.range)).collect();
    let swing = model.swing(&modal, &numbers, random)?;
    let readings = swing.readings_deg.iter().map(|reading| offset_deg + reading);
    let features = first_window(readings, swing.amplitude_deg, noise, kind, random)?;
    let [low, high] = augmented::KEPT_DEG;
    let kept = (low..high).contains(&f64::from(features.amplitude_deg));
    kept.then(|| Draw::new(features, &modal, numbers))
}

/// The features of the first window the device finds in these readings, deg, once they have noise.
fn first_window(
    readings_deg: impl Iterator<Item = f64>,
    amplitude_deg: f64,
    noise: f64,
    kind: FeatureKind,
    random: &mut ChaCha8Rng,
) -> Option<Features> {
    let limits = Limits {
        from_deg: f32::INFINITY,
        to_deg: 0.0,
        least_swing_deg: (amplitude_deg * (4.0 * noise).max(0.04)) as f32,
    };
    let mut tracker = Box::new(Tracker::<f32>::new(0.0, 1.0, limits));
    for reading_deg in readings_deg {
        let error: f64 = random.sample(StandardNormal);
        let yaw_deg = reading_deg + amplitude_deg * noise * error;
        if let (_, Some(Finding::Window(window))) = tracker.push(yaw_deg as f32) {
            return Some(features(kind, tracker.history(), &window));
        }
    }
    None
}
