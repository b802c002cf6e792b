//! The answer by likelihood: which effects, or which random forcing, bring a model near the noise down to it.

use crate::bic;
use crate::diagnosis::answer::{modal, step, Candidate, Diagnosed, Diagnosis, Modal, Status, Step};
use crate::diagnosis::buffeting::{self, Buffeted};
use crate::diagnosis::compare;
use crate::diagnosis::forced::{self, Forced, BEYOND_DOUBT, MOST_UNSTEADY};
use crate::diagnosis::guards::{self, Refusal};
use crate::diagnosis::late_release;
use crate::diagnosis::likelihood::{NEAR_NOISE, USED_UP_TO};
use crate::diagnosis::search::{self, beyond, criterion, SearchStart};
use crate::effects::{Acts, Effect};
use crate::error::Result;
use crate::fit::at_amplitude::{at_amplitudes, with_discrepancy};
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::quantity::Quantity;
use crate::record::Record;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The answer by likelihood, which holds near the noise; and whether it explains the record.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(super) fn by_likelihood(
    record: &Record,
    decay: &FreeDecay,
    start: &SearchStart,
) -> Result<(Diagnosed, bool)> {
    let mut found = search::search(decay, start)?;
    let decay = &found.decay;
    found.path = found.path.into_iter().map(|model| with_discrepancy(model, decay)).collect();
    let last = found.path.last().expect("the plain model");
    let alone = found.explained && beyond(&found.plain, last).len() < 2;
    // Random forcing that hardly shows bends a single effect to it; then it has to be likelier by itself.
    let forced = !alone || forced::forced_rather_than(decay, &start.plain, last).is_some();
    if let Some(forced) = forced.then(|| random_forcing(decay, start, last)).flatten() {
        // Named though not always believed: no definite law stands for them.
        return Ok((forced, true));
    }
    let effects = beyond(&found.plain, last).to_vec();
    let mut steps = steps(decay, &found.path);
    // Three effects or more can be bent to a short record; then they have to predict the rest of it too.
    let is_predicted =
        effects.len() < 3 || steps.last().is_some_and(|s| s.held_out_over_noise < NEAR_NOISE);
    let status = match (found.explained && is_predicted, effects.is_empty()) {
        (true, true) => Status::Adequate,
        (true, false) => Status::Explained,
        (false, _) => Status::Unexplained,
    };
    let mut modal_values = modal(last);
    let (mut at_amplitude, mut covariance) = (at_amplitudes(decay, last), last.named_covariance());
    if status == Status::Explained
        && let Some(model) = late_release::from_release(record, decay, last)
    {
        steps.last_mut().expect("a model").parameters =
            model.effect_parameters().into_iter().collect();
        modal_values = modal(&model);
        (at_amplitude, covariance) = (at_amplitudes(decay, &model), model.named_covariance());
    }
    let diagnosis = Diagnosis {
        said: decay.measurand.said(),
        noise_rms_deg: decay.measurand.shown(decay.sample_noise_rad),
        mean_noise_deg: decay.measurand.shown(decay.noise_rad),
        status,
        effects,
        indistinguishable: found
            .indistinguishable
            .iter()
            .map(|(a, b)| [a.clone(), b.clone()])
            .collect(),
        modal: modal_values,
        at_amplitude,
        covariance,
        steps,
        candidates: candidates(decay, &found.plain, &found.singles, &found.refused),
        where_: compare::locate(decay, last),
        left: None,
        sentence: None,
        rest_angle_deg: last.rest_rad().map(|rest| rest.by(|x| decay.measurand.shown(x))),
    };
    let good = status != Status::Unexplained;
    Ok((
        Diagnosed { diagnosis, decay: found.decay, singles: found.singles, path: found.path },
        good,
    ))
}

/// The answer by the random forcing that explains the record, with the effects beside it, where no definite
/// effects do: the same throughout, its innovations white, blind to the state and down to the noise, and far
/// likelier than `best`, a definite model.
pub(super) fn random_forcing(
    decay: &FreeDecay,
    start: &SearchStart,
    best: &Fitted,
) -> Option<Diagnosed> {
    let (deterministic, n) = buffeting::definite_criterion(decay, best);
    let alone = buffeting::fit(decay, &start.plain)?;
    // Beyond, an effect is not looked for beside random forcing that by itself is no better than a definite
    // model.
    let far = start.plain.over_noise(decay) > USED_UP_TO;
    if far && deterministic - alone.deviance < bic::MARGIN {
        return None;
    }
    let numbers = start.plain.parameters.len();
    let forced = forced::search(decay, &start.plain, &alone, &start.candidates)
        .filter(|f| forced::holds(&f.forcing, f.model.parameters.len(), deterministic, n));
    if forced.is_none() && !forced::holds(&alone, numbers, deterministic, n) {
        return None;
    }
    let diagnosis = buffeted_verdict(decay, start, &alone, forced.as_ref());
    let path = vec![start.plain.clone()];
    Some(Diagnosed { diagnosis, path, decay: decay.clone(), singles: start.singles.clone() })
}

