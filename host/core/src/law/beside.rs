//! What a law of angle and rate leaves that no such law could hold: time, a second frequency, the sensor,
//! randomness.

use super::estimate::{fit_whole, Measured};
use crate::diagnosis::forced::is_random;
use crate::diagnosis::guards::HARMONIC;
use crate::diagnosis::likelihood::BREADTH;
use crate::diagnosis::over_pieces::Lengths;
use crate::diagnosis::prediction::{predict_within, Prediction};
use crate::diagnosis::together::Releases;
use crate::diagnosis::verdict::MAX_LEFT;
use crate::discrepancy::ABOVE_NOISE;
use crate::effects::{Acts, Effect};
use crate::fit::fitting::{Fitted, Structure};
use crate::fit::free_decay::{FreeDecay, BEGINNING};
use crate::fit::segments::{fit_from, PieceFit, FIRST, ROUGH, SETTLED};
use crate::fit::starts;
use crate::par_map::ParMap;

/// What no law of angle and rate holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Something that follows time alone, as a drift.
    Time,
    /// A line of the spectrum beside the yaw mode.
    SecondFrequency,
    /// A change of the reading, not of the motion.
    Sensor,
    /// A random moment.
    Randomness,
}

impl Kind {
    /// `None`: of the state, which a law holds.
    fn new(effect: &Effect) -> Option<Self> {
        match effect.acts_on() {
            Acts::State => None,
            Acts::Time => Some(Self::Time),
            Acts::Line => Some(Self::SecondFrequency),
            Acts::Sensor => Some(Self::Sensor),
            Acts::Random => Some(Self::Randomness),
        }
    }

    /// As it is written in JSON.
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
    /// What kind of thing it is.
    pub kind: Kind,
    /// The effect of the library that shows it.
    pub effect: Effect,
    /// Residual over noise, on pieces not fitted, of the law with the effect; of randomness, which cannot be
    /// predicted, of the law alone.
    pub held_out_over_noise: f64,
    /// Of a line, rad/s.
    pub frequency_rad_s: Option<f64>,
    /// Of the release, a long one's beginning, what is not the law's, rad: the law as it is beside the effect; of
    /// randomness, alone.
    pub(crate) residuals_rad: Vec<f64>,
}

/// An effect fitted beside the law.
struct BesideFit {
    effect: Effect,
    fit: PieceFit,
    /// How many numbers of the fit are not the effect's.
    law: usize,
}

impl BesideFit {
    /// Of a line, rad/s.
    fn frequency_rad_s(&self) -> Option<f64> {
        let line = self.effect.line()?;
        Some(self.effect.published(&self.fit.common[self.law..]).0[line.frequency])
    }

    /// Whether it is a line at one of the first five harmonics of the yaw mode, which is a matter of the law,
    /// or of the sensor.
    fn is_harmonic(&self, decay: &FreeDecay) -> bool {
        let windows = || decay.windows.iter().map(|w| w.natural_frequency_rad_s);
        let least = (1.0 - HARMONIC) * windows().fold(f64::INFINITY, f64::min);
        let most = (1.0 + HARMONIC) * windows().fold(0.0, f64::max);
        let is_near = |w: f64| (1..=5).any(|k| (least..most).contains(&(w / f64::from(k))));
        self.frequency_rad_s().is_some_and(is_near)
    }
}

