//! The options of a diagnosis, and what it answers.

use crate::derivatives::table::Point;
use crate::diagnosis::compare::Where;
pub use crate::diagnosis::origin::Condition;
use crate::diagnosis::origin::Origin;
use crate::diagnosis::wind::{Dimensionless, GrowsAs};
use crate::effects::{Effect, SourceKind};
use crate::fit::at_amplitude::AtAmplitude;
use crate::fit::fitting::{
    held_out_over_noise, refit, Covariance, Fitted, Limit, Modal, Number, Structure,
};
use crate::fit::free_decay::FreeDecay;
use crate::linearity::Jumps;
use crate::quantity::Quantity;
use crate::record::Said;
use crate::roll::{RollDecay, Ship};
use crate::stop::Stop;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;

/// Share of the record that is fitted when the rest is held out.
pub const FITTED_SHARE: f64 = 0.65;

/// How a record is judged.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The sensor's zero is not known: it is fitted, and a constant moment cannot be distinguished from it.
    pub zero_unknown: bool,
    /// The user's own effects, to compete with those of the library, which take part anyway.
    pub own: Vec<Effect>,
    /// Effects and limits of the model that is there: they stay, and what it lacks is looked for.
    pub present: Structure,
    /// On which effects may depend; 0: off, or not known.
    pub wind_speed_m_s: f64,
    /// Of several releases of a rig, each one's, where they are not in the same wind.
    pub wind_speeds_m_s: Vec<f64>,
    /// The search ends when this asks for it.
    pub stop: Stop,
}

impl Options {
    /// For a release in this wind: what of the present model does nothing in it is not looked for.
    pub(crate) fn in_wind(&self, wind_speed_m_s: f64) -> Self {
        let mut options = self.clone();
        for effect in &self.present.effects {
            let numbers = 0..effect.parameters().len();
            let idle = numbers.filter(|number| !effect.acts_at(*number, wind_speed_m_s));
            options.present.limits.extend(idle.map(|number| Limit {
                number: Number::Of(effect.clone(), number),
                low: 0.0,
                high: 0.0,
            }));
        }
        options
    }

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
    #[serde(rename = "evidence")]
    pub delta_bic: f64,
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

/// All that is said about the releases that were judged, be it one, several of a rig or a campaign. Rms in
/// deg, ratios to the noise floor of block means.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// What the records hold, where that is no angle in deg.
    #[serde(flatten)]
    pub said: Said,
    /// Standard deviation of the noise of one sample, all releases together.
    pub noise_rms_deg: f64,
    /// The same of the block means, to which `residual_over_noise` refers.
    pub mean_noise_deg: f64,
    /// The verdict for all releases.
    pub status: Status,
    /// In the order in which they help.
    pub effects: Vec<Effect>,
    /// An accepted effect and one that does as well in its place.
    pub indistinguishable: Vec<[Effect; 2]>,
    /// By effect of a campaign.
    pub origin: BTreeMap<String, Origin>,
    /// Of the effects those whose ± is half of the number: what the model lacks might stand in for them, but
    /// without them it predicts worse.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub needed_by_prediction: Vec<Effect>,
    /// By effect of a campaign: what its origin was decided from, in words.
    pub origin_reason: BTreeMap<String, String>,
    /// By effect of a campaign with several wind speeds: whether its coefficient goes with a power of the
    /// speed.
    pub grows_as: BTreeMap<String, GrowsAs>,
    /// By effect of a campaign that goes with the wind so: the dimensionless derivative that it is.
    pub dimensionless: BTreeMap<String, Dimensionless>,
    /// By effect of a campaign: as a model of its releases takes it, `mechanical`, `aerodynamic` or
    /// `each_wind`.
    pub source: BTreeMap<String, SourceKind>,
    /// Whether the effects act about the angle of rest, as with a zero that is fitted, not about the
    /// sensor's.
    pub about_rest: bool,
    /// By effect: which releases have one coefficient.
    pub sharing: BTreeMap<String, &'static str>,
    /// Of all releases, where they have it in common.
    pub modal: Option<Modal>,
    /// From the model that was there to that of the verdict, an effect more at each.
    pub steps: Vec<Step>,
    /// What `held_out_over_noise` was held out.
    pub held_out: HeldOut,
    /// Every effect alone, best first: the gains added of the releases (eight at most) that are explained
    /// worst.
    pub candidates: Vec<Candidate>,
    /// Effects of the library that were not tried, as the measured law in the present model accounts for all
    /// that they do.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held_by_law: Vec<Effect>,
    /// By effect of a campaign: the first of its numbers in each condition, free of all others.
    pub coefficients: BTreeMap<String, Vec<Coefficient>>,
    /// In the order in which they were given.
    pub releases: Vec<ReleaseVerdict>,
    /// Where the model of the verdict fails, a random moment left out of it, in the release that is explained
    /// worst.
    #[serde(rename = "where")]
    pub where_: Where,
    /// File of that release.
    pub where_release: String,
    /// What the model of the verdict leaves, all releases together.
    pub left: Left,
    /// Jumps of the reading in what is left of that release: a converter's or a sensor's. `None` where there are
    /// none, or nothing is left.
    pub jumps: Option<Jumps>,
    /// The answer in one sentence.
    pub sentence: String,
    /// Of a campaign; `None` where there is no point to compute.
    pub derivatives: Option<BeforeAndAfter>,
}

