//! How much of what a plain model misses the surviving effects account for, and what is left.

use crate::bic;
use crate::diagnosis::answer::Candidate;
use crate::diagnosis::flexible::is_simple;
use crate::diagnosis::guards::{self, Refusal, OF_NAMED};
use crate::diagnosis::lines;
use crate::diagnosis::over_pieces;
use crate::diagnosis::survivors::{self, PredictedModel, Survivors};
use crate::diagnosis::unknown::Unknown;
use crate::diagnosis::verdict::{moment_of_rest, MAX_LEFT};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{polished, refitted, Fitted, Limit, Number};
use crate::fit::free_decay::FreeDecay;
use crate::par_map::ParMap;
use crate::quantity::{Quantity, CHANCE};
use std::collections::BTreeMap;

/// One model on the way from plain to final.
pub(crate) struct Step {
    pub(crate) added: Option<Effect>,
    pub(crate) model: Fitted,
    /// Rms of what was predicted, rad.
    pub(crate) held_out_rad: f64,
    pub(crate) parameters: BTreeMap<String, Quantity>,
}

/// What survives prediction, fitted to the whole record.
pub(crate) struct Account {
    pub(crate) steps: Vec<Step>,
    /// In the order in which they help; a constant moment among them where the zero is known.
    pub(crate) effects: Vec<Effect>,
    /// The plain model whose rest angle is fitted: its place among the steps.
    plain: usize,
    /// Every effect alone, best first.
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) survivors: Survivors,
}

/// Every effect alone on long pieces. What they leave follows the motion: an independent residual each half
/// cycle.
fn candidates(
    decay: &FreeDecay,
    survivors: &Survivors,
    mut refused: Vec<Refusal>,
) -> Vec<Candidate> {
    let count = survivors.lengths.long.means() as f64;
    let independent = 2.0 * count / decay.per_cycle();
    let plain = survivors.path[0].model.fit.sum();
    let mut candidate = |single: &over_pieces::Model| {
        let effect = single.fit.structure.effects.last().expect("an effect").clone();
        let more = effect.parameters().len() as f64;
        let reason = refused.iter().position(|r| r.effect == effect);
        Candidate {
            reason: reason.map(|at| refused.swap_remove(at).reason),
            effect,
            residual_over_noise: (single.fit.sum() / count).sqrt() / decay.noise_rad,
            delta_bic: bic::gain(plain, single.fit.sum(), independent, more),
            converged: single.fit.converged,
        }
    };
    survivors.singles.iter().map(&mut candidate).collect()
}

pub(super) fn of_judged(
    decay: &FreeDecay,
    survivors: &Survivors,
    judged: &PredictedModel,
) -> Fitted {
    let whole = over_pieces::whole(decay, &survivors.lengths, &judged.model.fit);
    refitted(decay, &whole.structure, &whole.numbers(0))
}

/// What stands of survivors.
pub(super) struct Standing<T> {
    pub(super) survivors: Survivors,
    /// Their last model.
    pub(super) last: T,
    /// Of its effects, those that the prediction alone tells from zero.
    pub(super) needed: Vec<Effect>,
    pub(super) refused: Vec<Refusal>,
}

/// `survivors` less what cannot stand in one of the releases, their last model fitted to the whole of each by
/// `fit`. An effect whose size, as `finished` knows it, may be zero stays as long as the prediction needs it.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(super) fn standing<T: Clone>(
    decays: &[FreeDecay],
    mut survivors: Survivors,
    fit: impl Fn(&Survivors, &PredictedModel) -> T,
    finished: impl Fn(T) -> T,
    each: impl Fn(&T) -> &[Fitted],
) -> Result<Standing<T>> {
    let mut refused = Vec::new();
    loop {
        let last = fit(&survivors, survivors.last());
        survivors.lengths.stop.check()?;
        let mut fits = each(&last).iter().zip(decays);
        if fits.clone().any(|(fit, decay)| is_simple(fit, decay)) {
            survivors = survivors.simple()?;
            continue;
        }
        let refusal = fits.find_map(|(fit, decay)| guards::refusal(fit, decay, survivors.there()));
        let Some(refusal) = refusal else {
            let known = finished(last.clone());
            let unknown = |fit| guards::of_unknown_size(fit, survivors.there(), OF_NAMED);
            let (first, others) = each(&known).split_first().expect("a release");
            // Where one of the releases knows it, it is known.
            let others: Vec<Vec<Effect>> = others.iter().map(unknown).collect();
            let mut unknown = unknown(first);
            unknown.retain(|effect| others.iter().all(|other| other.contains(effect)));
            let Unknown { needless, needed } =
                Unknown::new(&survivors.lengths, survivors.last(), unknown);
            let Some(less) = needless else {
                return Ok(Standing { survivors, last: known, needed, refused });
            };
            survivors = survivors.up_to(less.into())?;
            continue;
        };
        survivors = survivors.without(&refusal.effect)?;
        refused.push(refusal);
    }
}

