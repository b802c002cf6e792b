//! A release of the model: its record, the model's fit to it, and every number with its error.

use crate::document::{is_own, Model, ParameterEntry};
use crate::model_fit::Recorded;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::Fitted;

/// One number of a release: its name in programs, its unit, its value and standard uncertainty (0: taken as
/// known, NaN: not known).
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    pub name: String,
    pub unit: String,
    pub value: f64,
    pub u: f64,
}

/// A record of the model with the model's fit to it: its own initial state and the numbers that belong to it.
pub struct Release {
    pub recorded: Recorded,
    pub fit: Fitted,
    pub numbers: Vec<Number>,
}

/// The numbers of a release, in the order in which programs have them.
pub fn numbers(model: &Model, recorded: &Recorded, fit: &Fitted) -> Vec<Number> {
    let number = |name: &str, unit: &str, value: f64, u: f64| Number {
        name: name.to_owned(),
        unit: unit.to_owned(),
        value,
        u,
    };
    // Of the file, where it has a value; else, and what belongs to a release, as fitted to this record.
    let known = |entry: Option<&ParameterEntry>, value: f64, u: f64| match entry {
        Some(ParameterEntry { value: Some(value), u, free, .. }) => {
            (*value, u.unwrap_or(if *free { f64::NAN } else { 0.0 }))
        }
        _ => (value, u),
    };
    let modal = model.modal.get(&recorded.entry.condition);
    let (wn, zeta) = (fit.natural_frequency_rad_s(), fit.damping_ratio());
    let wn = known(modal.map(|m| &m.natural_frequency_rad_s), wn.value, wn.u);
    let zeta = known(modal.map(|m| &m.damping_ratio), zeta.value, zeta.u);
    let zero = fit.sensor_zero_rad().map_or((0.0, 0.0), |q| (q.value, q.u));
    let mut all = vec![
        number("wn", "rad/s", wn.0, wn.1),
        number("zeta", "1", zeta.0, zeta.1),
        number("wind", "m/s", recorded.decay.wind_speed_m_s, 0.0),
        number("zero_rad", "rad", zero.0, zero.1),
    ];
    let mut found = fit.effect_parameters().into_iter();
    for entry in &model.effects {
        let parameters = entry.effect.parameters().iter().zip(&entry.parameters);
        for (index, (parameter, in_file)) in parameters.enumerate() {
            let Some((_, q)) = found.next() else { break };
            let in_file = (!is_own(&entry.effect, index)).then_some(in_file);
            let (value, u) = known(in_file, q.value, q.u);
            all.push(number(&code_name(&entry.effect, &parameter.name), &parameter.unit, value, u));
        }
    }
    all
}

/// What a parameter is called in programs.
pub fn code_name(effect: &Effect, parameter: &str) -> String {
    format!("{effect}_{parameter}")
}
