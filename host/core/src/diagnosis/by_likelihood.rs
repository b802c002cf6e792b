//! The answer by likelihood: which effects, or which random forcing, bring a model near the noise down to it.

use crate::at_once::AtOnce;
use crate::bic;
use crate::diagnosis::answer::{step, Candidate, Diagnosed, Diagnosis, HeldOut, Status, Step};
use crate::diagnosis::buffeting::{self, Buffeted};
use crate::diagnosis::forced::{self, Forced, BEYOND_CHANCE};
use crate::diagnosis::guards::{self, Refusal};
use crate::diagnosis::late_release;
use crate::diagnosis::likelihood::{is_explained, NEAR_NOISE, USED_UP_TO};
use crate::diagnosis::search::{self, beyond, criterion, SearchStart};
use crate::diagnosis::verdict::{name_of, Chosen};
use crate::effects::{Acts, Effect};
use crate::error::Result;
use crate::fit::at_amplitude::with_discrepancy;
use crate::fit::fitting::{polished, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::record::Record;
use std::collections::BTreeMap;
use std::slice::from_ref;

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
    let last = found.path.pop().expect("the plain model");
    found.path.push(polished(last, decay));
    found.path = found.path.into_iter().map(|model| with_discrepancy(model, decay)).collect();
    let last = found.path.last().expect("the plain model");
    let explained = is_explained(last, decay);
    let alone = explained && beyond(&found.plain, last).len() < 2;
    // Random forcing that hardly shows bends a single effect to it; then it has to be likelier by itself.
    let forced = !alone || forced::forced_rather_than(decay, &start.plain, last).is_some();
    if let Some(forced) = forced.then(|| random_forcing(record, decay, start, last)).flatten() {
        // Named though not always believed: no definite law stands for them.
        return Ok((forced, true));
    }
    let steps = steps(decay, &found.path);
    let effects: Vec<Effect> = steps.iter().filter_map(|step| step.added.clone()).collect();
    // Effects can be bent to a short record; they have to predict the rest of it too.
    let is_predicted = steps.last().is_some_and(|s| s.held_out_over_noise < NEAR_NOISE);
    let status = match (explained && is_predicted, effects.is_empty()) {
        (true, true) => Status::Adequate,
        (true, false) => Status::Explained,
        (false, _) => Status::Unexplained,
    };
    let chosen = Chosen {
        status: Some(status),
        effects,
        indistinguishable: found
            .indistinguishable
            .iter()
            .map(|(a, b)| [a.clone(), b.clone()])
            .collect(),
        steps,
        held_out: HeldOut::LaterPart,
        candidates: candidates(decay, &found.plain, &found.singles, &found.refused),
        model: name_of(&found.plain.structure.effects),
    };
    let models = [from_ref(&found.plain), from_ref(last)];
    let mut diagnosis = Diagnosis::of(&[record.name()], from_ref(decay), models, chosen);
    if status == Status::Explained
        && let Some(model) = late_release::from_release(record, decay, last)
    {
        let parameters = model.effect_parameters().into_iter().collect();
        diagnosis.steps.last_mut().expect("a model").parameters = parameters;
        diagnosis.releases[0].has_numbers_of(decay, &model);
        diagnosis.modal = Some(model.modal());
    }
    let good = status != Status::Unexplained;
    let path = found.path.into_iter().map(|model| vec![model]).collect();
    let decays = vec![found.decay];
    Ok((Diagnosed { diagnosis, decays, singles: found.singles, path }, good))
}

/// The answer by the random forcing that explains the record, with the effects beside it, where no definite
/// effects do: the same throughout, its innovations white, blind to the state and down to the noise, and far
/// likelier than `best`, a definite model.
fn random_forcing(
    record: &Record,
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
    let holds = |f: &Forced| {
        // Without the forcing its effects may do as well.
        let definite = deterministic.min(buffeting::definite_criterion(decay, &f.model).0);
        forced::holds(&f.forcing, f.model.parameters.len(), definite, n)
    };
    let forced = forced::search(decay, &start.plain, &alone, &start.candidates).filter(holds);
    if forced.is_none() && !forced::holds(&alone, numbers, deterministic, n) {
        return None;
    }
    let diagnosis = buffeted_verdict(record, decay, start, &alone, forced.as_ref());
    let (decays, singles) = (vec![decay.clone()], start.singles.clone());
    Some(Diagnosed { diagnosis, decays, singles, path: vec![vec![start.plain.clone()]] })
}

/// Random forcing and an effect together bend to much that the library lacks: one effect of the state beside
/// it is believed that physics allows and whose size stands out of its uncertainty; others are named only.
fn is_beyond_doubt(forced: &Forced, plain: &Fitted, decay: &FreeDecay) -> bool {
    let model = &forced.model;
    let [effect] = beyond(plain, model) else { return false };
    if matches!(effect.acts_on(), Acts::Time | Acts::Line)
        || forced.forcing.unsteadiness > BEYOND_CHANCE
    {
        return false;
    }
    let stands_out = model.coefficient(effect).is_some_and(|q| !q.holds(0.0, BEYOND_CHANCE));
    stands_out && guards::refusal(model, decay, &plain.structure.effects).is_none()
}

fn buffeted_verdict(
    record: &Record,
    decay: &FreeDecay,
    start: &SearchStart,
    b: &Buffeted,
    forced: Option<&Forced>,
) -> Diagnosis {
    let plain = &start.plain;
    let random_step = |added: Effect, b: &Buffeted| {
        let parameters = BTreeMap::from([(Effect::random().first_name(), b.intensity)]);
        let rms_deg = decay.raw_rms_deg(b.over_noise * decay.noise_rad);
        Step::of_innovations(added, rms_deg, b.over_noise, parameters)
    };
    let mut steps = vec![step(decay, plain, None), random_step(Effect::random(), b)];
    let mut effects = vec![Effect::random()];
    if let Some(Forced { model, forcing }) = forced {
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
    let status = match forced {
        Some(forced) if !is_beyond_doubt(forced, plain, decay) => Status::Unexplained,
        _ => Status::Explained,
    };
    let chosen = Chosen {
        status: Some(status),
        effects,
        indistinguishable: Vec::new(),
        steps,
        held_out: HeldOut::LaterPart,
        candidates,
        model: name_of(&plain.structure.effects),
    };
    let (last, forcing) = forced.map_or((plain, b), |f| (&f.model, &f.forcing));
    let models = [from_ref(plain), from_ref(last)];
    let mut diagnosis = Diagnosis::of(&[record.name()], from_ref(decay), models, chosen);
    let release = &mut diagnosis.releases[0];
    release.is_filtered(decay, forcing.over_noise);
    release.parameters = diagnosis.steps.last().expect("a step").parameters.clone();
    if forced.is_none() {
        release.has_no_definite_model(b.modal);
    }
    diagnosis.modal = Some(release.modal);
    diagnosis.is_filtered(status, name_of(&plain.structure.effects));
    diagnosis
}

fn steps(decay: &FreeDecay, path: &[Fitted]) -> Vec<Step> {
    let of = |k: usize| {
        let new = |e: &Effect| k > 0 && !path[k - 1].structure.effects.contains(e);
        step(decay, &path[k], path[k].structure.effects.iter().find(|e| new(e)))
    };
    (0..path.len()).map_at_once(of).collect()
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
