//! How much of what a plain model misses the surviving effects account for, and what is left.

use crate::bic;
use crate::diagnosis::answer::{Candidate, Left, MOST_LEFT, NOISE};
use crate::diagnosis::compare::{self, Where};
use crate::diagnosis::flexible::is_simple;
use crate::diagnosis::guards::{self, Refusal};
use crate::diagnosis::likelihood::is_explained;
use crate::diagnosis::lines;
use crate::diagnosis::over_pieces;
use crate::diagnosis::survivors::{self, PredictedModel, Survivors};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::at_amplitude::with_discrepancy;
use crate::fit::fitting::{refitted, Fitted, Limit, Number};
use crate::fit::free_decay::FreeDecay;
use crate::quantity::{Quantity, CHANCE};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Share of the amplitude by which the rest angle is off the sensor's zero for it to be named.
const LEAST_OFFSET: f64 = 0.005;
/// Residual of a part of the amplitudes, over that of all, from which on it is named.
const STANDS_OUT: f64 = 1.3;

/// One model on the way from plain to final.
pub(crate) struct Step {
    pub(crate) added: Option<Effect>,
    pub(crate) model: Fitted,
    /// Rms of what was predicted, by this model or a smaller one on the way that predicts better, rad.
    pub(crate) held_out_rad: f64,
    pub(crate) parameters: BTreeMap<String, Quantity>,
}

/// What survives prediction, fitted to the whole record.
pub(crate) struct Account {
    pub(crate) steps: Vec<Step>,
    /// In the order in which they help; a constant moment among them where the zero is known.
    pub(crate) effects: Vec<Effect>,
    pub(crate) rest_angle: Quantity,
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
            evidence: bic::gain(plain, single.fit.sum(), independent, more),
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

/// The constant moment under which `model` rests where it does, over Izz, as the parameter of that effect.
pub(super) fn moment_of_rest(model: &Fitted) -> (String, Quantity) {
    let stiffness = model.parameters[0].powi(2);
    let rest = model.rest_rad().expect("a rest angle that was fitted");
    (Effect::of_rest().first_name(), Quantity::new(stiffness * rest.value, stiffness * rest.u))
}

/// Fits what survived to the whole of `decay`. With `zero_unknown` a rest off the sensor's zero is not named.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(crate) fn account(
    decay: &FreeDecay,
    mut survivors: Survivors,
    zero_unknown: bool,
) -> Result<Account> {
    let mut refused = Vec::new();
    let last = loop {
        let last = of_judged(decay, &survivors, survivors.path.last().expect("the plain model"));
        decay.stop.check()?;
        if is_simple(&last, decay) {
            survivors = survivors.simple()?;
            continue;
        }
        // What was there from the beginning is the user's.
        let refusal =
            guards::refusal(&last, decay).filter(|r| !survivors.there().contains(&r.effect));
        match refusal {
            Some(refusal) => {
                survivors = survivors.without(refusal.effect.clone())?;
                refused.push(refusal);
            }
            None => break last,
        }
    };
    let smaller = &survivors.path[..survivors.path.len() - 1];
    let mut fits: Vec<Fitted> =
        smaller.par_iter().map(|judged| of_judged(decay, &survivors, judged)).collect();
    fits.push(last);
    decay.stop.check()?;
    let rest = fits.last().and_then(Fitted::rest_rad).expect("a rest angle that was fitted");
    let offset = !zero_unknown
        && rest.value.abs() > CHANCE * rest.u
        && rest.value.abs() > LEAST_OFFSET * decay.reading_rad();
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
    let longer = lines::beside(decay, fits.last().expect("the plain model"))?;
    let held_out = survivors.path.iter().map(|judged| judged.prediction.rms_rad());
    let mut models: Vec<(Fitted, f64)> = fits.into_iter().zip(held_out).collect();
    models.extend(longer.into_iter().map(|longer| (longer.model, longer.held_out_rad)));
    for (model, held_out_rad) in models {
        let model = with_discrepancy(model, decay);
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
        // Two effects may be needed before either helps: until then a smaller model of the path predicts
        // better.
        let smaller = steps.last().map_or(f64::INFINITY, |step: &Step| step.held_out_rad);
        let held_out_rad = held_out_rad.min(smaller);
        steps.push(Step { added, model, held_out_rad, parameters });
    }
    let candidates = candidates(decay, &survivors, refused);
    Ok(Account { steps, effects, rest_angle: rest, plain, candidates, survivors })
}

