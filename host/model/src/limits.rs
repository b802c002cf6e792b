//! What the model's file lets a fit vary, and how far.

use crate::document::{EffectEntry, Model, ParameterEntry, DAMPING_RATIO, NATURAL_FREQUENCY};
use yawrig_base::error::{Error, Result};
use yawrig_core::fit::fitting::{Limit, Number, Structure};

/// What the model lets a fit vary, and how far.
///
/// # Errors
/// Exit 3 where bounds on natural frequency or damping stand beside several conditions.
pub fn structure(model: &Model) -> Result<Structure> {
    let mut limits: Vec<Limit> = model.effects.iter().flat_map(limits_of).collect();
    for (condition, entry) in &model.modal {
        for (number, entry, own) in [
            (Number::NaturalFrequency, &entry.natural_frequency_rad_s, NATURAL_FREQUENCY),
            (Number::DampingRatio, &entry.damping_ratio, DAMPING_RATIO),
        ] {
            let [low, high] = range(entry);
            if [low, high] == own {
                continue;
            }
            if model.modal.len() > 1 {
                let what =
                    format!("bounds or free = false on wn or zeta of condition \"{condition}\"");
                return Err(Error::data(format!("{what}, one of several"))
                    .help("such bounds are kept for a single condition only: free them"));
            }
            limits.push(Limit { number, low, high });
        }
    }
    let effects = model.effects.iter().map(|e| e.effect.clone()).collect();
    Ok(Structure { effects, zero_unknown: model.unknown_zero, limits, ..Structure::default() })
}

fn range(entry: &ParameterEntry) -> [f64; 2] {
    match (entry.free, entry.value) {
        (false, Some(value)) => [value, value],
        _ => [entry.min, entry.max],
    }
}

/// The limits that the file sets beyond the effect's own.
pub(super) fn limits_of(entry: &EffectEntry) -> Vec<Limit> {
    let effect = entry.effect.clone();
    let mut limits = Vec::new();
    for (index, (parameter, known)) in
        entry.parameters.iter().zip(effect.clone().parameters()).enumerate()
    {
        let [low, high] = range(parameter);
        if (low, high) == (known.min, known.max) {
            continue;
        }
        if let Some(number) = effect.varied_place(index) {
            limits.push(Limit { number: Number::Of(effect.clone(), number), low, high });
        } else if let Some(values) = entry.values() {
            // Size and phase of a line, both fixed, are its cosine and sine part.
            let parts = effect.varied(&values);
            let part = |number| Limit {
                number: Number::Of(effect.clone(), number),
                low: parts[number],
                high: parts[number],
            };
            limits.extend([part(0), part(1)]);
        }
    }
    limits
}
