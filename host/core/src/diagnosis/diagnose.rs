//! The verdict on a record: adequate, explained by these effects, or unexplained.

use crate::bic;
pub use crate::diagnosis::answer::{Candidate, Options};

use crate::diagnosis::account::{self, Account, Left};
use crate::diagnosis::buffeting::{self, Buffeted};
use crate::diagnosis::compare::{self, Where};
use crate::diagnosis::forced::{self, Forced};
use crate::diagnosis::late_release;
use crate::diagnosis::reach;
use crate::diagnosis::search::{self, beyond, evidence, Found};
use crate::diagnosis::survivors;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{fit_added, held_out_over_noise, refit, Fitted, Structure};
use crate::fit::floor;
use crate::fit::free_decay::FreeDecay;
use crate::quantity::Quantity;
use crate::record::Record;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Share of the record that is fitted when the rest is held out.
pub const FITTED_SHARE: f64 = 0.65;
/// Residual over noise, of what all effects at once would leave in one linear step, up to which a model down to the
/// noise is looked for.
const WITHIN_REACH: f64 = 8.0;
/// The same for a model that is as near to the noise as that already.
const MISSED: f64 = 1.5;
/// Residual of the plain model over the noise beyond which the likelihood is not used.
const NEAR: f64 = 40.0;
/// Share of the amplitude that may be left where a model mostly explains a record, and share of the plain model's mean
/// square.
pub(crate) const SMALL: f64 = 0.01;
pub(crate) const MOST_LEFT: f64 = 0.25;
/// Residual over noise, on the part held out, up to which three effects and more count as an explanation.
const MOST_HELD_OUT: f64 = 1.5;
/// Gain of deviance by intensity, frequency and damping of each quarter's own: 12 +- 5 by chance.
const MOST_UNSTEADY: f64 = 45.0;
/// Innovations over their expected size, below which the forcing is a cloak for something else.
const LEAST_INNOVATIONS: f64 = 0.85;
/// Innovation, in standard deviations, that chance brings once in thousands of records.
const LARGEST: f64 = 6.0;
/// The same of a line in their spectrum, beyond ln(n/2).
const STRONGEST_LINE: f64 = 9.0;
/// Dependence of the innovations on the state, in standard deviations, that chance explains.
const MOST_DEPENDENT: f64 = 4.0;
/// Lag-one correlation of the innovations up to which they are white.
const MOST_CORRELATED: f64 = 0.1;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The plain model explains the record to its noise.
    Adequate,
    /// It does with the effects named.
    Explained,
    /// The effects named survive prediction and account for most of what is missing; the rest is said.
    MostlyExplained,
    /// Something is missing that the library does not hold, or not enough of it.
    Unexplained,
}

/// All that is said about one record. Rms in deg, ratios to the noise floor of block means.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    pub noise_rms_deg: f64,
    /// The same of the block means, to which `residual_over_noise` refers.
    pub mean_noise_deg: f64,
    pub status: Status,
    /// In the order in which they help.
    pub effects: Vec<Effect>,
    /// An accepted effect and one that does as well in its place.
    pub indistinguishable: Vec<[Effect; 2]>,
    pub modal: Modal,
    pub steps: Vec<Step>,
    /// Every effect alone, best first.
    pub candidates: Vec<Candidate>,
    #[serde(rename = "where")]
    pub where_: Where,
    /// What the model leaves, where it was chosen by prediction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left: Option<Left>,
    /// The answer in one sentence, where it was chosen by prediction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sentence: Option<String>,
    /// Angle of rest on the sensor's scale, about which the effects of such a model act.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rest_angle_deg: Option<Quantity>,
}