/// What was held out of the fits by which models are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HeldOut {
    /// The later part of each release.
    LaterPart,
    /// Every second piece of the releases, from the others.
    Pieces,
    /// Releases, with the coefficients of their effects known from the others: of a campaign the last repeat
    /// of each condition, else each once.
    Releases,
}

impl HeldOut {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::LaterPart => "the later part of each release",
            Self::Pieces => "pieces, from the other pieces",
            Self::Releases => "releases, with the effects' coefficients known from the others",
        }
    }
}

/// One release's share of the answer.
#[derive(Clone, Debug, Serialize)]
pub struct ReleaseVerdict {
    /// As it was named.
    pub file: String,
    /// In which condition, of a campaign.
    #[serde(flatten)]
    pub condition: Option<Condition>,
    /// Standard deviation of the noise of one sample.
    pub noise_rms_deg: f64,
    /// Of the model of the verdict at rest.
    #[serde(flatten, serialize_with = "with_its_numbers")]
    pub modal: Modal,
    /// Where the motion comes to rest, on the sensor's scale.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_angle_deg: Option<Quantity>,
    /// Rms of the block means less the model that was there, over the noise of such a mean.
    pub before_over_noise: f64,
    /// Rms of the samples less the model of the verdict.
    pub residual_rms_deg: f64,
    /// Rms of the block means less that model, over the noise of such a mean.
    pub residual_over_noise: f64,
    /// Whether it leaves no more than noise of this release.
    pub explained: bool,
    /// `effect.name` and its value with u, in the units that [`Effect::parameters`] states.
    pub parameters: BTreeMap<String, Quantity>,
    /// From the largest amplitude to the smallest; none where the model is random.
    pub at_amplitude: Vec<AtAmplitude>,
    /// Of the numbers of the model of the verdict; `None` where it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// The same in the coefficients of naval architecture, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll: Option<RollDecay>,
}

/// `modal`, and its numbers beside it.
fn with_its_numbers<S: Serializer>(modal: &Modal, to: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Both<'a> {
        modal: &'a Modal,
        #[serde(flatten)]
        numbers: &'a Modal,
    }
    Both { modal, numbers: modal }.serialize(to)
}

