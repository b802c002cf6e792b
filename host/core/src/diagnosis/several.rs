//! What several releases of one rig lack, judged as one.
//!
//! Each release has a natural frequency, damping ratio, rest angle and state of its own, and unless asked
//! otherwise one coefficient of each effect is common to all. The effects are those that the releases' own
//! answers name, as far as all of them need them. Where a model with these is not down to the noise, they are
//! those that survive prediction over the pieces of all releases, as over those of one.

use crate::diagnosis::account;
use crate::diagnosis::answer::{Candidate, Left, Options};
use crate::diagnosis::campaign_fit::{in_common, OWN};
use crate::diagnosis::compare::{self, Where};
use crate::diagnosis::diagnose::{modal, name_of, Modal, Status, Step};
use crate::diagnosis::likelihood::are_explained;
use crate::diagnosis::origin::weighted_mean;
use crate::diagnosis::releases::{self, mean_square, ReleaseAnswers, Releases};
use crate::diagnosis::several_fit::{by_prediction, in_common_at_once, Path};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::at_amplitude::{at_amplitudes, AtAmplitude};
use crate::fit::fitting::{Covariance, Fitted, Structure};
use crate::fit::floor;
use crate::fit::free_decay::FreeDecay;
use crate::identify::gaps::Warning;
use crate::quantity::Quantity;
use crate::record::{Record, Said};
use crate::roll::{RollDecay, Ship};
use serde::Serialize;
use std::collections::BTreeMap;

pub use crate::diagnosis::several_fit::Common;