impl Diagnosis {
    /// Of each effect that helps and does not stand, why.
    pub fn refusals(&self) -> Vec<String> {
        let refusal = |c: &Candidate| Some(format!("{} refused: {}", c.effect, c.reason.as_ref()?));
        self.candidates.iter().filter_map(refusal).collect()
    }
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct Modal {
    pub natural_frequency_rad_s: Quantity,
    pub damping_ratio: Quantity,
}

/// One model on the way from plain to final.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    pub added: Option<Effect>,
    pub residual_rms_deg: f64,
    pub residual_over_noise: f64,
    /// On parts of the record that were not fitted; by a smaller model on the way where that predicts better.
    pub held_out_over_noise: f64,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Quantity>,
}

/// What a diagnosis begins with where no model is there.
pub const SECOND_ORDER: &str = "the second-order model";

/// The verdict in one line; `model` says what was there before.
pub fn verdict(status: Status, effects: &[Effect], model: &str) -> String {
    let names: Vec<&str> = effects.iter().map(|e| e.id()).collect();
    match status {
        Status::Adequate => format!("adequate: {model} explains it to its noise"),
        Status::Explained if model == SECOND_ORDER => format!("explained by {}", names.join(", ")),
        Status::Explained => format!("explained by {model} with {}", names.join(", ")),
        Status::MostlyExplained if names.is_empty() => format!("mostly explained by {model}"),
        Status::MostlyExplained => format!("mostly explained by {}", names.join(", ")),
        Status::Unexplained if names.is_empty() => {
            "unexplained: no effect of the library accounts for it".to_owned()
        }
        Status::Unexplained => {
            format!("unexplained: {} helped, but not to the noise", names.join(", "))
        }
    }
}

/// A diagnosis with the fits it rests on.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    pub diagnosis: Diagnosis,
    /// With the noise floor as the best model shows it.
    pub decay: FreeDecay,
    /// The present model with every effect of the library beside it, one at a time.
    pub singles: Vec<Fitted>,
    /// From the present model to the one of the verdict; the present model alone where that is random.
    pub path: Vec<Fitted>,
}

/// Judges `record`.
///
/// # Errors
/// As [`diagnose_with_fits`].
pub fn diagnose(record: &Record, options: &Options) -> Result<Diagnosis> {
    Ok(diagnose_with_fits(record, options)?.diagnosis)
}

/// Judges `record`, and keeps what was fitted.
///
/// # Errors
/// No free decay in it, a present model that cannot be fitted, or interrupted.
pub fn diagnose_with_fits(record: &Record, options: &Options) -> Result<Diagnosed> {
    let (wind_speed_m_s, stop) = (options.wind_speed_m_s, options.stop.clone());
    let decay = FreeDecay { wind_speed_m_s, stop, ..FreeDecay::of(record)? };
    judged(record, decay, options)
}

fn judged(record: &Record, decay: FreeDecay, options: &Options) -> Result<Diagnosed> {
    let fresh = options.present == Structure::default() && options.own.is_empty();
    if !fresh {
        return Ok(by_likelihood(record, &decay, options)?.0);
    }
    let survivors = survivors::search(&decay)?;
    let account = account::account(&decay, survivors, options.zero_unknown)?;
    let best = &account.last().model;
    let plain = search::present(&decay, options)?;
    let lowest = plain.rms_rad().min(account.plain_rad());
    let candidates: Vec<Effect> = Effect::deterministic().filter(|e| !e.is_flexible()).collect();
    let from = |model| reach::reach(&decay, model, &candidates);
    let reached = (lowest < NEAR * decay.noise_rad).then(|| (from(best), from(&plain)));
    // From near the noise a linear step is to be believed.
    let out_of_reach =
        |(beyond_best, _)| beyond_best > MISSED && best.over_noise(&decay) < WITHIN_REACH;
    let within = reached.is_some_and(|r| r.0.min(r.1) < WITHIN_REACH && !out_of_reach(r));
    if within || one_explains(&decay, &plain, &candidates) {
        let (diagnosed, good) = by_likelihood(record, &decay, options)?;
        if good {
            return Ok(diagnosed);
        }
    } else if let Some(b) = reached.and_then(|_| buffeting::fit(&decay, &plain)) {
        let (deterministic, n) = buffeting::definite_criterion(&decay, best);
        if holds(&b, plain.parameters.len(), deterministic, n) {
            let found = Found {
                decay: decay.clone(),
                plain: plain.clone(),
                singles: Vec::new(),
                path: vec![plain.clone()],
                explained: false,
                indistinguishable: Vec::new(),
            };
            let diagnosis = buffeted_verdict(&decay, &found, &b, None);
            return Ok(Diagnosed { diagnosis, path: vec![plain], decay, singles: Vec::new() });
        }
    }
    decay.stop.check()?;
    Ok(by_prediction(record, decay, account))
}

