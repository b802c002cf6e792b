//! What the criticism loop has found, as a report has it.

use super::{CandidateRow, EffectFound, ParameterRow, StaircaseStep};
use std::collections::BTreeMap;
use yawrig_core::diagnosis::diagnose::{self, Diagnosis};
use yawrig_core::effects::Effect;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Measurand;

/// The name of the model that a diagnosis begins with.
pub const SECOND_ORDER: &str = "second order";

pub fn steps(steps: &[diagnose::Step], first: &str) -> Vec<StaircaseStep> {
    let step = |s: &diagnose::Step| StaircaseStep {
        name: s.added.as_ref().map_or_else(|| first.to_owned(), |e| format!("+ {e}")),
        residual_rms_deg: s.residual_rms_deg,
        residual_over_noise: s.residual_over_noise,
        held_out_over_noise: s.held_out_over_noise,
    };
    steps.iter().map(step).collect()
}

pub fn candidates(candidates: &[diagnose::Candidate]) -> Vec<CandidateRow> {
    let row = |c: &diagnose::Candidate| CandidateRow {
        effect: c.effect.id().to_owned(),
        residual_over_noise: c.residual_over_noise,
        evidence: c.delta_bic,
        converged: c.converged,
    };
    candidates.iter().map(row).collect()
}

/// `effects` with their numbers, which stand under `effect.name`.
pub fn effects(
    measurand: &Measurand,
    effects: &[Effect],
    values: &BTreeMap<String, Quantity>,
) -> Vec<EffectFound> {
    effects.iter().map(|effect| found(measurand, effect.clone(), values)).collect()
}

fn found(
    measurand: &Measurand,
    effect: Effect,
    values: &BTreeMap<String, Quantity>,
) -> EffectFound {
    let parameters = effect.parameters().iter().filter_map(|p| {
        let quantity = values.get(&format!("{effect}.{}", p.name))?;
        Some(ParameterRow {
            name: p.name.to_string(),
            unit: effect.unit_in(measurand, &p.name),
            value: quantity.value,
            u: Some(quantity.u).filter(|u| u.is_finite() && *u > 0.0),
        })
    });
    let card = effect.card_in(measurand);
    EffectFound {
        id: effect.id().to_owned(),
        title: card.title.to_owned(),
        formula: card.formula.to_owned(),
        parameters: parameters.collect(),
        origin: None,
        cause: card.cause.to_owned(),
        fingerprint: card.fingerprint.to_owned(),
        confirm: card.confirm.to_owned(),
        remove: card.remove.to_owned(),
    }
}

pub fn pairs(pairs: &[[Effect; 2]]) -> Vec<[String; 2]> {
    pairs.iter().map(|pair| pair.each_ref().map(|e| e.id().to_owned())).collect()
}

/// One sentence.
pub fn verdict(d: &Diagnosis) -> String {
    format!("{}.", capital(&d.verdict(diagnose::SECOND_ORDER)))
}

/// With a capital letter.
pub fn capital(text: &str) -> String {
    let (first, rest) = text.split_at(1);
    format!("{}{rest}", first.to_uppercase())
}

/// As in JSON.
pub fn status(status: diagnose::Status) -> String {
    match status {
        diagnose::Status::Adequate => "adequate",
        diagnose::Status::Explained => "explained",
        diagnose::Status::MostlyExplained => "mostly_explained",
        diagnose::Status::Unexplained => "unexplained",
    }
    .to_owned()
}

/// What was held out of a single record.
pub const LATER_PART: &str = "the later part of the record";
