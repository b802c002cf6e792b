//! What several releases of one rig lack, judged as one.
//!
//! Each release has a natural frequency, damping ratio, rest angle and state of its own, and unless asked
//! otherwise one coefficient of each effect is common to all. The effects are those that the releases' own
//! answers name, as far as all of them need them. Where a model with these is not down to the noise, those
//! are kept without which a release that was left out is predicted worse: its own numbers are estimated anew,
//! what is common comes from the others.

use crate::diagnosis::account;
use crate::diagnosis::alike::alike_in_releases;
use crate::diagnosis::alone::most_first;
use crate::diagnosis::answer::{Candidate, Left, Options};
use crate::diagnosis::campaign_fit::in_common;
use crate::diagnosis::compare::{self, Where};
use crate::diagnosis::diagnose::{modal, name_of, Modal, Status, Step};
use crate::diagnosis::likelihood::are_explained;
use crate::diagnosis::origin::weighted_mean;
use crate::diagnosis::releases::{self, mean_square, ReleaseAnswers, Releases, MOST_EFFECTS};
use crate::diagnosis::shared_set::{Set, Surviving};
use crate::diagnosis::survivors;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::at_amplitude::{at_amplitudes, AtAmplitude};
use crate::fit::fitting::{Covariance, Fitted, Structure};
use crate::fit::floor;
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::identify::gaps::Warning;
use crate::quantity::Quantity;
use crate::record::{Record, Said};
use crate::roll::{RollDecay, Ship};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

pub use crate::diagnosis::shared_set::Common;

/// Where a coefficient is not common.
const EACH_ITS_OWN: &str = "each release its own";

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

/// Models of all releases from plain to final, and what each predicts.
struct Path {
    effects: Vec<Effect>,
    joint: JointFit,
    held_out_over_noise: f64,
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
    let near = (is_forced || explains(&each.fits))
        .then(|| in_common_at_once(&releases, &judged, common))
        .filter(|path| is_forced || path.last().is_some_and(|p| explains(&p.joint.fits)));
    let (mut path, indistinguishable) = match near {
        Some(path) => (path, judged.alone.indistinguishable(&each.effects)),
        None => by_prediction(records, &releases, &judged, common, options, &present)?,
    };
    options.stop.check()?;
    let mut found = told(records, &releases.decays, &path, common, named, &options.present.effects);
    found.candidates = judged.alone.candidates();
    found.indistinguishable = indistinguishable;
    if is_forced && found.status != Status::Explained {
        found.add_random(&judged, &random, name_of(&options.present.effects));
    }
    let fits = path.pop().expect("a model").joint.fits;
    Ok(DiagnosedSeveral { diagnosis: found, decays: releases.decays, fits })
}

/// The models that the releases' own answers lead to, with what is common in common.
fn in_common_at_once(releases: &Releases, judged: &ReleaseAnswers, common: &Common) -> Vec<Path> {
    let whole: Vec<Release> = releases.decays.iter().map(Release::whole).collect();
    let n = whole.len();
    let of_model = |model: &releases::ModelOfReleases| {
        let each = |is_own: bool| (0..n).map(move |i| if is_own { i } else { 0 });
        let groups = |e: &Effect| each(common.own.contains(e)).map(Some).collect();
        let sharing = Sharing {
            modal: each(!common.same_rig).collect(),
            effects: model.effects.iter().map(groups).collect(),
        };
        let structure =
            Structure { effects: model.effects.clone(), ..model.fits[0].structure.clone() };
        let fits: Vec<&Fitted> = model.fits.iter().collect();
        let joint = joint::fit_from(&whole, &structure, &sharing, &fits);
        // Each is held out once.
        let alone = |i| releases::from_others(&releases.decays, &joint, &[i], |_, _| None);
        let held: Vec<Fitted> = (0..n).into_par_iter().flat_map(alone).collect();
        let held_out_over_noise = releases::over_noise(&held, &releases.decays);
        let joint = joint.with_discrepancy(&whole);
        Path { effects: model.effects.clone(), joint, held_out_over_noise }
    };
    judged.path.iter().map(of_model).collect()
}

