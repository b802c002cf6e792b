//! The answer by likelihood: which effects, or which random forcing, bring a model down to the noise.

use crate::diagnosis::answer::{
    earlier_count, hold_least, step, Candidate, Diagnosed, Diagnosis, HeldOut, Status, Step,
};
use crate::diagnosis::buffeting::{self, Buffeted};
use crate::diagnosis::forced::{self, Forced, BEYOND_CHANCE};
use crate::diagnosis::guards::{self, Refusal};
use crate::diagnosis::late_release;
use crate::diagnosis::likelihood::{is_explained, NEAR_NOISE};
use crate::diagnosis::search::{self, beyond, criterion, SearchResult, SearchStart};
use crate::diagnosis::verdict::{name_of, Chosen, MAX_LEFT};
use crate::effects::{Acts, Effect};
use crate::error::Result;
use crate::fit::fitting::{refit, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::par_map::ParMap;
use crate::record::Record;
use crate::statistics::rare_chi_squared;
use std::collections::BTreeMap;
use std::slice::from_ref;

/// What likelihood finds in a release.
pub(super) struct Likely {
    found: SearchResult,
    explained: bool,
    /// The answer by random forcing, where that is likelier than what definite effects leave.
    forced: Option<Diagnosed>,
}

/// # Errors
/// Interrupted, once somebody asked for it.
pub(super) fn by_likelihood(
    record: &Record,
    decay: &FreeDecay,
    start: &SearchStart,
) -> Result<Likely> {
    let found = search::search(decay, start)?;
    let decay = &found.decay;
    let last = found.path.last().expect("the plain model");
    let explained = is_explained(last, decay);
    let alone = explained && beyond(&found.plain, last).len() < 2;
    // Random forcing that hardly shows bends a single effect to it; then it has to be likelier by itself.
    let forced = !alone || forced::forced_rather_than(decay, &start.plain, last).is_some();
    let forced = forced.then(|| random_forcing(record, decay, start, last)).flatten();
    Ok(Likely { found, explained, forced })
}

impl Likely {
    /// Whether something is down to the noise.
    pub(super) fn explains(&self) -> bool {
        self.explained || self.forced.is_some()
    }

    /// Every effect alone, best first.
    pub(super) fn candidates(&self) -> Vec<Candidate> {
        let SearchResult { decay, plain, singles, refused, .. } = &self.found;
        candidates(decay, plain, singles, refused)
    }

    /// The answer: which effects, or which random forcing, bring the model that is there down to the noise,
    /// as far as they do.
    pub(super) fn answer(self, record: &Record) -> Diagnosed {
        let candidates = self.candidates();
        let Self { mut found, explained, forced } = self;
        if let Some(forced) = forced {
            return forced;
        }
        let decay = &found.decay;
        found.path = found.path.into_iter().map(|model| model.with_discrepancy(decay)).collect();
        let last = found.path.last().expect("the plain model");
        let mut steps = steps(decay, &found.path);
        let effects: Vec<Effect> = steps.iter().filter_map(|step| step.added.clone()).collect();
        let holds = explained && is_predicted(decay, last, &steps);
        let status = match (holds, effects.is_empty()) {
            (true, true) => Status::Adequate,
            (true, false) => Status::Explained,
            (false, _) => Status::Unexplained,
        };
        hold_least(&mut steps);
        let chosen = Chosen {
            status: Some(status),
            effects,
            indistinguishable: found.indistinguishable,
            steps,
            held_out: HeldOut::LaterPart,
            candidates,
            model: name_of(&found.plain.structure.effects),
        };
        let models = [from_ref(&found.plain), from_ref(last)];
        let mut diagnosis = Diagnosis::new(&[record.name()], from_ref(decay), models, chosen);
        if status == Status::Explained
            && let Some(model) = late_release::from_release(record, decay, last)
        {
            let parameters = model.effect_parameters().into_iter().collect();
            diagnosis.steps.last_mut().expect("a model").parameters = parameters;
            diagnosis.releases[0].has_numbers_of(decay, &model);
            diagnosis.modal = Some(model.modal());
        }
        let path = found.path.into_iter().map(|model| vec![model]).collect();
        Diagnosed { diagnosis, decays: vec![found.decay], singles: found.singles, path }
    }
}

/// Whether `model`, the last of `steps`, is more than bent to the record. Its earlier part predicts the later
/// one; or most of what every smaller model misses there, and more it cannot tell: fitted alone it has the same
/// numbers but for chance, which is all that is asked where there is no smaller model.
fn is_predicted(decay: &FreeDecay, model: &Fitted, steps: &[Step]) -> bool {
    let held_out = |step: &Step| step.held_out_over_noise.powi(2);
    let (last, smaller) = steps.split_last().expect("the plain model");
    if last.held_out_over_noise < NEAR_NOISE {
        return true;
    }
    let earlier = refit(decay, model, earlier_count(decay));
    let squares: f64 = model.residuals[..earlier.count].iter().map(|r| r * r).sum();
    let lost = (squares - earlier.sum_of_squares) / earlier.rms_rad().powi(2);
    smaller.iter().all(|step| held_out(last) < MAX_LEFT * held_out(step))
        && lost < rare_chi_squared(model.parameters.len() as f64)
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
    let delta_bic = buffeting::gain_over(decay, plain, b);
    let random = Candidate {
        reason: None,
        effect: Effect::random(),
        residual_over_noise: b.over_noise,
        delta_bic,
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
    let mut diagnosis = Diagnosis::new(&[record.name()], from_ref(decay), models, chosen);
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
    (0..path.len()).par_map(of).collect()
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
                delta_bic: single.bic().gain_over(&plain.bic()),
                converged: single.converged,
            }
        })
        .collect()
}
