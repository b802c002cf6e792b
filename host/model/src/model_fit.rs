//! A model of the file fitted to its records, or compared with records as it is.

pub use crate::data::{Data, Recorded};
use crate::document::{is_own, EffectEntry, ModalEntry, Model, ParameterEntry};
use crate::limits::{limits_of, structure};
use rayon::prelude::*;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::diagnosis::diagnose::FITTED_SHARE;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{
    enough, fit_added, fit_from, fit_plain_within, refit, Fitted, Limit, Number, Structure,
};
use yawrig_core::fit::joint::{self, JointFit, Release, Sharing};
use yawrig_core::law::estimate::fit_whole;
use yawrig_core::quantity::Quantity;

/// Residual over noise up to which the fit of an added effect is not looked for by another way.
pub(super) const ADDED_WELL: f64 = 1.5;
/// How often a fit that has used up its evaluations is continued.
const ROUNDS: usize = 4;
/// What such a round gains in a valley, of the variance: a tenth of a standard error. Effects that the
/// records cannot tell apart share what they explain, and their uncertainties say so; where in the valley the
/// fit ends does not matter.
const VALLEY: f64 = 0.01;

/// The numbers of `effect` that a fit varies; zero for those that belong to a release and are not in the
/// file.
pub(super) fn varied(entry: &EffectEntry) -> Option<Vec<f64>> {
    let effect = entry.effect.clone();
    if let Some(values) = entry.values() {
        return Some(effect.varied(&values));
    }
    let users = |(index, p): (usize, &ParameterEntry)| {
        p.value.or_else(|| is_own(&effect, index).then_some(0.0))
    };
    let users: Option<Vec<f64>> = entry.parameters.iter().enumerate().map(users).collect();
    Some(effect.varied(&users?))
}

/// The numbers of a fit that begins at the model's values, with the initial state of `like`.
fn start(model: &Model, condition: &str, like: &Fitted) -> Option<Vec<f64>> {
    let mut p = like.parameters[..like.structure.own_numbers()].to_vec();
    if let (Some(modal), [wn, zeta, ..]) = (model.modal.get(condition), p.as_mut_slice()) {
        *wn = modal.natural_frequency_rad_s.value.unwrap_or(*wn);
        *zeta = modal.damping_ratio.value.unwrap_or(*zeta);
    }
    for entry in &model.effects {
        p.extend(varied(entry)?);
    }
    Some(p)
}

pub(super) fn better(a: &Fitted, b: &Fitted) -> bool {
    (b.converged, a.sum_of_squares) < (a.converged, b.sum_of_squares)
}

/// One record's own fit: the effects added one after the other, or from the model's values, whichever has the
/// smaller residual.
fn single(model: &Model, structure: &Structure, recorded: &Recorded) -> Result<Fitted> {
    let decay = &recorded.decay;
    let count = decay.yaw_rad.len();
    let plain = fit_plain_within(decay, structure, count);
    let measured = model.effects.iter().any(|e| e.effect.measured().is_some());
    if let Some(start) = start(model, &recorded.entry.condition, &plain).filter(|_| measured) {
        return Ok(fit_whole(decay, structure, &start));
    }
    let mut best = plain.clone();
    for entry in &model.effects {
        interrupt::check()?;
        best = fit_added(decay, &best, &entry.effect);
    }
    if let Some(start) = start(model, &recorded.entry.condition, &plain) {
        let from = fit_from(decay, structure, &start, count);
        if better(&from, &best) {
            best = from;
        }
    }
    Ok(best)
}

/// Fits `model` to its records: what is free, within its bounds.
///
/// # Errors
/// Exit 3 where bounds on wn or zeta stand beside several conditions, 130 where the user stops it.
pub fn fit(model: &Model, data: &Data) -> Result<JointFit> {
    let structure = structure(model)?;
    if structure.effects.iter().any(Effect::is_own) {
        let found = from_own_values(model, data, &structure)?;
        if let Some(fit) = found.filter(|f| f.converged && f.sum_of_squares <= enough(f.count)) {
            return Ok(fit);
        }
    }
    let singles: Vec<Fitted> = data
        .fitted
        .par_iter()
        .map(|recorded| single(model, &structure, recorded))
        .collect::<Result<_>>()?;
    interrupt::check()?;
    let at = |(r, s): (&Recorded, &Fitted)| start(model, &r.entry.condition, s);
    let from_values: Option<Vec<_>> = data.fitted.iter().zip(&singles).map(at).collect();
    let others: Vec<_> = from_values.into_iter().filter(|_| singles.len() > 1).collect();
    fit_jointly(data, &structure, &singles, &others)
}

