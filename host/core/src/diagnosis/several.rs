//! What several releases of one rig lack, judged as one.
//!
//! Each release has a natural frequency, damping ratio, rest angle and state of its own, and unless asked otherwise one
//! coefficient of each effect is common to all. The effects are those that survive in the single releases, less those
//! without which a release that was left out is predicted as well: its own numbers are estimated anew, what is common
//! comes from the others.

use crate::diagnosis::account;
use crate::diagnosis::account::MOST_LEFT;
use crate::diagnosis::alike::alike_in_releases;
use crate::diagnosis::answer::Left;
use crate::diagnosis::diagnose::{modal, Modal, Status, Step, SECOND_ORDER, SMALL};
use crate::diagnosis::likelihood::is_explained;
use crate::diagnosis::prediction::Prediction;
use crate::diagnosis::shared_set::{Begun, Set};
use crate::diagnosis::survivors;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::floor;
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::JointFit;
use crate::fit::structure::Structure;
use crate::quantity::Quantity;
use crate::record::Record;
use serde::Serialize;
use std::collections::BTreeMap;

pub use crate::diagnosis::shared_set::Common;

/// Effects that are tried in common, those of most releases first.
const MOST_EFFECTS: usize = 5;

/// All that is said about several releases. Rms in deg, ratios to the noise floor of block means.
#[derive(Clone, Debug, Serialize)]
pub struct SeveralDiagnosis {
    pub noise_rms_deg: f64,
    pub mean_noise_deg: f64,
    pub status: Status,
    /// In the order in which they help.
    pub effects: Vec<Effect>,
    pub indistinguishable: Vec<[Effect; 2]>,
    /// Of all releases, where they have it in common.
    pub modal: Option<Modal>,
    pub steps: Vec<Step>,
    /// What `held_out_over_noise` was held out.
    pub held_out: &'static str,
    /// By effect: whether its coefficients are one for all releases.
    pub sharing: BTreeMap<String, &'static str>,
    pub left: Left,
    pub sentence: String,
    pub records: Vec<OfRecord>,
}

/// One release's share of the answer.
#[derive(Clone, Debug, Serialize)]
pub struct OfRecord {
    pub file: String,
    pub modal: Modal,
    pub rest_angle_deg: Quantity,
    pub residual_rms_deg: f64,
    pub residual_over_noise: f64,
    pub parameters: BTreeMap<String, Quantity>,
}