/// Fits what survived to the whole of `decay`. With `zero_unknown` a rest off the sensor's zero is not named.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(crate) fn account(
    decay: &FreeDecay,
    survivors: Survivors,
    zero_unknown: bool,
) -> Result<Account> {
    let with_discrepancy = |model: Fitted| model.with_discrepancy(decay);
    // What only makes up for the error of quick simulations is seen to be nothing in a precise one.
    let Standing { survivors, last: known, needed, refused } = standing(
        std::slice::from_ref(decay),
        survivors,
        |survivors, judged| polished(of_judged(decay, survivors, judged), decay),
        with_discrepancy,
        std::slice::from_ref,
    )?;
    let told = |model: Fitted| guards::other_than_zero(model, &needed);
    let known = told(known);
    let smaller = &survivors.path[..survivors.path.len() - 1];
    let fits: Vec<Fitted> =
        smaller.iter().par_map(|judged| of_judged(decay, &survivors, judged)).collect();
    decay.stop.check()?;
    let rest = known.rest_rad().expect("a rest angle that was fitted");
    let offset = !zero_unknown && !rest.holds(0.0, CHANCE);
    let mut steps = Vec::new();
    let mut effects = Vec::new();
    if offset {
        let mut structure = survivors.path[0].model.fit.structure.clone();
        structure.limits.push(Limit { number: Number::SensorZero, low: 0.0, high: 0.0 });
        let judged = survivors::refit(&survivors.lengths, &structure, &survivors.path[0]);
        let model = of_judged(decay, &survivors, &judged);
        let held_out_rad = judged.prediction.rms_rad();
        // Where the model is far off, a rest angle need not help it to predict: then it is no step of its
        // own.
        if held_out_rad >= survivors.path[0].prediction.rms_rad() {
            steps.push(Step { added: None, model, held_out_rad, parameters: BTreeMap::new() });
        }
        effects.push(Effect::of_rest());
    }
    let plain = steps.len();
    let longer = lines::beside(decay, &known, survivors.there())?
        .into_iter()
        .map(|longer| (told(with_discrepancy(polished(longer.model, decay))), longer.held_out_rad));
    let held_out = survivors.path.iter().map(|judged| judged.prediction.rms_rad());
    let fits = fits.into_iter().map(with_discrepancy).chain([known]).zip(held_out);
    for (model, held_out_rad) in fits.chain(longer) {
        let is_new = |e: &&Effect| !effects.contains(e) && !survivors.there().contains(e);
        let new = model.structure.effects.iter().find(is_new).cloned();
        effects.extend(new.clone());
        let mut parameters: BTreeMap<String, Quantity> =
            model.effect_parameters().into_iter().collect();
        if offset {
            let (name, moment) = moment_of_rest(&model);
            parameters.insert(name, moment);
        }
        let added = new.or((plain > 0 && steps.len() == plain).then(Effect::of_rest));
        steps.push(Step { added, model, held_out_rad, parameters });
    }
    let candidates = candidates(decay, &survivors, refused);
    Ok(Account { steps, effects, plain, candidates, survivors })
}

impl Account {
    /// The plain model, its rest angle fitted.
    pub(crate) fn plain(&self) -> &Fitted {
        &self.steps[self.plain].model
    }

    pub(crate) fn last(&self) -> &Step {
        self.steps.last().expect("the plain model")
    }

    /// Of the plain model's mean square.
    fn share_left(&self) -> f64 {
        let plain = &self.steps[self.plain].model;
        (self.last().model.sum_of_squares / plain.sum_of_squares).min(1.0)
    }

    /// Whether effects that survive prediction account for most of what the plain model misses.
    pub(crate) fn explains_most(&self) -> bool {
        self.effects.iter().any(|e| !e.moves_rest()) && self.share_left() < MAX_LEFT
    }
}
