//! A law measured from a model's records, taken into the model.

use crate::document::{EffectEntry, Model, ParameterEntry};
use crate::limits;
use crate::model_fit::{self, Data, Recorded};
use crate::revise::{self, Current, Revision, RevisionRequest};
use std::path::Path;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_core::diagnosis::together::Releases;
use yawrig_core::effects::Effect;
use yawrig_core::law::estimate::{measure, Curve, Measured};

/// The record that is released from the largest angle: where most of a law is seen.
pub fn largest(data: &Data) -> &Recorded {
    let larger =
        |a: &&Recorded, b: &&Recorded| a.decay.amplitude_rad.total_cmp(&b.decay.amplitude_rad);
    data.fitted.iter().max_by(larger).expect("a model has a record that is fitted")
}

/// The records that a law is measured from beside the effects of `model`: all, or, where an effect has
/// numbers that belong to a release (a line, a drift), the one from the largest angle.
pub fn measured_from<'a>(model: &Model, data: &'a Data) -> Vec<&'a Recorded> {
    let is_of_release = |entry: &EffectEntry| {
        (0..entry.parameters.len()).any(|k| entry.effect.belongs_to_release(k))
    };
    match model.effects.iter().any(is_of_release) {
        true => vec![largest(data)],
        false => data.fitted.iter().collect(),
    }
}

/// `records` as releases of one law; those of one condition have natural frequency and damping ratio in
/// common.
pub fn releases<'a>(records: &[&'a Recorded]) -> Releases<'a> {
    let same = |r: &Recorded| records.iter().position(|o| o.entry.condition == r.entry.condition);
    let each: Vec<_> = records.iter().map(|r| (&r.decay, same(r).unwrap_or(0))).collect();
    Releases::new(&each)
}

/// Measures the law beside the effects of `model`, from their values and within their bounds, on the records
/// that [`measured_from`] names; `show` is given a first one.
///
/// # Errors
/// Exit 2 where the model holds a measured law, 3 where an effect has no values yet, 6 where none can be
/// fitted, 130 where the user stops it.
pub fn measured(
    model: &Model,
    data: &Data,
    dissipative: bool,
    show: &dyn Fn(Curve),
) -> Result<Measured> {
    check_has_none(model)?;
    let mut numbers = Vec::new();
    for entry in &model.effects {
        numbers.extend(model_fit::varied(entry).ok_or_else(|| {
            Error::data(format!("{} has no values yet", entry.effect))
                .help("run `yawrig fit` first")
        })?);
    }
    let structure = limits::structure(model)?;
    let releases = releases(&measured_from(model, data));
    Ok(measure(&releases, &structure, &numbers, dissipative, show)?)
}

fn check_has_none(model: &Model) -> Result<()> {
    if model.effects.iter().any(|e| e.effect.measured().is_some()) {
        let what = "the model holds a measured law already; another beside it would say nothing";
        return Err(Error::usage(what)
            .help("to measure it again, take it out first: yawrig remove measured_law"));
    }
    Ok(())
}

/// Measures a law and adds it to the model at `path`, which is then fitted to all of its records.
///
/// # Errors
/// As [`crate::revise::add`]; exit 6 where no law can be fitted.
pub fn add(path: &Path, dissipative: bool, asked: &RevisionRequest) -> Result<Revision> {
    revise::add_by(path, asked, check_has_none, |inner, data| {
        let found = measured(&inner.model, data, dissipative, &|_| {})?;
        let outer = Current::fitted(&with_law(&inner.model, data, &found), data)?;
        let (before, after) = (inner.fit.over_noise(), outer.fit.over_noise());
        if after >= before {
            return Err(Error::new(
                Exit::Quality,
                format!(
                    "the measured law leaves {after:.3} over noise of the whole record, the model without it {before:.3}; \
                     nothing is changed"
                ),
            )
            .help("`yawrig diagnose` says which effects explain it; add those first"));
        }
        Ok((Effect::Measured(found.law), outer))
    })
}

/// `model` with the law and all other numbers as they were found beside it.
fn with_law(model: &Model, data: &Data, found: &Measured) -> Model {
    let mut model = model.clone();
    // The law's yaw angle counts from the rest.
    model.unknown_zero |= model.rest().is_none();
    let mut numbers = found.effect_numbers().iter();
    let records = measured_from(&model, data);
    model.effects.push(EffectEntry::unfitted(Effect::Measured(found.law.clone())));
    for entry in &mut model.effects {
        let varied: Vec<f64> = numbers.by_ref().take(entry.parameters.len()).copied().collect();
        let (values, _) = entry.effect.published(&varied);
        for (parameter, value) in entry.parameters.iter_mut().zip(values) {
            set(parameter, value);
        }
    }
    for (recorded, [wn_rad_s, zeta]) in records.iter().zip(&found.modal) {
        if let Some(modal) = model.modal.get_mut(&recorded.entry.condition) {
            set(&mut modal.natural_frequency_rad_s, *wn_rad_s);
            set(&mut modal.damping_ratio, *zeta);
        }
    }
    model
}

fn set(parameter: &mut ParameterEntry, value: f64) {
    if parameter.free {
        parameter.value = Some(value.clamp(parameter.min, parameter.max));
    }
}