/// Random forcing and an effect together bend to much that the library lacks: one effect of the state beside
/// it is believed that physics allows and whose size stands out of its uncertainty; others are named only.
fn is_beyond_doubt(forced: &Forced, decay: &FreeDecay) -> bool {
    let model = &forced.model;
    let [effect] = &model.structure.effects[..] else { return false };
    if matches!(effect.acts_on(), Acts::Time | Acts::Line)
        || forced.forcing.unsteadiness > MOST_UNSTEADY
    {
        return false;
    }
    let stands_out = model.coefficient(effect).is_some_and(|q| !q.holds(0.0, BEYOND_DOUBT));
    stands_out && guards::refusal(model, decay).is_none()
}

fn buffeted_verdict(
    decay: &FreeDecay,
    start: &SearchStart,
    b: &Buffeted,
    forced: Option<&Forced>,
) -> Diagnosis {
    let plain = &start.plain;
    let [_, u_wn, u_zeta] = b.deviations;
    // What is random cannot be predicted; the filter's innovations are one step ahead throughout.
    let random_step = |added: Effect, b: &Buffeted| {
        let intensity = Quantity::new(b.intensity, b.intensity * b.deviations[0]);
        Step {
            added: Some(added),
            residual_rms_deg: decay.raw_rms_deg(b.over_noise * decay.noise_rad),
            residual_over_noise: b.over_noise,
            held_out_over_noise: b.over_noise,
            parameters: BTreeMap::from([(Effect::random().first_name(), intensity)]),
        }
    };
    let mut steps = vec![step(decay, plain, 0), random_step(Effect::random(), b)];
    let mut effects = vec![Effect::random()];
    let mut modal_values = Modal {
        natural_frequency_rad_s: Quantity::new(b.natural_frequency_rad_s, u_wn),
        damping_ratio: Quantity::new(b.damping_ratio, u_zeta),
    };
    if let Some(Forced { model, forcing }) = forced {
        modal_values = modal(model);
        for effect in beyond(plain, model) {
            let mut step = random_step(effect.clone(), forcing);
            step.parameters.extend(model.effect_parameters());
            steps.push(step);
            effects.push(effect.clone());
        }
    }
    let mut candidates = candidates(decay, plain, &start.singles, &[]);
    let evidence = buffeting::gain_over(decay, plain, b);
    let random = Candidate {
        reason: None,
        effect: Effect::random(),
        residual_over_noise: b.over_noise,
        evidence,
        converged: true,
    };
    candidates.insert(0, random);
    Diagnosis {
        said: decay.measurand.said(),
        noise_rms_deg: decay.measurand.shown(decay.sample_noise_rad),
        mean_noise_deg: decay.measurand.shown(decay.noise_rad),
        status: match forced {
            Some(forced) if !is_beyond_doubt(forced, decay) => Status::Unexplained,
            _ => Status::Explained,
        },
        effects,
        indistinguishable: Vec::new(),
        modal: modal_values,
        at_amplitude: forced.map_or_else(Vec::new, |f| at_amplitudes(decay, &f.model)),
        covariance: forced.and_then(|f| f.model.named_covariance()),
        steps,
        candidates,
        where_: compare::locate(decay, forced.map_or(plain, |f| &f.model)),
        left: None,
        sentence: None,
        rest_angle_deg: None,
    }
}

fn steps(decay: &FreeDecay, path: &[Fitted]) -> Vec<Step> {
    let added = |k, model: &Fitted| if k == 0 { 0 } else { model.structure.effects.len() };
    path.par_iter().enumerate().map(|(k, model)| step(decay, model, added(k, model))).collect()
}

fn candidates(
    decay: &FreeDecay,
    plain: &Fitted,
    singles: &[Fitted],
    refused: &[Refusal],
) -> Vec<Candidate> {
    // Ranked on one count of residuals, else the correlation that they leave would rank them; the difference
    // of BIC is that of each with the plain model, on its own.
    let mut ranked: Vec<&Fitted> = singles.iter().collect();
    ranked
        .sort_by(|a, b| b.converged.cmp(&a.converged).then(criterion(a).total_cmp(&criterion(b))));
    ranked
        .into_iter()
        .map(|single| {
            let effect = beyond(plain, single)[0].clone();
            let refused = refused.iter().find(|refused| refused.effect == effect);
            Candidate {
                reason: refused.map(|refused| refused.reason.clone()),
                effect,
                residual_over_noise: single.over_noise(decay),
                evidence: single.bic().gain_over(&plain.bic()),
                converged: single.converged,
            }
        })
        .collect()
}