impl Account {
    /// What the plain model leaves, rad.
    pub(crate) fn plain_rad(&self) -> f64 {
        self.steps[self.plain].model.rms_rad()
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
        self.effects.iter().any(|e| !e.moves_rest()) && self.share_left() < MOST_LEFT
    }

    pub(crate) fn left(&self, decay: &FreeDecay, where_: &Where) -> Left {
        let last = &self.last().model;
        Left {
            rms_deg: decay.measurand.shown(last.rms_rad()),
            unit: decay.measurand.unit().to_owned(),
            share_of_amplitude: last.rms_rad() / decay.reading_rad(),
            share_of_misfit: self.share_left(),
            where_: match is_explained(last, decay) {
                true => NOISE.into(),
                false => in_words(decay, where_),
            },
        }
    }
}

/// Of which kind what is left is, and at which amplitudes.
fn in_words(decay: &FreeDecay, where_: &Where) -> String {
    let hz = decay.frequency_rad_s / TAU;
    let share = |from: f64, to: f64| {
        let inside = where_.frequency.iter().filter(|f| f.hz >= from * hz && f.hz < to * hz);
        inside.map(|f| f.share).sum::<f64>()
    };
    let kinds = [
        (share(0.0, 0.6), "slow"),
        (share(0.6, 1.5), "at the fundamental"),
        (share(1.5, 2.5), "at the second harmonic"),
        (share(2.5, 3.5), "at the third harmonic"),
        (share(3.5, f64::INFINITY), "at high harmonics"),
    ];
    let kind = kinds.iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or("", |k| k.1);
    let bins = &where_.amplitude;
    let unit = decay.measurand.coordinate_unit();
    let all = {
        let sum: f64 = bins.iter().map(|b| b.rms_deg.powi(2)).sum();
        (sum / bins.len().max(1) as f64).sqrt()
    };
    let out = |b: &compare::AmplitudeBin| b.rms_deg > STANDS_OUT * all;
    let above = bins.iter().rev().take_while(|b| out(b)).last();
    let below = bins.iter().take_while(|b| out(b)).last();
    match (above, below) {
        (Some(bin), _) => format!("{kind}, above {} {unit}", Rounded(bin.from_deg)),
        (None, Some(bin)) => format!("{kind}, below {} {unit}", Rounded(bin.to_deg)),
        (None, None) => format!("{kind}, at all amplitudes"),
    }
}

/// To two figures.
struct Rounded(f64);

impl std::fmt::Display for Rounded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = (1.0 - self.0.abs().max(1e-9).log10().floor()).max(0.0) as usize;
        write!(f, "{:.*}", digits, self.0)
    }
}

/// The sentence that stands for the answer.
pub(crate) fn sentence(effects: &[Effect], left: &Left, model: &str) -> String {
    let names: Vec<String> = effects.iter().map(|e| e.card().title.to_lowercase()).collect();
    let rest = format!(
        "{} {} ({} %) is left, {}",
        Rounded(left.rms_deg),
        left.unit,
        Rounded(100.0 * left.share_of_amplitude),
        left.where_
    );
    let Some((last, others)) = names.split_last() else {
        return format!("no effect of the library predicts better than {model}; {rest}");
    };
    let (list, verb) = match others {
        [] => (last.clone(), "accounts"),
        _ => (format!("{} and {last}", others.join(", ")), "account"),
    };
    let accounted = 100.0 * (1.0 - left.share_of_misfit);
    let digits = if accounted > 99.0 { 2 } else { 1 };
    format!("{list} {verb} for {accounted:.digits$} % of what {model} misses; {rest}")
}