/// The models whose effects survive prediction, release by release.
fn by_prediction(
    records: &[Record],
    releases: &Releases,
    judged: &ReleaseAnswers,
    common: &Common,
    options: &Options,
    present: &[Effect],
) -> Result<(Vec<Path>, Vec<[Effect; 2]>)> {
    let begun: Vec<Surviving> = records
        .iter()
        .zip(&releases.decays)
        .map(|(record, decay)| {
            let survivors = survivors::search(decay, &options.own, &Structure::default())?;
            Ok(Surviving { decay: floor::with_steps(decay.clone(), record), survivors })
        })
        .collect::<Result<_>>()?;
    // From all that survives somewhere down to the plain model, what is missed least left out first.
    let effects = proposed(&begun, judged, present);
    let mut sets = vec![Set { begun: &begun, common, effects, stop: &options.stop }];
    let mut predictions = vec![sets[0].predicted()?];
    while let Some(larger) =
        sets.last().filter(|s| s.effects.len() > present.len()).map(|s| s.effects.clone())
    {
        let from = sets.last().expect("a set");
        let mut smaller = Vec::new();
        for effect in larger.iter().filter(|e| !present.contains(e)) {
            let set = from.without(effect);
            smaller.push((set.predicted()?, set));
        }
        let best = smaller
            .into_iter()
            .min_by(|a, b| a.0.rms_rad().total_cmp(&b.0.rms_rad()))
            .expect("an effect");
        predictions.push(best.0);
        sets.push(best.1);
    }
    sets.reverse();
    predictions.reverse();
    let mut last = 0;
    for larger in 1..sets.len() {
        if predictions[larger].is_better_than(&predictions[last]) {
            last = larger;
        }
    }
    sets.truncate(last + 1);
    let alike = alike_in_releases(&sets[last], &predictions[last], present)?;
    let noise_rad = mean_square(&releases.decays, |d| d.noise_rad);
    let whole: Vec<Release> = begun.iter().map(|b| Release::whole(&b.decay)).collect();
    let path = sets.iter().zip(&predictions).map(|(set, prediction)| Path {
        effects: set.effects.clone(),
        joint: set.whole().with_discrepancy(&whole),
        held_out_over_noise: prediction.rms_rad() / noise_rad,
    });
    Ok((path.collect(), alike))
}

/// Effects that survive somewhere, those of most releases first, behind those that stay.
fn proposed(begun: &[Surviving], judged: &ReleaseAnswers, present: &[Effect]) -> Vec<Effect> {
    let mut votes: BTreeMap<Effect, usize> = BTreeMap::new();
    for effect in begun.iter().flat_map(|b| &b.alone().structure.effects) {
        *votes.entry(effect.clone()).or_default() += 1;
    }
    let of_pieces = |e: &Effect| e.is_strength_of_state() || e.is_own();
    for effect in judged.alone.named().into_iter().filter(of_pieces) {
        votes.entry(effect).or_insert(1);
    }
    votes.retain(|e, _| !present.contains(e) && !e.moves_rest());
    present.iter().cloned().chain(most_first(votes).into_iter().take(MOST_EFFECTS)).collect()
}

fn told(
    records: &[Record],
    decays: &[FreeDecay],
    path: &[Path],
    common: &Common,
    named: Vec<Effect>,
    present: &[Effect],
) -> SeveralDiagnosis {
    let mut held_out = f64::INFINITY;
    let mut before: &[Effect] = present;
    let mut effects = named;
    let mut steps = Vec::new();
    for Path { effects: here, joint, held_out_over_noise } in path {
        held_out = held_out.min(*held_out_over_noise);
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
            held_out_over_noise: held_out,
            parameters: in_common(joint).into_iter().filter(|(name, _)| !own(name)).collect(),
        });
    }
    let last = &path.last().expect("a model").joint.fits;
    let names: Vec<String> = records.iter().map(|r| r.file.display().to_string()).collect();
    let files: Vec<&str> = names.iter().map(String::as_str).collect();
    let left = releases::left(&path[0].joint.fits, last, decays, &files);
    let sharing = effects.iter().map(|e| {
        let own = common.own.contains(e) || e.moves_rest();
        (e.to_string(), if own { EACH_ITS_OWN } else { "one for all releases" })
    });
    let sharing = sharing.collect();
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
        held_out: "each release, from the others",
        sharing,
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
        self.sharing.insert(random.to_string(), EACH_ITS_OWN);
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