/// Judges `records`, releases of one rig, as one.
///
/// # Errors
/// Naming the record without a free decay; interrupted.
pub fn diagnose_several(records: &[Record], common: &Common) -> Result<SeveralDiagnosis> {
    let begun: Vec<Begun> = records
        .iter()
        .map(|record| {
            let decay = FreeDecay { stop: common.stop.clone(), ..FreeDecay::of(record)? };
            let survivors = survivors::search(&decay, &common.candidates, &Structure::default())?;
            Ok(Begun { decay: floor::with_steps(decay, record), survivors })
        })
        .collect::<Result<_>>()?;
    // From all that survives somewhere down to the plain model, what is missed least left out first.
    let mut sets = vec![Set { begun: &begun, common, effects: proposed(&begun, common) }];
    let mut predictions = vec![sets[0].predicted()?];
    while let Some(larger) =
        sets.last().filter(|s| s.effects.len() > common.present.len()).map(|s| s.effects.clone())
    {
        let from = sets.last().expect("a set");
        let mut smaller = Vec::new();
        for effect in larger.iter().filter(|e| !common.present.contains(e)) {
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
    let wholes: Vec<JointFit> = sets.iter().map(Set::whole).collect();
    common.stop.check()?;
    let indistinguishable = alike_in_releases(&sets[last], &predictions[last])?;
    let told = told(records, &begun, &sets, &wholes, &predictions);
    Ok(SeveralDiagnosis { indistinguishable, ..told })
}

/// Effects that survive somewhere, those of most releases first, behind those that stay.
fn proposed(begun: &[Begun], common: &Common) -> Vec<Effect> {
    let mut votes: BTreeMap<Effect, usize> = BTreeMap::new();
    for effect in begun.iter().flat_map(|b| &b.alone().structure.effects) {
        *votes.entry(effect.clone()).or_default() += 1;
    }
    let mut out: Vec<(Effect, usize)> =
        votes.into_iter().filter(|(e, _)| !common.present.contains(e)).collect();
    out.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    out.truncate(MOST_EFFECTS);
    common.present.iter().cloned().chain(out.into_iter().map(|(e, _)| e)).collect()
}

fn told(
    records: &[Record],
    begun: &[Begun],
    sets: &[Set],
    wholes: &[JointFit],
    predictions: &[Prediction],
) -> SeveralDiagnosis {
    let mean_square = |of: &dyn Fn(&FreeDecay) -> f64| {
        let sum: f64 = begun.iter().map(|b| of(&b.decay).powi(2)).sum();
        (sum / begun.len() as f64).sqrt()
    };
    let noise_rad = mean_square(&|d| d.noise_rad);
    let count: usize = begun.iter().map(|b| b.decay.yaw_rad.len()).sum();
    let rms_rad = |joint: &JointFit| {
        let sum: f64 = joint.fits.iter().map(|f| f.sum_of_squares).sum();
        (sum / count as f64).sqrt()
    };
    let mut held_out = f64::INFINITY;
    let steps: Vec<Step> = wholes
        .iter()
        .zip(predictions)
        .zip(sets)
        .enumerate()
        .map(|(k, ((joint, prediction), set))| {
            held_out = held_out.min(prediction.rms_rad() / noise_rad);
            let before = k.checked_sub(1).map(|k| &sets[k].effects);
            let new = |e: &&Effect| before.is_some_and(|b| !b.contains(e));
            let raw = |f: &crate::fit::fitting::Fitted, b: &Begun| b.decay.raw_rms_deg(f.rms_rad());
            let raws = joint.fits.iter().zip(begun).map(|(f, b)| raw(f, b).powi(2));
            Step {
                added: set.effects.iter().find(new).cloned(),
                residual_rms_deg: (raws.sum::<f64>() / begun.len() as f64).sqrt(),
                residual_over_noise: joint.over_noise(),
                held_out_over_noise: held_out,
                parameters: shared_numbers(joint, set),
            }
        })
        .collect();
    let (plain, last) = (&wholes[0], wholes.last().expect("a model"));
    let effects: Vec<Effect> = steps.iter().filter_map(|s| s.added.clone()).collect();
    let worst = last
        .fits
        .iter()
        .zip(records)
        .max_by(|a, b| a.0.rms_rad().total_cmp(&b.0.rms_rad()))
        .map_or(String::new(), |(_, record)| record.file.display().to_string());
    let explained = last.fits.iter().zip(begun).all(|(f, b)| is_explained(f, &b.decay));
    let amplitude = begun.iter().map(|b| b.decay.amplitude_rad).fold(0.0, f64::max);
    let left = Left {
        rms_deg: rms_rad(last).to_degrees(),
        share_of_amplitude: rms_rad(last) / amplitude,
        share_of_misfit: (rms_rad(last) / rms_rad(plain)).powi(2).min(1.0),
        where_: match explained {
            true => account::NOISE.into(),
            false => format!("most of it in {worst}"),
        },
    };
    let status = match (explained, effects.is_empty()) {
        (true, true) => Status::Adequate,
        (true, false) => Status::Explained,
        (false, _) if left.share_of_amplitude < SMALL => Status::MostlyExplained,
        (false, false) if left.share_of_misfit < MOST_LEFT => Status::MostlyExplained,
        (false, _) => Status::Unexplained,
    };
    let common = sets[0].common;
    let sharing = effects.iter().map(|e| {
        let own = common.own.contains(e);
        (e.to_string(), if own { "each release its own" } else { "one for all releases" })
    });
    SeveralDiagnosis {
        noise_rms_deg: mean_square(&|d| d.sample_noise_rad).to_degrees(),
        mean_noise_deg: noise_rad.to_degrees(),
        status,
        indistinguishable: Vec::new(),
        modal: common.same_rig.then(|| modal(&last.fits[0])),
        steps,
        held_out: "each release, from the others",
        sharing: sharing.collect(),
        sentence: account::sentence(&effects, &left, SECOND_ORDER),
        effects,
        left,
        records: last
            .fits
            .iter()
            .zip(records)
            .zip(begun)
            .map(|((fit, record), b)| {
                let rest = account::rest_angle(fit);
                OfRecord {
                    file: record.file.display().to_string(),
                    modal: modal(fit),
                    rest_angle_deg: Quantity::new(rest.value.to_degrees(), rest.u.to_degrees()),
                    residual_rms_deg: b.decay.raw_rms_deg(fit.rms_rad()),
                    residual_over_noise: fit.over_noise(&b.decay),
                    parameters: fit.effect_parameters().into_iter().collect(),
                }
            })
            .collect(),
    }
}

/// Numbers that are the same in all releases.
fn shared_numbers(joint: &JointFit, set: &Set) -> BTreeMap<String, Quantity> {
    let own = |name: &str| {
        set.common.own.iter().any(|e| name.strip_prefix(e.id()).is_some_and(|n| n.starts_with('.')))
    };
    joint.fits[0].effect_parameters().into_iter().filter(|(name, _)| !own(name)).collect()
}

#[cfg(test)]
#[path = "several_tests.rs"]
mod tests;
