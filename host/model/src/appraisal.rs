//! How far a model is from its records, and where.

use crate::document::{is_own, Model};
use crate::edits;
use crate::journal::Residuals;
use crate::limits;
use crate::model_fit::{combined, held_against, later_part, modal_of, Data, Recorded};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_core::diagnosis::compare::{self, Where};
use yawrig_core::diagnosis::diagnose::Modal;
use yawrig_core::effects::Effect;
use yawrig_core::fit::at_amplitude::{at_amplitudes, AtAmplitude};
use yawrig_core::fit::fitting::{Covariance, Fitted};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::identify::WindowEstimate;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Said;

/// A model against its records. Rms in deg, ratios to the noise floor of block means.
#[derive(Clone, Debug, Serialize)]
pub struct Appraisal {
    /// What the records hold, where that is no angle in deg.
    #[serde(flatten)]
    pub said: Said,
    pub noise_rms_deg: f64,
    /// Under the condition of the first record.
    pub modal: Modal,
    /// Of the first record, from its largest amplitude to its smallest.
    pub at_amplitude: Vec<AtAmplitude>,
    /// Of the numbers of the first record's model, where they were fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// Every effect of the model, in the order in which they were added.
    pub effects: Vec<Effect>,
    #[serde(flatten)]
    pub residuals: Residuals,
    /// Of the effects those whose ± is half of the number: what the model lacks might stand in for them, but
    /// without them it predicts worse.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub needed_by_prediction: Vec<Effect>,
    /// `effect.name`, in the effect's unit.
    pub parameters: BTreeMap<String, Quantity>,
    pub conditions: Vec<Condition>,
    pub records: Vec<RecordAppraisal>,
    /// wn and zeta over three cycles each, of the record of `where`.
    pub windows: Vec<WindowEstimate>,
    /// Of the record with the largest residual over noise.
    #[serde(rename = "where")]
    pub where_: Where,
    pub where_file: String,
    /// What the model's numbers are not of: records that have changed since, values that were edited.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stale: Vec<String>,
}

#[derive(Clone, Debug, Serialize)]
pub struct Condition {
    pub condition: String,
    #[serde(flatten)]
    pub modal: Modal,
}

/// One record, whether fitted or held out.
#[derive(Clone, Debug, Serialize)]
pub struct RecordAppraisal {
    pub file: String,
    pub condition: String,
    pub held_out: bool,
    pub noise_rms_deg: f64,
    pub residual_rms_deg: f64,
    pub residual_over_noise: f64,
    /// Where there are several records.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub at_amplitude: Vec<AtAmplitude>,
    /// Numbers of effects that belong to this record, where there are several.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Quantity>,
}

/// Gathers what is known: `fits` of `recorded`, of which those up to `fitted` make up the model's residual.
/// Values that `model` holds are shown in place of fitted ones.
pub fn appraise(
    model: &Model,
    recorded: &[&Recorded],
    fits: &[Fitted],
    fitted: usize,
    residual_over_noise: f64,
    held_out_over_noise: f64,
) -> Appraisal {
    let decay = |k: usize| &recorded[k].decay;
    let raw = |k: usize| decay(k).raw_rms_deg(fits[k].rms_rad());
    let (n, sum) = fits[..fitted].iter().enumerate().fold((0.0, 0.0), |(n, sum), (k, fit)| {
        (n + fit.count as f64, sum + fit.count as f64 * raw(k).powi(2))
    });
    let residuals = Residuals {
        residual_rms_deg: f64::sqrt(sum / n),
        residual_over_noise,
        held_out_over_noise,
    };
    let mut conditions: Vec<Condition> = Vec::new();
    for (recorded, fit) in recorded.iter().zip(fits) {
        let condition = &recorded.entry.condition;
        if !conditions.iter().any(|c| c.condition == *condition) {
            let modal = modal(model, condition, fit);
            conditions.push(Condition { condition: condition.clone(), modal });
        }
    }
    let many = fitted > 1;
    let records = (0..fits.len())
        .map(|k| RecordAppraisal {
            file: recorded[k].path.display().to_string(),
            condition: recorded[k].entry.condition.clone(),
            held_out: k >= fitted || recorded[k].entry.held_out,
            noise_rms_deg: decay(k).measurand.shown(decay(k).sample_noise_rad),
            residual_rms_deg: raw(k),
            residual_over_noise: fits[k].over_noise(decay(k)),
            at_amplitude: match many {
                true => at_amplitudes(decay(k), &known(model, recorded[k], &fits[k])),
                false => Vec::new(),
            },
            parameters: if many { parameters(model, &fits[k], |own| own) } else { BTreeMap::new() },
        })
        .collect();
    let over = |k: &usize| fits[*k].over_noise(decay(*k));
    let worst = (0..fitted).max_by(|a, b| over(a).total_cmp(&over(b))).expect("a fitted record");
    let worst_swing: &FreeDecay = decay(worst);
    Appraisal {
        said: decay(0).measurand.said(),
        noise_rms_deg: decay(0).measurand.shown(decay(0).sample_noise_rad),
        modal: conditions[0].modal,
        at_amplitude: at_amplitudes(decay(0), &known(model, recorded[0], &fits[0])),
        covariance: fits[0].named_covariance(),
        effects: model.effects.iter().map(|e| e.effect.clone()).collect(),
        residuals,
        needed_by_prediction: fits[0].needed.clone(),
        parameters: parameters(model, &fits[0], |own| !(own && many)),
        conditions,
        records,
        windows: worst_swing.windows.clone(),
        where_: compare::locate(worst_swing, &fits[worst]),
        where_file: recorded[worst].path.display().to_string(),
        stale: recorded
            .iter()
            .filter_map(|r| r.changed.clone())
            .chain(edits::said(model))
            .collect(),
    }
}