/// From the model's values alone, where it has them: with a user's own effect each simulation takes long.
fn from_own_values(model: &Model, data: &Data, structure: &Structure) -> Result<Option<JointFit>> {
    let plain = |recorded: &Recorded| {
        let decay = &recorded.decay;
        let plain = fit_plain_within(decay, structure, decay.yaw_rad.len());
        start(model, &recorded.entry.condition, &plain)
    };
    let starts: Option<Vec<Vec<f64>>> = data.fitted.par_iter().map(plain).collect();
    interrupt::check()?;
    let Some(starts) = starts else { return Ok(None) };
    let sharing = data.sharing(structure.effects.len());
    let fit = joint::fit(&data.releases(), structure, &sharing, &starts);
    interrupt::check()?;
    Ok(Some(fit))
}

fn numbers(fits: &[Fitted]) -> Vec<Vec<f64>> {
    fits.iter().map(|fit| fit.parameters.clone()).collect()
}

/// All records at once, from each one's own fit and from `others`.
pub(super) fn fit_jointly(
    data: &Data,
    structure: &Structure,
    singles: &[Fitted],
    others: &[Vec<Vec<f64>>],
) -> Result<JointFit> {
    let (releases, sharing) = (data.releases(), data.sharing(structure.effects.len()));
    let mut best =
        joint::fit_from(&releases, structure, &sharing, &singles.iter().collect::<Vec<_>>());
    for starts in others {
        interrupt::check()?;
        let other = joint::fit(&releases, structure, &sharing, starts);
        if other.is_better_than(&best) {
            best = other;
        }
    }
    let polished = continued(&releases, structure, &sharing, best)?.polished(&releases);
    interrupt::check()?;
    Ok(polished)
}

/// `fit` until it has converged, or that takes too long.
pub(super) fn continued(
    releases: &[Release],
    structure: &Structure,
    sharing: &Sharing,
    mut fit: JointFit,
) -> Result<JointFit> {
    for _ in 1..ROUNDS {
        interrupt::check()?;
        if fit.converged {
            break;
        }
        let before = fit.sum_of_squares;
        fit = joint::fit(releases, structure, sharing, &numbers(&fit.fits));
        let (gain, variance) = (before - fit.sum_of_squares, fit.sum_of_squares / fit.count as f64);
        fit.converged |= 0.0 < gain && gain < VALLEY * variance;
    }
    interrupt::check()?;
    Ok(fit)
}

/// `model` with the values that `fit` has found.
pub fn updated(model: &Model, data: &Data, fit: &JointFit) -> Model {
    let known = |entry: &mut ParameterEntry, q: Quantity| {
        if entry.free {
            entry.value = Some(q.value);
            entry.u = Some(q.u).filter(|u| u.is_finite() && *u > 0.0);
        }
    };
    let mut new = model.clone();
    for entry in &mut new.records {
        let read = data.fitted.iter().chain(&data.held_out).find(|r| r.entry.file == entry.file);
        let content = read.and_then(|r| yawrig_records::content_when_read(&r.path));
        entry.crc32 = content.map(|c| c.crc32).or(entry.crc32.take());
    }
    new.modal.clear();
    for (recorded, fitted) in data.fitted.iter().zip(&fit.fits) {
        let condition = &recorded.entry.condition;
        let mut entry = model.modal.get(condition).copied().unwrap_or_default();
        known(&mut entry.natural_frequency_rad_s, fitted.natural_frequency_rad_s());
        known(&mut entry.damping_ratio, fitted.damping_ratio());
        new.modal.entry(condition.clone()).or_insert(entry);
    }
    let mut effects: Vec<EffectEntry> = Vec::new();
    let mut found = fit.fits[0].effect_parameters().into_iter();
    for effect in &fit.structure.effects {
        let entry = model.effect(effect.clone()).cloned();
        let mut entry = entry.unwrap_or_else(|| EffectEntry::unfitted(effect.clone()));
        for (index, parameter) in entry.parameters.iter_mut().enumerate() {
            let Some((_, quantity)) = found.next() else { break };
            known(parameter, quantity);
            if data.fitted.len() > 1 && is_own(effect, index) && parameter.free {
                (parameter.value, parameter.u) = (None, None);
            }
        }
        effects.push(entry);
    }
    new.effects = effects;
    new
}

