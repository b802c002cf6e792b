//! What a law of angle and rate leaves that no such law could hold: time, a second frequency, the sensor, randomness.

use super::estimate::{fit_whole, Measured};
use super::releases::Releases;
use crate::diagnosis::forced::is_random;
use crate::diagnosis::over_pieces::Lengths;
use crate::diagnosis::prediction::{predict_within, Prediction};
use crate::effects::Effect;
use crate::fit::segments::{fit_from, PieceFit};
use crate::fit::starts;
use rayon::prelude::*;
use std::sync::Arc;

/// Held out over the noise, up to which a law of angle and rate holds all there is.
pub(super) const HELD: f64 = 1.15;
const SETTLED: f64 = 1e-4;
/// Beginnings of each effect that are tried.
const STARTS: usize = 3;

/// Share of what the law alone fails to predict, that is left where an effect beside it is believed.
const CLEARLY: f64 = 0.5;
/// Share of the yaw mode's frequencies within which a line is at a harmonic of it, and the highest such.
const HARMONIC: f64 = 0.02;
const MOST_HARMONIC: u32 = 5;

/// What no law of angle and rate holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Time,
    SecondFrequency,
    Sensor,
    Randomness,
}

impl Kind {
    /// As JSON has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::SecondFrequency => "second_frequency",
            Self::Sensor => "sensor",
            Self::Randomness => "randomness",
        }
    }
}

/// What stands beside a law.
#[derive(Clone, Debug)]
pub struct Beside {
    pub kind: Kind,
    /// Of the library.
    pub effect: Effect,
    /// The law with the effect; of randomness, which cannot be predicted, the law alone.
    pub held_out_over_noise: f64,
    /// Of a line, rad/s.
    pub frequency_rad_s: Option<f64>,
}

const TRIED: [(Effect, Kind); 5] = [
    (Effect::HarmonicForcing, Kind::SecondFrequency),
    (Effect::SecondMode, Kind::SecondFrequency),
    (Effect::StiffnessDrift, Kind::Time),
    (Effect::BaselineDrift, Kind::Time),
    (Effect::SensorNonlinearity, Kind::Sensor),
];

/// Of a line, from the numbers that its fit varies.
fn frequency_rad_s(effect: &Effect, numbers: &[f64]) -> Option<f64> {
    effect.line().map(|line| effect.published(numbers).0[line.frequency])
}

/// The effect beside the law that predicts clearly better than the law alone; or random forcing, where that is far likelier
/// than what the law leaves. `None` where the law leaves no more than noise, or for several releases, whose lines and
/// drifts are each its own.
pub(super) fn beside(releases: &Releases, lengths: &Lengths, found: &Measured) -> Option<Beside> {
    let decay = releases.alone().filter(|_| found.held_out_over_noise > HELD)?;
    let mut structure = found.fit.structure.clone();
    structure.effects.pop();
    let structure = structure.with(&Effect::Measured(Arc::new(found.law.without_line(None))));
    let whole = fit_whole(decay, &structure, &found.fit.numbers(0));
    let tried = |(effect, kind): &(Effect, Kind)| -> Vec<(PieceFit, Kind, Effect)> {
        if structure.effects.contains(effect) {
            return Vec::new();
        }
        let fitted = |start: &Vec<f64>| {
            let common = [&found.fit.common[..], start].concat();
            fit_from(&lengths.long, &structure.with(effect), &common, SETTLED)
        };
        let starts = starts::of(decay, &whole, effect);
        starts.iter().take(STARTS).map(|start| (fitted(start), *kind, effect.clone())).collect()
    };
    let all: Vec<(PieceFit, Kind, Effect)> = TRIED.par_iter().flat_map(tried).collect();
    // A harmonic of the yaw mode is a matter of the law, or of the sensor.
    let is_harmonic = |(fit, _, effect): &(PieceFit, Kind, Effect)| {
        let w_rad_s = frequency_rad_s(effect, &fit.common[fit.start_of(structure.effects.len())..]);
        let near = |w: f64| {
            let windows = || decay.windows.iter().map(|w| w.natural_frequency_rad_s);
            let least = windows().fold(f64::INFINITY, f64::min);
            let most = windows().fold(0.0, f64::max);
            ((1.0 - HARMONIC) * least..(1.0 + HARMONIC) * most).contains(&w)
        };
        w_rad_s.is_some_and(|w| (1..=MOST_HARMONIC).any(|k| near(w / f64::from(k))))
    };
    let least = |a: &&(PieceFit, Kind, Effect), b: &&(PieceFit, Kind, Effect)| {
        a.0.sum().total_cmp(&b.0.sum())
    };
    let better = all
        .iter()
        .filter(|tried| !is_harmonic(tried))
        .min_by(least)
        .map(|(fit, kind, effect)| (fit, *kind, effect, predict_within(&lengths.predicted, fit)))
        .filter(|(.., prediction)| {
            let missed = |p: &Prediction| (p.rms_rad() / decay.noise_rad).powi(2) - 1.0;
            prediction.is_better_than(&found.prediction)
                && missed(prediction) < CLEARLY * missed(&found.prediction)
        });
    if let Some((fit, kind, effect, prediction)) = better {
        let numbers = &fit.common[fit.start_of(structure.effects.len())..];
        return Some(Beside {
            kind,
            effect: effect.clone(),
            held_out_over_noise: prediction.rms_rad() / decay.noise_rad,
            frequency_rad_s: frequency_rad_s(effect, numbers),
        });
    }
    is_random(decay, &whole).then_some(Beside {
        kind: Kind::Randomness,
        effect: Effect::Buffeting,
        held_out_over_noise: found.held_out_over_noise,
        frequency_rad_s: None,
    })
}