/// An effect beside the law of `structure`, from each of its starts, the law beginning as it was `found`, and
/// as nothing where the effect alone explains much, to which the law has bent; `whole` is the record's fit.
fn fitted(
    decay: &FreeDecay,
    lengths: &Lengths,
    structure: &Structure,
    (found, whole): (&Measured, &Fitted),
    effect: &Effect,
) -> Vec<BesideFit> {
    if structure.effects.contains(effect) {
        return Vec::new();
    }
    let (law, plain) = (&found.fit.common, &found.plain.common);
    let begun = |common: &[f64]| {
        let fit = fit_from(&lengths.long, &structure.with(effect), common, FIRST);
        BesideFit { effect: effect.clone(), fit, law: law.len() }
    };
    let from = |start: &Vec<f64>| {
        let mut all = vec![begun(&[law, start.as_slice()].concat())];
        let alone = [plain.as_slice(), start].concat();
        let alone = fit_from(&lengths.long, &found.plain.structure.with(effect), &alone, ROUGH);
        if alone.sum() < MAX_LEFT * found.plain.sum() {
            let (plain, numbers) = alone.common.split_at(plain.len());
            let no_law = vec![0.0; law.len() - plain.len()];
            all.push(begun(&[plain, &no_law, numbers].concat()));
        }
        all
    };
    starts::of(decay, whole, effect).iter().take(BREADTH).flat_map(from).collect()
}

/// What is not the law's in `decay`, with the law as it is beside the effect that was tried last.
fn not_the_laws(decay: &FreeDecay, tried: &BesideFit) -> Vec<f64> {
    let mut fit = fit_whole(decay, &tried.fit.structure, &tried.fit.numbers(0));
    let from = fit.parameters.len() - tried.effect.parameters().len();
    fit.parameters[from..].fill(0.0);
    let law = fit.readings(&decay.grid);
    decay.yaw_rad.iter().zip(law).map(|(yaw, law)| yaw - law).collect()
}

/// The effect beside the law that predicts clearly better than the law alone; or random forcing, where that
/// is far likelier than what the law leaves. `None` where the law leaves no more than noise, or for several
/// releases, whose lines and drifts are each its own.
pub(super) fn beside(releases: &Releases, lengths: &Lengths, found: &Measured) -> Option<Beside> {
    let decay = releases.alone().filter(|_| found.held_out_over_noise > ABOVE_NOISE)?;
    let decay = &*decay.beginning(BEGINNING);
    let structure = found.with_line();
    let whole = fit_whole(decay, &structure, &found.fit.numbers(0));
    let all = Effect::deterministic()
        .filter(|effect| Kind::new(effect).is_some())
        .par_map(|effect| fitted(decay, lengths, &structure, (found, &whole), &effect));
    let mut all: Vec<BesideFit> = all.flatten().filter(|tried| !tried.is_harmonic(decay)).collect();
    all.sort_by(|a, b| a.fit.sum().total_cmp(&b.fit.sum()));
    let settled = |tried: &BesideFit| {
        let PieceFit { structure, common, .. } = &tried.fit;
        let fit = fit_from(&lengths.long, structure, common, SETTLED);
        BesideFit { fit, effect: tried.effect.clone(), ..*tried }
    };
    all.truncate(BREADTH);
    let nearest = all
        .iter()
        .par_map(settled)
        .filter(|tried| !tried.is_harmonic(decay))
        .min_by(|a, b| a.fit.sum().total_cmp(&b.fit.sum()));
    let missed = |p: &Prediction| (p.rms_rad() / decay.noise_rad).powi(2) - 1.0;
    let clearly = |p: &Prediction| {
        p.is_better_than(&found.prediction) && missed(p) < MAX_LEFT * missed(&found.prediction)
    };
    let predicted = nearest.map(|t| (predict_within(&lengths.predicted, &t.fit), t));
    if let Some((prediction, tried)) = predicted.filter(|(p, _)| clearly(p)) {
        let residuals_rad = not_the_laws(decay, &tried);
        return Some(Beside {
            kind: Kind::new(&tried.effect)?,
            held_out_over_noise: prediction.rms_rad() / decay.noise_rad,
            frequency_rad_s: tried.frequency_rad_s(),
            effect: tried.effect,
            residuals_rad,
        });
    }
    is_random(decay, &whole).then_some(Beside {
        kind: Kind::Randomness,
        effect: Effect::random(),
        held_out_over_noise: found.held_out_over_noise,
        frequency_rad_s: None,
        residuals_rad: whole.residuals,
    })
}