/// `model` compared with a record: only the record's own numbers are fitted, which are its initial state, the
/// sensor's zero where unknown, size and phase of a line, a drift; and wn and zeta where the model does not
/// know them under the record's condition.
///
/// # Errors
/// Exit 3 where the model has no values yet.
pub fn held_against(model: &Model, recorded: &Recorded, share: f64) -> Result<Fitted> {
    let decay = &recorded.decay;
    let of = model.recorded.measurand();
    if !model.effects.is_empty() && of.coordinate_unit() != decay.measurand.coordinate_unit() {
        let (path, unit) = (recorded.path.display(), decay.measurand.coordinate_unit());
        let what =
            format!("{path}: its motion is in {unit}, and the model's in {}", of.coordinate_unit());
        return Err(
            Error::data(what).help("its effects are per unit of that: make a model of this record")
        );
    }
    let wind_m_s = decay.wind_speed_m_s;
    if let Some(entry) = model.effects.iter().find(|e| !e.effect.is_known_at(wind_m_s)) {
        let (path, effect) = (recorded.path.display(), &entry.effect);
        let what = format!("{path}: {effect} has no coefficient at {wind_m_s} m/s");
        return Err(Error::data(what).help(
            "compare it with a record at one of the model's wind speeds, which its file lists",
        ));
    }
    let count = ((share * decay.yaw_rad.len() as f64) as usize).max(2);
    let modal = model.modal.get(&recorded.entry.condition).copied().unwrap_or_default();
    let mut limits: Vec<Limit> = Vec::new();
    for (number, entry) in [
        (Number::NaturalFrequency, modal.natural_frequency_rad_s),
        (Number::DampingRatio, modal.damping_ratio),
    ] {
        limits.extend(entry.value.map(|value| Limit { number, low: value, high: value }));
    }
    for entry in &model.effects {
        let effect = entry.effect.clone();
        let numbers = varied(entry).ok_or_else(|| {
            Error::data(format!("{effect} has no values yet")).help("run `yawrig fit`")
        })?;
        limits.extend(limits_of(entry));
        for (number, &value) in numbers.iter().enumerate() {
            if !effect.belongs_to_release(number) {
                limits.push(Limit {
                    number: Number::Of(effect.clone(), number),
                    low: value,
                    high: value,
                });
            }
        }
    }
    let effects = model.effects.iter().map(|e| e.effect.clone()).collect();
    let zero_unknown = model.unknown_zero || !decay.measurand.shows_rest();
    let structure = Structure { effects, zero_unknown, limits, ..Structure::default() };
    let plain = fit_plain_within(decay, &structure, count);
    let start = start(model, &recorded.entry.condition, &plain).expect("values, as seen above");
    let mut fit = fit_from(decay, &structure, &start, count);
    fit.structure = structure.precisely();
    Ok(if fit.structure.precise { refit(decay, &fit, count) } else { fit })
}

/// Residual over noise of several records, jointly.
pub fn combined(fits: &[Fitted], recorded: &[&Recorded]) -> f64 {
    let (mut n, mut sum) = (0.0, 0.0);
    for (fit, recorded) in fits.iter().zip(recorded) {
        n += fit.count as f64;
        sum += fit.count as f64 * fit.over_noise(&recorded.decay).powi(2);
    }
    (sum / f64::max(n, 1.0)).sqrt()
}

/// What `model`, whose fit is `fit`, does to data that were not fitted: the records held out, or else the
/// later part of each record, the earlier having been fitted alone.
///
/// # Errors
/// As [`held_against`].
pub fn held_out(model: &Model, data: &Data, fit: &JointFit) -> Result<f64> {
    if data.held_out.is_empty() {
        return later_part(data, &fit.structure, &fit.fits);
    }
    let against = |recorded: &Recorded| held_against(model, recorded, 1.0);
    let fits: Vec<Fitted> = data.held_out.par_iter().map(against).collect::<Result<_>>()?;
    interrupt::check()?;
    Ok(combined(&fits, &data.held_out.iter().collect::<Vec<_>>()))
}

/// Residual over noise on the last part of each record of a model fitted to the first part, from `fits`.
///
/// # Errors
/// 130 where the user stops it.
pub fn later_part(data: &Data, structure: &Structure, fits: &[Fitted]) -> Result<f64> {
    let parts: Vec<Release> =
        data.fitted.iter().map(|r| Release::part(&r.decay, FITTED_SHARE)).collect();
    let sharing = data.sharing(structure.effects.len());
    let quick = Structure { precise: false, ..structure.clone() };
    let partial = joint::fit(&parts, &quick, &sharing, &numbers(fits)).polished(&parts);
    interrupt::check()?;
    Ok(partial.held_out_over_noise(data.decays()))
}

/// Natural frequency and damping of `entry`, as far as known.
pub fn modal_of(entry: &ModalEntry) -> Option<[Quantity; 2]> {
    let known = |p: &ParameterEntry| Some(Quantity::new(p.value?, p.u.unwrap_or(0.0)));
    Some([known(&entry.natural_frequency_rad_s)?, known(&entry.damping_ratio)?])
}