/// All that is said about several releases. Rms in deg, ratios to the noise floor of block means.
#[derive(Clone, Debug, Serialize)]
pub struct SeveralDiagnosis {
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
    /// Every effect alone, best first: the gains added of the releases (eight at most) that are explained
    /// worst.
    pub candidates: Vec<Candidate>,
    /// Of all releases, where they have it in common.
    pub modal: Option<Modal>,
    /// From the model that was there to the final one, an effect more at each.
    pub steps: Vec<Step>,
    /// What `held_out_over_noise` was held out.
    pub held_out: &'static str,
    /// By effect: whether its coefficients are one for all releases.
    pub sharing: BTreeMap<String, &'static str>,
    /// What the final model leaves, all releases together.
    pub left: Left,
    /// The answer in one sentence.
    pub sentence: String,
    /// In the order in which the records were given.
    pub records: Vec<OfRecord>,
    /// Of the release that is explained worst.
    #[serde(rename = "where")]
    pub where_: Where,
    /// File of that release.
    pub where_release: String,
    /// What is to be said of the records, each with its name.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

/// One release's share of the answer.
#[derive(Clone, Debug, Serialize)]
pub struct OfRecord {
    /// The record's own name.
    pub file: String,
    /// Of the final model at rest; the same in all where they have it in common.
    pub modal: Modal,
    /// Where the motion comes to rest, on the sensor's scale.
    pub rest_angle_deg: Quantity,
    /// Rms of the samples less the final model.
    pub residual_rms_deg: f64,
    /// Rms of the block means less the final model, over the noise of such a mean.
    pub residual_over_noise: f64,
    /// `effect.name` and its value with u, in the units that [`Effect::parameters`] states.
    pub parameters: BTreeMap<String, Quantity>,
    /// From the largest amplitude to the smallest; none where the model is random.
    pub at_amplitude: Vec<AtAmplitude>,
    /// Of the numbers of the final model; `None` where it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// The same in the coefficients of naval architecture, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll: Option<RollDecay>,
}

/// A diagnosis of several releases with the fits it rests on.
#[derive(Clone, Debug)]
pub struct DiagnosedSeveral {
    /// The answer.
    pub diagnosis: SeveralDiagnosis,
    /// With the noise floors as the releases' own answers show them, in the order of the records.
    pub decays: Vec<FreeDecay>,
    /// The model of the verdict, of each release; what is random is not in it.
    pub fits: Vec<Fitted>,
}

/// Judges `records`, releases of one rig, as one.
///
/// # Errors
/// As [`diagnose_several_with_fits`].
pub fn diagnose_several(
    records: &[Record],
    common: &Common,
    options: &Options,
) -> Result<SeveralDiagnosis> {
    Ok(diagnose_several_with_fits(records, common, options)?.diagnosis)
}

/// Judges `records`, releases of one rig, as one, and keeps what was fitted.
///
/// # Errors
/// Naming the record without a free decay; a present model that cannot be fitted; interrupted.
pub fn diagnose_several_with_fits(
    records: &[Record],
    common: &Common,
    options: &Options,
) -> Result<DiagnosedSeveral> {
    let wind_speed_m_s = vec![options.wind_speed_m_s; records.len()];
    let mut releases = Releases::of(records, wind_speed_m_s, options)?;
    let options = &options.of(&releases.decays[0]);
    // Each release has a rest angle of its own, which a constant moment would be once more.
    let (rests, present): (Vec<Effect>, Vec<Effect>) =
        options.present.effects.iter().cloned().partition(Effect::moves_rest);
    let effects = present.clone();
    let structure = Structure { zero_unknown: true, effects, ..options.present.clone() };
    let judged = releases::judge(records, &mut releases, &structure, options)?;
    let random = Effect::random();
    let rest = Effect::of_rest();
    let is_forced = judged.alone.mostly(&random, |_| true);
    let mut named = Vec::new();
    if !options.zero_unknown && rests.is_empty() && judged.alone.mostly(&rest, |_| true) {
        named.push(rest);
    }
    let explains = |fits: &[Fitted]| are_explained(fits, &releases.decays);
    let each = judged.path.last().expect("a model");
    // What pieces do not show is not judged by them.
    let at_once = is_forced || !present.iter().all(Effect::shows_in_pieces);
    let near = (at_once || explains(&each.fits))
        .then(|| {
            let model = |model| in_common_at_once(&releases, model, common);
            judged.path.iter().map(model).collect::<Vec<Path>>()
        })
        .filter(|path| at_once || path.last().is_some_and(|p| explains(&p.joint.fits)));
    let (mut path, indistinguishable, held_out) = match near {
        Some(path) => {
            let alike = judged.alone.indistinguishable(&each.effects);
            (path, alike, "each release, from the others")
        }
        None => {
            for (decay, record) in releases.decays.iter_mut().zip(records) {
                *decay = floor::with_steps(decay.clone(), record);
            }
            let (path, alike) = by_prediction(&releases, &judged, common, options, &structure)?;
            (path, alike, "pieces of the releases, from the other pieces")
        }
    };
    options.stop.check()?;
    let present = &options.present.effects;
    let mut found = told(records, &releases.decays, &path, common, named, present, held_out);
    found.candidates = judged.alone.candidates();
    found.indistinguishable = indistinguishable;
    if is_forced && found.status != Status::Explained {
        found.add_random(&judged, &random, name_of(&options.present.effects));
    }
    let fits = path.pop().expect("a model").joint.fits;
    Ok(DiagnosedSeveral { diagnosis: found, decays: releases.decays, fits })
}

fn told(
    records: &[Record],
    decays: &[FreeDecay],
    path: &[Path],
    common: &Common,
    named: Vec<Effect>,
    present: &[Effect],
    held_out: &'static str,
) -> SeveralDiagnosis {
    let mut least = f64::INFINITY;
    let mut before: &[Effect] = present;
    let mut effects = named;
    let mut steps = Vec::new();
    for Path { effects: here, joint, held_out_over_noise } in path {
        least = least.min(*held_out_over_noise);
        let added = here.iter().find(|e| !before.contains(e)).cloned();
        before = here;
        effects.extend(added.clone());
        let raw = |(f, d): (&Fitted, &FreeDecay)| d.raw_rms_deg(f.rms_rad()).powi(2);
        let raws = joint.fits.iter().zip(decays).map(raw);
        let own = |name: &str| {
            let of = |e: &Effect| name.strip_prefix(e.id()).is_some_and(|n| n.starts_with('.'));
            common.own.iter().any(of)
        };
        steps.push(Step {
            added,
            residual_rms_deg: (raws.sum::<f64>() / decays.len() as f64).sqrt(),
            residual_over_noise: joint.over_noise(),
            held_out_over_noise: least,
            parameters: in_common(joint).into_iter().filter(|(name, _)| !own(name)).collect(),
        });
    }
    let last = &path.last().expect("a model").joint.fits;
    let names: Vec<String> = records.iter().map(|r| r.file.display().to_string()).collect();
    let files: Vec<&str> = names.iter().map(String::as_str).collect();
    let left = releases::left(&path[0].joint.fits, last, decays, &files);
    let shared = |e: &Effect| {
        let own = common.own.contains(e) || e.moves_rest();
        (e.to_string(), if own { OWN } else { "one for all releases" })
    };
    let worst = releases::worst(last, decays);
    let record = |((fit, file), decay): ((&Fitted, &String), &FreeDecay)| {
        let rest = fit.rest_rad().expect("a rest angle that was fitted");
        let mut parameters: BTreeMap<String, Quantity> =
            fit.effect_parameters().into_iter().collect();
        parameters
            .extend(effects.iter().any(Effect::moves_rest).then(|| account::moment_of_rest(fit)));
        OfRecord {
            file: file.clone(),
            modal: modal(fit),
            rest_angle_deg: rest.by(|x| decay.measurand.shown(x)),
            residual_rms_deg: decay.raw_rms_deg(fit.rms_rad()),
            residual_over_noise: fit.over_noise(decay),
            parameters,
            at_amplitude: at_amplitudes(decay, fit),
            covariance: fit.named_covariance(),
            roll: None,
        }
    };
    let shown = |rms_rad: f64| decays[0].measurand.shown(rms_rad);
    SeveralDiagnosis {
        said: decays[0].measurand.said(),
        noise_rms_deg: shown(mean_square(decays, |d| d.sample_noise_rad)),
        mean_noise_deg: shown(mean_square(decays, |d| d.noise_rad)),
        status: left.status(are_explained(last, decays), &effects),
        indistinguishable: Vec::new(),
        candidates: Vec::new(),
        modal: common.same_rig.then(|| modal(&last[0])),
        steps,
        held_out,
        sharing: effects.iter().map(shared).collect(),
        sentence: account::sentence(&effects, &left, name_of(present)),
        records: last.iter().zip(&names).zip(decays).map(record).collect(),
        effects,
        left,
        where_: compare::locate(&decays[worst], &last[worst]),
        where_release: names[worst].clone(),
        warnings: decays.iter().flat_map(|d| d.warnings.clone()).collect(),
    }
}

impl SeveralDiagnosis {
    /// With each record in the coefficients of naval architecture.
    pub fn of_ship(mut self, ship: Option<Ship>) -> Self {
        for r in &mut self.records {
            let (modal, at) = (&r.modal, &r.at_amplitude);
            r.roll = Some(RollDecay::of_model(modal, &self.effects, &r.parameters, at, ship));
        }
        self
    }

