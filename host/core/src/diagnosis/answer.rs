//! The options of a diagnosis, and what it answers.

use crate::diagnosis::compare::Where;
use crate::effects::Effect;
use crate::fit::at_amplitude::AtAmplitude;
use crate::fit::fitting::{held_out_over_noise, refit, Covariance, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::quantity::Quantity;
use crate::record::Said;
use crate::stop::Stop;
use serde::Serialize;
use std::collections::BTreeMap;

/// Share of the record that is fitted when the rest is held out.
pub const FITTED_SHARE: f64 = 0.65;

/// Share of the amplitude that may be left where a model mostly explains a record.
const SMALL_RESIDUAL: f64 = 0.01;
/// The same of the plain model's mean square.
pub(super) const MOST_LEFT: f64 = 0.25;

/// What is left where a model explains the record.
pub(super) const NOISE: &str = "no more than the noise";

/// How a record is judged.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The sensor's zero is not known: it is fitted, and a constant moment cannot be distinguished from it.
    pub zero_unknown: bool,
    /// The user's own effects, to compete with those of the library, which take part anyway.
    pub own: Vec<Effect>,
    /// Effects and limits of the model that is there: they stay, and what it lacks is looked for.
    pub present: Structure,
    /// On which the user's own effects may depend; 0: off, or not known.
    pub wind_speed_m_s: f64,
    /// The search ends when this asks for it.
    pub stop: Stop,
}

impl Options {
    /// For what is recorded in `decay`: where that is no angle, its zero is the sensor's own.
    pub(crate) fn of(&self, decay: &FreeDecay) -> Self {
        let zero_unknown = self.zero_unknown || !decay.measurand.shows_rest();
        Self { zero_unknown, ..self.clone() }
    }
}

/// An effect tried beside the model that was there, by itself.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    /// Of the library, or the user's own.
    pub effect: Effect,
    /// What the model with it leaves, over the noise of block means: about 1 where nothing is missing.
    pub residual_over_noise: f64,
    /// Difference of BIC in favour of the model with it; above [`crate::bic::MARGIN`] it is believed.
    pub evidence: f64,
    /// Whether its fit reached a minimum; what has not is not ranked.
    pub converged: bool,
    /// Why it does not stand although it helps: numbers that physics forbids or that the record does not fix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// The verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The plain model explains the record to its noise.
    Adequate,
    /// It does with the effects named.
    Explained,
    /// The effects named survive prediction and account for most of what is missing; the rest is said.
    MostlyExplained,
    /// Something is missing that the library does not hold, or not enough of it.
    Unexplained,
}

/// What a model leaves. Rms of block means.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Left {
    /// Rms of the block means less the model.
    pub rms_deg: f64,
    /// Of the rms.
    #[serde(skip)]
    pub unit: String,
    /// The rms as a share of the largest amplitude.
    pub share_of_amplitude: f64,
    /// Its square as a share of the mean square that the plain model, its rest angle fitted, leaves.
    pub share_of_misfit: f64,
    /// Kind and amplitudes, in words.
    #[serde(rename = "where")]
    pub where_: String,
}

impl Left {
    /// Made what a filter does not foresee, in place of what a definite model leaves.
    pub(super) fn is_of_innovations(&mut self, rms_deg: f64, is_explained: bool) {
        let share = rms_deg / self.rms_deg;
        self.rms_deg = rms_deg;
        self.share_of_amplitude *= share;
        self.share_of_misfit *= share * share;
        if is_explained {
            self.where_ = NOISE.into();
        }
    }

    /// What is to be said where `effects` leave this: of a definite model, chosen by what it predicts.
    pub(crate) fn status(&self, is_explained: bool, effects: &[Effect]) -> Status {
        let more = effects.iter().any(|e| !e.moves_rest());
        match (is_explained, effects.is_empty()) {
            (true, true) => Status::Adequate,
            (true, false) => Status::Explained,
            (false, _) if self.share_of_amplitude < SMALL_RESIDUAL => Status::MostlyExplained,
            (false, _) if more && self.share_of_misfit < MOST_LEFT => Status::MostlyExplained,
            (false, _) => Status::Unexplained,
        }
    }
}

