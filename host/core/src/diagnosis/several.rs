//! What several releases of one rig lack, judged as one.
//!
//! Each release has a natural frequency, damping ratio, rest angle and state of its own, and unless asked
//! otherwise one coefficient of each effect is common to all. The effects are those that the releases' own
//! answers name, as far as all of them need them. Where a model with these is not down to the noise, they are
//! those that survive prediction over the pieces of all releases, as over those of one.

use crate::diagnosis::answer::{
    Diagnosed, Diagnosis, HeldOut, Options, ReleaseVerdict, Status, Step,
};
use crate::diagnosis::campaign_fit::in_common;
use crate::diagnosis::likelihood::are_explained;
use crate::diagnosis::origin::{weighted_mean, ONE, OWN};
use crate::diagnosis::releases::{self, ReleaseAnswers, Releases};
use crate::diagnosis::several_fit::{by_prediction, in_common_at_once, Common, Path, Predicted};
use crate::diagnosis::verdict::{name_of, Chosen};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{Fitted, Modal, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::quantity::Quantity;
use crate::record::Record;
use std::collections::BTreeMap;

pub(super) fn of_several(
    records: &[Record],
    common: &Common,
    options: &Options,
) -> Result<Diagnosed> {
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
    let is_forced = judged.alone.mostly(&random);
    let mut named = Vec::new();
    if !options.zero_unknown && rests.is_empty() && judged.alone.mostly(&rest) {
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
    let mut candidates = judged.alone.candidates();
    let (path, indistinguishable, held_out) = match near {
        Some(path) => {
            let alike = judged.alone.indistinguishable(&each.effects);
            (path, alike, HeldOut::Releases)
        }
        None => {
            let Predicted { path, alike, refused } =
                by_prediction(&releases, &judged, common, options, &structure)?;
            for candidate in &mut candidates {
                let refusal = refused.iter().find(|r| r.effect == candidate.effect);
                candidate.reason = candidate.reason.take().or(refusal.map(|r| r.reason.clone()));
            }
            (path, alike, HeldOut::Pieces)
        }
    };
    options.stop.check()?;
    let present = &options.present.effects;
    let (steps, effects) = steps(&releases.decays, &path, common, named, present);
    let shared = |e: &Effect| {
        let own = common.own.contains(e) || e.moves_rest();
        (e.to_string(), if own { OWN } else { ONE })
    };
    let sharing = effects.iter().map(shared).collect();
    let (plain, last) = (&path[0].joint.fits, &path[path.len() - 1].joint.fits);
    let chosen = Chosen {
        status: None,
        effects,
        indistinguishable,
        steps,
        held_out,
        candidates,
        model: name_of(present),
    };
    let names: Vec<String> = records.iter().map(Record::name).collect();
    let mut diagnosis = Diagnosis::of(&names, &releases.decays, [plain, last], chosen);
    diagnosis.sharing = sharing;
    diagnosis.modal = common.same_rig.then(|| last[0].modal());
    if is_forced && diagnosis.status != Status::Explained {
        add_random(&mut diagnosis, &judged, &random, name_of(present));
    }
    let path = path.into_iter().map(|model| model.joint.fits).collect();
    Ok(Diagnosed { diagnosis, decays: releases.decays, singles: Vec::new(), path })
}

/// An effect more at each of `path`, and all of them after those that are `named` without a step.
fn steps(
    decays: &[FreeDecay],
    path: &[Path],
    common: &Common,
    named: Vec<Effect>,
    present: &[Effect],
) -> (Vec<Step>, Vec<Effect>) {
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
    (steps, effects)
}

/// What most releases name alone: a random moment, of another course in each, beside what they have in common.
fn add_random(found: &mut Diagnosis, judged: &ReleaseAnswers, random: &Effect, model: &str) {
    let said = |of: &Diagnosed| of.diagnosis.status == Status::Explained;
    let all = judged.alone.answers.iter().all(said);
    found.effects.retain(|e| judged.alone.mostly(e));
    found.effects.push(random.clone());
    found.sharing.insert(random.to_string(), OWN);
    for (release, answer) in judged.alone.which.iter().zip(&judged.alone.answers) {
        let own = answer.diagnosis.only().expect("one release");
        found.releases[*release] =
            ReleaseVerdict { at_amplitude: Vec::new(), covariance: None, ..own.clone() };
    }
    found.is_filtered(if all { Status::Explained } else { Status::Unexplained }, model);
    found.is_forced(BTreeMap::new());
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