/// Whether a single effect brings the plain model down to the noise, however strong it is: a linear step does not see as
/// far, and what follows time alone or has corners is not among what is predicted with.
fn one_explains(decay: &FreeDecay, plain: &Fitted, candidates: &[Effect]) -> bool {
    candidates.par_iter().any(|effect| {
        let with = fit_added(decay, plain, effect);
        with.converged && search::is_explained(&with, decay)
    })
}

/// The answer that survives prediction.
fn by_prediction(record: &Record, decay: FreeDecay, account: Account) -> Diagnosed {
    let decay = floor::with_steps(decay, record);
    let last = &account.last().model;
    let where_ = compare::locate(&decay, last);
    let left = account.left(&decay, &where_);
    let named = account.effects.iter().any(|e| *e != Effect::StaticOffset);
    let status = match (search::is_explained(last, &decay), account.effects.is_empty()) {
        (true, true) => Status::Adequate,
        (true, false) => Status::Explained,
        (false, _) if left.share_of_amplitude < SMALL => Status::MostlyExplained,
        (false, _) if named && left.share_of_misfit < MOST_LEFT => Status::MostlyExplained,
        (false, _) => Status::Unexplained,
    };
    let step = |s: &account::Step| Step {
        added: s.added.clone(),
        residual_rms_deg: decay.raw_rms_deg(s.model.rms_rad()),
        residual_over_noise: s.model.over_noise(&decay),
        held_out_over_noise: s.held_out_rad / decay.noise_rad,
        parameters: s.parameters.clone(),
    };
    let diagnosis = Diagnosis {
        noise_rms_deg: decay.sample_noise_rad.to_degrees(),
        mean_noise_deg: decay.noise_rad.to_degrees(),
        status,
        effects: account.effects.clone(),
        indistinguishable: Vec::new(),
        modal: modal(last),
        steps: account.steps.iter().map(step).collect(),
        candidates: account.candidates.clone(),
        where_,
        sentence: Some(account::sentence(&account.effects, &left, SECOND_ORDER)),
        left: Some(left),
        rest_angle_deg: Some(Quantity::new(
            account.rest_angle.value.to_degrees(),
            account.rest_angle.u.to_degrees(),
        )),
    };
    let path = account.steps.into_iter().map(|s| s.model).collect();
    Diagnosed { diagnosis, decay, singles: Vec::new(), path }
}

