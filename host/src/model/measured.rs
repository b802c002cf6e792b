//! A law measured from a model's records, taken into the model.

use crate::model::document::{EffectEntry, Model, ParameterEntry};
use crate::model::journal::{Action, JournalStep};
use crate::model::model_fit::{self, Data, Recorded};
use crate::model::revise::{check_addable, finish, opened, Asked, Change, Current, Revision};
use std::path::Path;
use yawrig_base::error::Result;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::Structure;
use yawrig_core::law::estimate::{measure_showing, Curve, Measured};

/// The record that is released from the largest angle: where most of a law is seen.
pub fn largest(data: &Data) -> &Recorded {
    let larger =
        |a: &&Recorded, b: &&Recorded| a.decay.amplitude_rad.total_cmp(&b.decay.amplitude_rad);
    data.fitted.iter().max_by(larger).expect("a model has a record that is fitted")
}

/// Measures the law beside the effects of `model`, from the record that is released from the largest angle; `show` is given
/// a first one.
///
/// # Errors
/// Exit 6 where none can be fitted, 130 where the user stops it.
pub fn measured(
    model: &Model,
    data: &Data,
    dissipative: bool,
    show: &dyn Fn(Curve),
) -> Result<Measured> {
    let effects = model.effects.iter().map(|e| e.effect.clone()).collect();
    let structure = Structure { effects, ..Structure::default() };
    Ok(measure_showing(&largest(data).decay, &structure, dissipative, show)?)
}

/// Measures a law and adds it to the model at `path`, which is then fitted to all of its records.
///
/// # Errors
/// As [`crate::model::revise::add`]; exit 6 where no law can be fitted.
pub fn add(path: &Path, dissipative: bool, asked: &Asked) -> Result<Revision> {
    let (store, model) = opened(path)?;
    let data = Data::of(&model, path)?;
    let inner = Current::fitted(&model, &data)?;
    let found = measured(&inner.model, &data, dissipative, &|_| {})?;
    let effect = Effect::Measured(found.law.clone());
    check_addable(&model, effect.clone())?;
    let outer = Current::fitted(&with_law(&inner.model, &data, &found), &data)?;
    let step = JournalStep {
        added: Some(effect.id().into()),
        ..JournalStep::now(Action::Add, "", String::new())
    };
    finish(
        store,
        asked,
        step,
        Change {
            added: Some(effect),
            before: Some(inner.appraisal(&data)?.residuals),
            evidence: Some(model_fit::evidence(&inner.fit, &outer.fit)),
            ..Change::to(&outer, &data)?
        },
    )
}

/// `model` with the law and all other numbers as they were found beside it.
fn with_law(model: &Model, data: &Data, found: &Measured) -> Model {
    let mut model = model.clone();
    // The law's yaw angle counts from the rest.
    model.unknown_zero |= model.effect(Effect::StaticOffset).is_none();
    let structure = &found.fit.structure;
    let mut numbers = found.fit.common[2 + usize::from(structure.zero_unknown)..].iter();
    model.effects.push(EffectEntry::unfitted(Effect::Measured(found.law.clone())));
    for entry in &mut model.effects {
        let varied: Vec<f64> = numbers.by_ref().take(entry.parameters.len()).copied().collect();
        let (values, _) = entry.effect.published(&varied);
        for (parameter, value) in entry.parameters.iter_mut().zip(values) {
            set(parameter, value);
        }
    }
    if let Some(modal) = model.modal.get_mut(&largest(data).entry.condition) {
        set(&mut modal.natural_frequency_rad_s, found.fit.common[0]);
        set(&mut modal.damping_ratio, found.fit.common[1]);
    }
    model
}

fn set(parameter: &mut ParameterEntry, value: f64) {
    if parameter.free {
        parameter.value = Some(value.clamp(parameter.min, parameter.max));
    }
}
