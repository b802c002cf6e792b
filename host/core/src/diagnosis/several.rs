//! What several releases lack, judged as one: those of one rig, or of a campaign.
//!
//! Each release has a natural frequency, damping ratio, rest angle and state of its own; one coefficient of
//! each effect is common to all of a rig unless asked otherwise, and of a campaign to those whose own agree.
//! The effects are those that the releases' own answers name, as far as all of them need them. Where a model
//! with these is not down to the noise of a rig's releases, they are those that survive prediction over the
//! pieces of all, as over those of one.

use crate::diagnosis::answer::{
    hold_least, Candidate, Diagnosed, Diagnosis, HeldOut, Options, ReleaseVerdict, Status, Step,
};
use crate::diagnosis::campaign_fit::Campaign;
use crate::diagnosis::guards;
use crate::diagnosis::left_out::LeftOut;
use crate::diagnosis::likelihood::are_explained;
use crate::diagnosis::origin::OWN;
use crate::diagnosis::releases::{self, ModelOfReleases, ReleaseAnswers};
use crate::diagnosis::several_fit::{Common, Grouping, Predicted, Rig, Together};
use crate::diagnosis::verdict::{name_of, Chosen};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{Fitted, Modal, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::quantity::{weighted_mean, Quantity};
use crate::record::Record;
use crate::statistics::weighted_rms;
use std::collections::BTreeMap;

pub(super) fn of_several(
    records: &[Record],
    grouping: &Grouping,
    options: &Options,
) -> Result<Diagnosed> {
    let nothing = Common::default();
    let (common, made) = match grouping {
        Grouping::Rig(common) => (common, None),
        Grouping::Campaign(made) => (&nothing, Some(*made)),
    };
    let entry = |i: usize| made.map(|made| &made.release[i]);
    let each = |i: usize| options.wind_speeds_m_s.get(i).copied().unwrap_or(options.wind_speed_m_s);
    let wind = |i| entry(i).map_or_else(|| each(i), |entry| entry.wind_speed_m_s);
    let winds = (0..records.len()).map(wind);
    let mut decays = releases::free_decays(records, winds, &options.stop)?;
    let mut options = options.of(&decays[0]);
    if made.is_some() {
        options.present = Structure::default();
    }
    // Each release of a rig has a rest angle of its own, which a constant moment would be once more.
    let (rests, there): (Vec<Effect>, Vec<Effect>) =
        options.present.effects.iter().cloned().partition(Effect::moves_rest);
    let zero_unknown = options.zero_unknown || made.is_none();
    let structure = Structure { zero_unknown, effects: there.clone(), ..options.present.clone() };
    let judged = releases::judge(records, &mut decays, &structure, &options)?;
    let rest = Some(Effect::of_rest()).filter(|rest| {
        zero_unknown && !options.zero_unknown && rests.is_empty() && judged.alone.mostly(rest)
    });
    let is_forced = judged.alone.mostly(&Effect::random());

    let rig = Rig { decays: &decays, common };
    let campaign = made.map(|made| Campaign::new(made, records, &decays));
    // What pieces do not show is not judged by them.
    let at_once = made.is_some() || is_forced || !there.iter().all(Effect::shows_in_pieces);
    let Models { path, indistinguishable, held_out, candidates } =
        models(&rig, campaign.as_ref(), &judged, at_once, &options.own, &structure)?;
    options.stop.check()?;

    let steps = steps(&decays, &path, &options.present.effects, common);
    let added = steps.iter().filter_map(|step| step.added.clone());
    let model = name_of(&options.present.effects);
    let chosen = Chosen {
        status: made
            .is_some()
            .then(|| judged.alone.adequate())
            .flatten()
            .filter(|_| path.len() == 1),
        effects: rest.iter().cloned().chain(added).collect(),
        indistinguishable,
        steps,
        held_out,
        candidates,
        model,
    };
    let name = |(i, record): (usize, &Record)| {
        entry(i).map_or_else(|| record.name(), |entry| entry.file.clone())
    };
    let names: Vec<String> = records.iter().enumerate().map(name).collect();
    let last = &path[path.len() - 1];
    let models = [&path[0].joint.fits[..], &last.joint.fits];
    let mut found = Diagnosis::new(&names, &decays, models, chosen);
    if common.same_rig {
        found.modal = Some(last.joint.fits[0].modal());
    }
    found.sharing.extend(rest.map(|rest| (rest.to_string(), OWN)));
    match &campaign {
        Some(campaign) => campaign.complete(&mut found, &judged, [&path[0], last])?,
        None => {
            last.shared.iter().for_each(|shared| found.add(shared));
            if is_forced && found.status != Status::Explained {
                add_random(&mut found, &judged, model);
            }
        }
    }
    let mut path: Vec<Vec<Fitted>> = path.into_iter().map(|model| model.joint.fits).collect();
    if made.is_some() && found.effects.iter().any(Effect::is_random) {
        path.truncate(1);
    }
    Ok(Diagnosed { diagnosis: found, decays, singles: Vec::new(), path })
}

/// The models of all releases, from the one that is there to that of the answer.
struct Models {
    path: Vec<Together>,
    indistinguishable: Vec<[Effect; 2]>,
    held_out: HeldOut,
    candidates: Vec<Candidate>,
}

/// Those with what the releases' own answers name, or where these are not down to the noise those that
/// survive prediction.
fn models(
    rig: &Rig,
    campaign: Option<&Campaign>,
    judged: &ReleaseAnswers,
    at_once: bool,
    own: &[Effect],
    structure: &Structure,
) -> Result<Models> {
    let mut candidates = judged.alone.candidates();
    if let Some(path) = at_once_in_all(rig, campaign, judged, at_once)? {
        let held_out = campaign.map_or(HeldOut::Releases, Campaign::held_out);
        let path = match campaign {
            Some(campaign) => {
                let together = |model: &ModelOfReleases| campaign.together(model);
                predicting(rig, &together, judged, path, &mut candidates)?
            }
            None => path,
        };
        let effects = &path.last().expect("a model").joint.structure.effects;
        let indistinguishable = judged.alone.indistinguishable(effects);
        return Ok(Models { path, indistinguishable, held_out, candidates });
    }
    let Predicted { path, alike, needed, refused } = rig.by_prediction(judged, own, structure)?;
    for candidate in &mut candidates {
        let refusal = refused.iter().find(|r| r.effect == candidate.effect);
        candidate.reason = candidate.reason.take().or(refusal.map(|r| r.reason.clone()));
    }
    let named = judged.alone.named();
    let together = |model: &ModelOfReleases| Ok(rig.together(model));
    let mut path = left_out(rig, &together, judged, path, named, &mut candidates)?;
    // It may be another fit than the one that was judged: with a line more, or an effect less.
    guards::other_than_zero_in_all(&mut path.last_mut().expect("a model").joint, &needed);
    Ok(Models { path, indistinguishable: alike, held_out: HeldOut::Pieces, candidates })
}

/// The models of `path` of a campaign without the effects that predict no release that was left out: where it is
/// down to the noise, of those that no release's own answer names or none knows from zero, else of all.
fn predicting(
    rig: &Rig,
    together: &(dyn Fn(&ModelOfReleases) -> Result<Together> + Sync),
    judged: &ReleaseAnswers,
    path: Vec<Together>,
    candidates: &mut [Candidate],
) -> Result<Vec<Together>> {
    let joint = &path.last().expect("a model").joint;
    let mut named = match are_explained(&joint.fits, rig.decays) {
        true => judged.alone.named(),
        false => Vec::new(),
    };
    // One of several releases names by chance what all of them know to be nothing.
    let of_unknown_size = |fit: &Fitted| guards::of_unknown_size(fit, &[], guards::OF_NAMED);
    let unknown: Vec<Vec<Effect>> = joint.fits.iter().map(of_unknown_size).collect();
    named.retain(|effect| {
        let mut each = joint.fits.iter().zip(&unknown);
        each.any(|(fit, unknown)| fit.varied(effect).is_some() && !unknown.contains(effect))
    });
    left_out(rig, together, judged, path, named, candidates)
}

/// The models of `path` without the effects that predict no release that was left out, but for those `named`.
fn left_out(
    rig: &Rig,
    together: &(dyn Fn(&ModelOfReleases) -> Result<Together> + Sync),
    judged: &ReleaseAnswers,
    path: Vec<Together>,
    named: Vec<Effect>,
    candidates: &mut [Candidate],
) -> Result<Vec<Together>> {
    let there = path[0].joint.structure.effects.len();
    let before = path.last().expect("a model").joint.structure.effects.clone();
    if before[there..].iter().all(|e| named.contains(e)) {
        return Ok(path);
    }
    let left_out =
        LeftOut { decays: rig.decays, which: &judged.alone.which, there, stay: named, together };
    let path = left_out.path(path)?;
    let kept = &path.last().expect("a model").joint.structure.effects;
    for candidate in candidates.iter_mut() {
        let gone = before.contains(&candidate.effect) && !kept.contains(&candidate.effect);
        let why = || "with it a release that was left out is predicted no better".to_owned();
        candidate.reason = candidate.reason.take().or_else(|| gone.then(why));
    }
    Ok(path)
}

/// The models with what the releases' own answers name, in all of them at once; `None` where the last is not
/// down to the noise, unless that `stands` all the same.
fn at_once_in_all(
    rig: &Rig,
    campaign: Option<&Campaign>,
    judged: &ReleaseAnswers,
    stands: bool,
) -> Result<Option<Vec<Together>>> {
    let explains = |fits: &[Fitted]| stands || are_explained(fits, rig.decays);
    if !explains(&judged.path.last().expect("a model").fits) {
        return Ok(None);
    }
    let together = |model: &ModelOfReleases| {
        rig.decays[0].stop.check()?;
        match campaign {
            Some(campaign) => campaign.together(model),
            None => Ok(rig.together(model)),
        }
    };
    let path = judged.path.iter().map(together).collect::<Result<Vec<Together>>>()?;
    let last = path.last().expect("a model");
    Ok(explains(&last.joint.fits).then_some(path))
}

/// An effect more at each of `path` than are `present`; in the residuals every sample counts alike.
fn steps(
    decays: &[FreeDecay],
    path: &[Together],
    present: &[Effect],
    common: &Common,
) -> Vec<Step> {
    let mut before = present;
    let mut steps = Vec::new();
    for Together { joint, held_out_over_noise, .. } in path {
        let here = &joint.structure.effects;
        let added = here.iter().find(|e| !before.contains(e)).cloned();
        before = here;
        let each = joint.fits.iter().zip(decays);
        let raw = each.map(|(fit, decay)| {
            ((fit.count * decay.block) as f64, decay.raw_rms_deg(fit.rms_rad()))
        });
        steps.push(Step {
            added,
            residual_rms_deg: weighted_rms(raw),
            residual_over_noise: joint.over_noise(),
            held_out_over_noise: *held_out_over_noise,
            parameters: common.numbers(joint),
        });
    }
    // A release from a small angle need not predict one from a large.
    hold_least(&mut steps);
    steps
}

/// What most releases name alone: a random moment, of another course in each, beside what they have in
/// common.
fn add_random(found: &mut Diagnosis, judged: &ReleaseAnswers, model: &str) {
    let said = |of: &Diagnosed| of.diagnosis.status == Status::Explained;
    let all = judged.alone.answers.iter().all(said);
    let random = Effect::random();
    found.effects.retain(|e| judged.alone.mostly(e));
    found.sharing.insert(random.to_string(), OWN);
    found.effects.push(random);
    for (release, answer) in judged.alone.which.iter().zip(&judged.alone.answers) {
        let own = answer.diagnosis.only().expect("one release");
        found.releases[*release] =
            ReleaseVerdict { at_amplitude: Vec::new(), covariance: None, ..own.clone() };
    }
    found.is_forced(all, BTreeMap::new(), model);
    let mean =
        |of: fn(&Modal) -> Quantity| weighted_mean(found.releases.iter().map(|r| of(&r.modal)));
    let both = mean(|m| m.natural_frequency_rad_s).zip(mean(|m| m.damping_ratio));
    if let (Some(modal), Some((wn, zeta))) = (&mut found.modal, both) {
        *modal = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
    }
}

#[cfg(test)]
#[path = "several_tests.rs"]
mod tests;