/// The answer by likelihood, which holds near the noise; and whether it explains the record.
fn by_likelihood(
    record: &Record,
    decay: &FreeDecay,
    options: &Options,
) -> Result<(Diagnosed, bool)> {
    let found = search::search(decay, options)?;
    let decay = &found.decay;
    let last = found.path.last().expect("the plain model");
    if let Some((buffeted, forced)) = random_forcing(decay, &found) {
        let diagnosis = buffeted_verdict(decay, &found, &buffeted, forced.as_ref());
        let path = vec![found.plain.clone()];
        // Random forcing and an effect are named though not believed: no definite law stands for them.
        let good = true;
        return Ok((
            Diagnosed { diagnosis, path, decay: found.decay, singles: found.singles },
            good,
        ));
    }
    let effects = beyond(&found.plain, last).to_vec();
    let mut steps = steps(decay, &found.path);
    // Three effects or more can be bent to a short record; then they have to predict the rest of it too.
    let is_predicted =
        effects.len() < 3 || steps.last().is_some_and(|s| s.held_out_over_noise < MOST_HELD_OUT);
    let status = match (found.explained && is_predicted, effects.is_empty()) {
        (true, true) => Status::Adequate,
        (true, false) => Status::Explained,
        (false, _) => Status::Unexplained,
    };
    let mut modal_values = modal(last);
    if status == Status::Explained {
        if let Some(model) = late_release::from_release(record, decay, last) {
            steps.last_mut().expect("a model").parameters =
                model.effect_parameters().into_iter().collect();
            modal_values = modal(&model);
        }
    }
    let diagnosis = Diagnosis {
        noise_rms_deg: decay.sample_noise_rad.to_degrees(),
        mean_noise_deg: decay.noise_rad.to_degrees(),
        status,
        effects,
        indistinguishable: found
            .indistinguishable
            .iter()
            .map(|(a, b)| [a.clone(), b.clone()])
            .collect(),
        modal: modal_values,
        steps,
        candidates: candidates(decay, &found),
        where_: compare::locate(decay, last),
        left: None,
        sentence: None,
        rest_angle_deg: None,
    };
    let good = status != Status::Unexplained;
    Ok((
        Diagnosed { diagnosis, decay: found.decay, singles: found.singles, path: found.path },
        good,
    ))
}

/// The random forcing that explains the record, with the effects beside it, where no definite effects do: the same
/// throughout, its innovations white, blind to the state and down to the noise, and far likelier than the best
/// deterministic model.
fn random_forcing(decay: &FreeDecay, found: &Found) -> Option<(Buffeted, Option<Forced>)> {
    let best = found.path.last()?;
    if found.explained && beyond(&found.plain, best).len() < 2 {
        return None;
    }
    let (deterministic, n) = buffeting::definite_criterion(decay, best);
    let plain = buffeting::fit(decay, &found.plain)?;
    if deterministic - plain.deviance < bic::MARGIN {
        return None;
    }
    let candidates: Vec<Effect> =
        found.singles.iter().map(|single| beyond(&found.plain, single)[0].clone()).collect();
    if let Some(forced) = forced::search(decay, &found.plain, &plain, &candidates) {
        if holds(&forced.forcing, forced.model.parameters.len(), deterministic, n) {
            return Some((plain, Some(forced)));
        }
    }
    holds(&plain, found.plain.parameters.len(), deterministic, n).then_some((plain, None))
}

/// The random forcing of the `plain` model, if it is one and far likelier than `best`.
pub(crate) fn forced_rather_than(
    decay: &FreeDecay,
    plain: &Fitted,
    best: &Fitted,
) -> Option<Buffeted> {
    let (deterministic, n) = buffeting::definite_criterion(decay, best);
    buffeting::fit(decay, plain).filter(|b| holds(b, plain.parameters.len(), deterministic, n))
}

/// Whether what a model of so many `numbers` leaves is random forcing, given the criterion of the best definite model.
fn holds(b: &Buffeted, numbers: usize, deterministic: f64, n: f64) -> bool {
    let random = bic::of_deviance(b.deviance, n, numbers + 1);
    deterministic - random > bic::MARGIN
        && b.unsteadiness < MOST_UNSTEADY
        && b.correlation_off.abs() < MOST_CORRELATED.max(4.0 / n.sqrt())
        && b.state_dependence < MOST_DEPENDENT
        && b.largest < LARGEST
        && b.line < (0.5 * n).ln() + STRONGEST_LINE
        && (LEAST_INNOVATIONS..=search::EXPLAINED).contains(&b.over_noise)
}