/// The size of an effect in one condition.
#[derive(Clone, Debug, Serialize)]
pub struct Coefficient {
    /// Of the releases it was fitted to by themselves.
    #[serde(flatten)]
    pub condition: Condition,
    /// Name of the parameter within the effect.
    pub name: String,
    /// Of the value and its u.
    pub unit: String,
    /// Fitted.
    #[serde(flatten)]
    pub quantity: Quantity,
}

/// The derivatives from wn and zeta of the plain model and of the final one.
#[derive(Clone, Debug, Serialize)]
pub struct BeforeAndAfter {
    /// As the derivatives of the campaign are without a diagnosis: each release by one damped mode.
    pub before: Vec<Point>,
    /// By the final model of each release.
    pub after: Vec<Point>,
}

/// A diagnosis with the fits it rests on, in the order of the releases.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// With the noise floors as the best models show them.
    pub decays: Vec<FreeDecay>,
    /// The present model with every effect of the library beside it, one at a time; of one release.
    pub singles: Vec<Fitted>,
    /// From the present model to that of the verdict, each release's fit; what is random is in none.
    pub path: Vec<Vec<Fitted>>,
}

impl Diagnosed {
    /// The models of release `i`, from the present one to that of the verdict.
    pub fn models(&self, i: usize) -> impl DoubleEndedIterator<Item = &Fitted> {
        self.path.iter().map(move |fits| &fits[i])
    }

    /// The model of the verdict, of release `i`.
    pub fn last(&self, i: usize) -> &Fitted {
        &self.path[self.path.len() - 1][i]
    }
}

impl Diagnosis {
    /// Of each effect that helps and does not stand, and of those that were not tried, why.
    pub fn refusals(&self) -> Vec<String> {
        let refusal = |c: &Candidate| Some(format!("{} refused: {}", c.effect, c.reason.as_ref()?));
        let held: Vec<&str> = self.held_by_law.iter().map(Effect::id).collect();
        let not_tried = (!held.is_empty()).then(|| {
            format!(
                "{} not tried: the measured law in the model accounts for all they do",
                held.join(", ")
            )
        });
        self.candidates.iter().filter_map(refusal).chain(not_tried).collect()
    }

    /// Whether what is left is more than noise.
    pub fn lacks_more(&self) -> bool {
        matches!(self.status, Status::Unexplained | Status::MostlyExplained)
    }

    /// The verdict, where there is one release.
    pub fn only(&self) -> Option<&ReleaseVerdict> {
        match &self.releases[..] {
            [only] => Some(only),
            _ => None,
        }
    }

    /// With each release in the coefficients of naval architecture.
    pub fn of_ship(mut self, ship: Option<Ship>) -> Self {
        for r in &mut self.releases {
            let (modal, at) = (&r.modal, &r.at_amplitude);
            r.roll = Some(RollDecay::of_model(modal, &self.effects, &r.parameters, at, ship));
        }
        self
    }
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

/// Gives each of `steps` the error held out of a smaller one where that predicts better: two effects may be
/// needed before either does.
pub(super) fn hold_least(steps: &mut [Step]) {
    let mut least = f64::INFINITY;
    for step in steps {
        least = least.min(step.held_out_over_noise);
        step.held_out_over_noise = least;
    }
}

/// Means of the part from which the later one is predicted.
pub(super) fn earlier_count(decay: &FreeDecay) -> usize {
    (FITTED_SHARE * decay.yaw_rad.len() as f64) as usize
}

/// What is said of `model`, which has `added` beyond the one before: its residuals on what it was fitted to,
/// and on the later part held out from another fit.
pub fn step(decay: &FreeDecay, model: &Fitted, added: Option<&Effect>) -> Step {
    let partial = refit(decay, model, earlier_count(decay));
    Step {
        added: added.cloned(),
        residual_rms_deg: decay.raw_rms_deg(model.rms_rad()),
        residual_over_noise: model.over_noise(decay),
        held_out_over_noise: held_out_over_noise(decay, &partial),
        parameters: model.effect_parameters().into_iter().collect(),
    }
}
