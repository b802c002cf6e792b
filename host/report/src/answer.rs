//! What is to be taken from a release: the model that its diagnosis ends with.

use super::{EffectFound, ParameterRow};
use serde::{Deserialize, Serialize};
use yawrig_core::diagnosis::diagnose::Status;
use yawrig_core::fit::fitting::{Fitted, Modal};
use yawrig_core::quantity::Quantity;

/// What a model with its effects says of a release.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// `second order + coulomb_friction`.
    pub model: String,
    /// At rest: what oscillations too small for the effects would show.
    pub natural_frequency_rad_s: Quantity,
    pub damping_ratio: Quantity,
    /// As `coulomb_friction.c`.
    pub parameters: Vec<ParameterRow>,
    pub residual_over_noise: f64,
}

impl Answer {
    /// Of `model` with `effects`.
    pub(super) fn new(
        model: &str,
        modal: &Modal,
        effects: &[EffectFound],
        over_noise: f64,
    ) -> Self {
        let named = |e: &EffectFound| {
            let of = |p: &ParameterRow| ParameterRow {
                name: format!("{}.{}", e.id, p.name),
                ..p.clone()
            };
            e.parameters.iter().map(of).collect::<Vec<_>>()
        };
        Self {
            model: model.to_owned(),
            natural_frequency_rad_s: modal.natural_frequency_rad_s,
            damping_ratio: modal.damping_ratio,
            parameters: effects.iter().flat_map(named).collect(),
            residual_over_noise: over_noise,
        }
    }

    /// Every number with its name and unit.
    pub(super) fn rows(&self) -> Vec<(String, Quantity, String)> {
        let modal = [
            ("natural frequency wn", self.natural_frequency_rad_s, "rad/s"),
            ("damping ratio zeta", self.damping_ratio, ""),
        ];
        let modal = modal.map(|(name, q, unit)| (name.to_owned(), q, unit.to_owned()));
        let others = self.parameters.iter().map(|p| {
            let unit = if p.unit == "1" { String::new() } else { p.unit.clone() };
            (p.name.clone(), Quantity::new(p.value, p.u.unwrap_or(f64::NAN)), unit)
        });
        modal.into_iter().chain(others).collect()
    }
}

/// Whether a diagnosis refuses a second-order model of a release, by its status, whether this release is
/// `explained` all the same, and the model that it ends with.
pub(super) fn refuses(status: Status, explained: bool, last: &Fitted) -> bool {
    !last.structure.effects.is_empty() || status != Status::Adequate && !explained
}

/// What a row of a table says of an estimate that is refused.
pub(super) const NOT_VALID: &str = "not valid";