fn buffeted_verdict(
    decay: &FreeDecay,
    found: &Found,
    b: &Buffeted,
    forced: Option<&Forced>,
) -> Diagnosis {
    let plain = &found.plain;
    let [_, u_wn, u_zeta] = b.deviations;
    // What is random cannot be predicted; the filter's innovations are one step ahead throughout.
    let random_step = |added: Effect, b: &Buffeted| {
        let intensity = Quantity::new(b.intensity, b.intensity * b.deviations[0]);
        Step {
            added: Some(added),
            residual_rms_deg: decay.raw_rms_deg(b.over_noise * decay.noise_rad),
            residual_over_noise: b.over_noise,
            held_out_over_noise: b.over_noise,
            parameters: BTreeMap::from([("buffeting.q".to_string(), intensity)]),
        }
    };
    let mut steps = vec![step(decay, plain, 0), random_step(Effect::Buffeting, b)];
    let mut effects = vec![Effect::Buffeting];
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
    let mut candidates = candidates(decay, found);
    let (definite, n) = buffeting::definite_criterion(decay, plain);
    let evidence = definite - bic::of_deviance(b.deviance, n, plain.parameters.len() + 1);
    let random = Candidate {
        reason: None,
        effect: Effect::Buffeting,
        residual_over_noise: b.over_noise,
        evidence,
        converged: true,
    };
    candidates.insert(0, random);
    Diagnosis {
        noise_rms_deg: decay.sample_noise_rad.to_degrees(),
        mean_noise_deg: decay.noise_rad.to_degrees(),
        // Random forcing and an effect together bend to much that the library lacks: they are named, not believed.
        status: if forced.is_none() { Status::Explained } else { Status::Unexplained },
        effects,
        indistinguishable: Vec::new(),
        modal: modal_values,
        steps,
        candidates,
        where_: compare::locate(decay, forced.map_or(plain, |f| &f.model)),
        left: None,
        sentence: None,
        rest_angle_deg: None,
    }
}

pub(crate) fn modal(model: &Fitted) -> Modal {
    Modal {
        natural_frequency_rad_s: model.natural_frequency_rad_s(),
        damping_ratio: model.damping_ratio(),
    }
}

fn steps(decay: &FreeDecay, path: &[Fitted]) -> Vec<Step> {
    let added = |k, model: &Fitted| if k == 0 { 0 } else { model.structure.effects.len() };
    path.par_iter().enumerate().map(|(k, model)| step(decay, model, added(k, model))).collect()
}

/// Residuals of one model, on what it was fitted to and on the later part held out from another fit.
pub fn step(decay: &FreeDecay, model: &Fitted, effects: usize) -> Step {
    let count = (FITTED_SHARE * decay.yaw_rad.len() as f64) as usize;
    let partial = refit(decay, model, count);
    Step {
        added: effects.checked_sub(1).map(|k| model.structure.effects[k].clone()),
        residual_rms_deg: decay.raw_rms_deg(model.rms_rad()),
        residual_over_noise: model.over_noise(decay),
        held_out_over_noise: held_out_over_noise(decay, &partial),
        parameters: model.effect_parameters().into_iter().collect(),
    }
}

fn candidates(decay: &FreeDecay, found: &Found) -> Vec<Candidate> {
    // One count of independent residuals for all, that of the best: else the worst correlated would be ranked by it.
    let best = found.singles.iter().min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    let effective = best.map_or(2.0, Fitted::effective_count);
    let mut out: Vec<Candidate> = found
        .singles
        .iter()
        .map(|single| Candidate {
            reason: None,
            effect: beyond(&found.plain, single)[0].clone(),
            residual_over_noise: single.over_noise(decay),
            evidence: evidence(&found.plain, single, effective),
            converged: single.converged,
        })
        .collect();
    out.sort_by(|a, b| b.converged.cmp(&a.converged).then(b.evidence.total_cmp(&a.evidence)));
    out
}