/// `fit` with the uncertainties that `model` holds of numbers that it was not free to change.
pub fn known(model: &Model, recorded: &Recorded, fit: &Fitted) -> Fitted {
    let modal = model.modal.get(&recorded.entry.condition).copied().unwrap_or_default();
    let mut u = vec![0.0; fit.parameters.len()];
    u[0] = modal.natural_frequency_rad_s.u.unwrap_or(0.0);
    u[1] = modal.damping_ratio.u.unwrap_or(0.0);
    let mut at = fit.structure.own_numbers();
    for entry in &model.effects {
        for (index, parameter) in entry.parameters.iter().enumerate() {
            if let Some(place) = entry.effect.varied_place(index).filter(|p| at + p < u.len()) {
                u[at + place] = parameter.u.unwrap_or(0.0);
            }
        }
        at += entry.parameters.len();
    }
    fit.clone().knowing(&u)
}

/// As the model has them, else as fitted.
fn modal(model: &Model, condition: &str, fit: &Fitted) -> Modal {
    let known = model.modal.get(condition).and_then(modal_of);
    let [natural_frequency_rad_s, damping_ratio] =
        known.unwrap_or_else(|| [fit.natural_frequency_rad_s(), fit.damping_ratio()]);
    Modal { natural_frequency_rad_s, damping_ratio }
}

fn parameters(
    model: &Model,
    fit: &Fitted,
    chosen: impl Fn(bool) -> bool,
) -> BTreeMap<String, Quantity> {
    let mut found = fit.effect_parameters().into_iter();
    let mut out = BTreeMap::new();
    for entry in &model.effects {
        for (index, parameter) in entry.parameters.iter().enumerate() {
            let Some((name, fitted)) = found.next() else { break };
            if chosen(is_own(&entry.effect, index)) {
                let known = parameter.value.map(|v| Quantity::new(v, parameter.u.unwrap_or(0.0)));
                out.insert(name, known.unwrap_or(fitted));
            }
        }
    }
    out
}

/// A model as it is against its own records.
pub(super) fn as_it_is(model: &Model, data: &Data) -> Result<Appraisal> {
    let recorded: Vec<&Recorded> = data.fitted.iter().chain(&data.held_out).collect();
    let against = |r: &&Recorded| held_against(model, r, 1.0);
    let fits: Vec<Fitted> = recorded.par_iter().map(against).collect::<Result<_>>()?;
    interrupt::check()?;
    let n = data.fitted.len();
    let over_noise = combined(&fits[..n], &recorded[..n]);
    let held_out = if data.held_out.is_empty() {
        later_part(data, &limits::structure(model)?, &fits)?
    } else {
        combined(&fits[n..], &recorded[n..])
    };
    Ok(appraise(model, &recorded, &fits, n, over_noise, held_out))
}