/// All that is said about one record. Rms in deg, ratios to the noise floor of block means.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// What the record holds, where that is no angle in deg.
    #[serde(flatten)]
    pub said: Said,
    /// Standard deviation of the noise of one sample.
    pub noise_rms_deg: f64,
    /// The same of the block means, to which `residual_over_noise` refers.
    pub mean_noise_deg: f64,
    /// The verdict.
    pub status: Status,
    /// In the order in which they help.
    pub effects: Vec<Effect>,
    /// An accepted effect and one that does as well in its place.
    pub indistinguishable: Vec<[Effect; 2]>,
    /// Natural frequency and damping ratio at rest, of the model of the verdict.
    pub modal: Modal,
    /// Of the model of the verdict, from the largest amplitude to the smallest; none where it is random.
    pub at_amplitude: Vec<AtAmplitude>,
    /// Of the numbers of the model of the verdict.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// From the model that was there to that of the verdict, an effect more at each.
    pub steps: Vec<Step>,
    /// Every effect alone, best first.
    pub candidates: Vec<Candidate>,
    /// Where the model of the verdict fails, a random moment left out of it.
    #[serde(rename = "where")]
    pub where_: Where,
    /// What the model leaves, where it was chosen by prediction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left: Option<Left>,
    /// The answer in one sentence, where it was chosen by prediction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sentence: Option<String>,
    /// Angle of rest on the sensor's scale, about which the effects of such a model act.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_angle_deg: Option<Quantity>,
}

impl Diagnosis {
    /// Of each effect that helps and does not stand, why.
    pub fn refusals(&self) -> Vec<String> {
        let refusal = |c: &Candidate| Some(format!("{} refused: {}", c.effect, c.reason.as_ref()?));
        self.candidates.iter().filter_map(refusal).collect()
    }
}

/// The linear part of a model at rest: what small oscillations would show.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Modal {
    /// Undamped.
    pub natural_frequency_rad_s: Quantity,
    /// Negative where small oscillations grow.
    pub damping_ratio: Quantity,
}

/// One model on the way from plain to final.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// The effect that the step before lacks; `None` for the model that was there.
    pub added: Option<Effect>,
    /// Rms of the samples less the model.
    pub residual_rms_deg: f64,
    /// Rms of the block means less the model, over the noise of such a mean.
    pub residual_over_noise: f64,
    /// On parts of the record that were not fitted; by a smaller model on the way where that predicts better.
    pub held_out_over_noise: f64,
    /// `effect.name` and its value with u, in the units that [`Effect::parameters`] states.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Quantity>,
}

/// A diagnosis with the fits it rests on.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// With the noise floor as the best model shows it.
    pub decay: FreeDecay,
    /// The present model with every effect of the library beside it, one at a time.
    pub singles: Vec<Fitted>,
    /// From the present model to the one of the verdict; the present model alone where that is random.
    pub path: Vec<Fitted>,
}

pub(crate) fn modal(model: &Fitted) -> Modal {
    Modal {
        natural_frequency_rad_s: model.natural_frequency_rad_s(),
        damping_ratio: model.damping_ratio(),
    }
}

/// What is said of `model`, whose last effect is the `effects`th (0: none was added): its residuals on what
/// it was fitted to, and on the later part held out from another fit.
pub fn step(decay: &FreeDecay, model: &Fitted, effects: usize) -> Step {
    let count = (FITTED_SHARE * decay.yaw_rad.len() as f64) as usize;
    let partial = refit(decay, model, count);
    Step {
        added: effects.checked_sub(1).map(|k| model.structure.effects[k].clone()),
        residual_rms_deg: decay.raw_rms_deg(model.rms_rad()),
        residual_over_noise: model.over_noise(decay),
        held_out_over_noise: held_out_over_noise(decay, &partial),
        parameters: model.effect_parameters().into_iter().collect(),
    }
}