    /// What most releases name alone: a random moment, of another course in each, beside what they have in
    /// common.
    fn add_random(&mut self, judged: &ReleaseAnswers, random: &Effect, model: &str) {
        let said =
            |of: &crate::diagnosis::answer::Diagnosed| of.diagnosis.status == Status::Explained;
        let all = judged.alone.answers.iter().all(said);
        self.status = if all { Status::Explained } else { Status::Unexplained };
        self.effects.retain(|e| judged.alone.mostly(e, |_| true));
        self.effects.push(random.clone());
        self.sharing.insert(random.to_string(), OWN);
        for (release, answer) in judged.alone.which.iter().zip(&judged.alone.answers) {
            let last = answer.diagnosis.steps.last().expect("a step");
            let record = &mut self.records[*release];
            record.modal = answer.diagnosis.modal;
            record.parameters.clone_from(&last.parameters);
            record.residual_over_noise = last.residual_over_noise;
            record.residual_rms_deg = last.residual_rms_deg;
            record.at_amplitude.clear();
            record.covariance = None;
        }
        let over: f64 = self.records.iter().map(|r| r.residual_over_noise.powi(2)).sum();
        let over = (over / self.records.len() as f64).sqrt();
        let raw: f64 = self.records.iter().map(|r| r.residual_rms_deg.powi(2)).sum();
        self.steps.push(Step {
            added: Some(random.clone()),
            residual_rms_deg: (raw / self.records.len() as f64).sqrt(),
            residual_over_noise: over,
            // Innovations are one step ahead throughout.
            held_out_over_noise: over,
            parameters: BTreeMap::new(),
        });
        let mean =
            |of: fn(&Modal) -> Quantity| weighted_mean(self.records.iter().map(|r| of(&r.modal)));
        let both = mean(|m| m.natural_frequency_rad_s).zip(mean(|m| m.damping_ratio));
        if let (Some(modal), Some((wn, zeta))) = (&mut self.modal, both) {
            *modal = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
        }
        self.left.is_of_innovations(over * self.mean_noise_deg, all);
        self.sentence = account::sentence(&self.effects, &self.left, model);
    }
}

#[cfg(test)]
#[path = "several_tests.rs"]
mod tests;
