//! A step of the loop: the model before and after it, and what is said of both.

use crate::appraisal::{appraise, Appraisal, Condition};
use crate::document::Model;
use crate::journal::{JournalStep, Known, KnownModal, Residuals};
use crate::model_fit::{self, held_against, Data, Recorded};
use crate::store::Store;
use serde::Serialize;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_core::diagnosis::diagnose::MIN_GAIN;
use yawrig_core::diagnosis::unknown::told;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{Covariance, Fitted};
use yawrig_core::fit::joint::JointFit;

/// A step that has been taken, and the model after it.
#[derive(Clone, Debug, Serialize)]
pub struct Revision {
    /// Its number in the journal.
    pub step: Option<usize>,
    pub added: Option<Effect>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub removed: Option<Effect>,
    /// Of the model before.
    pub before: Option<Residuals>,
    /// Difference of the information criterion between the model with `added` or `removed` and that without.
    pub evidence: Option<f64>,
    #[serde(flatten)]
    pub appraisal: Appraisal,
}

/// The request for a step, as the journal keeps it.
#[derive(Clone, Debug, Default)]
pub struct RevisionRequest {
    /// The command as it was typed.
    pub command: String,
    pub why: Option<String>,
    /// An effect stays though what is held out is predicted worse with it.
    pub keep: bool,
}

/// A model fitted to its records.
pub(crate) struct Current {
    pub model: Model,
    pub fit: JointFit,
    held_out_over_noise: f64,
}

impl Current {
    fn new(model: &Model, data: &Data, fit: JointFit) -> Result<Self> {
        Self::found(model, data, fit)?.settled()
    }

    /// Whether it predicts what was held out worse than `inner`, by more than a share that counts.
    pub(super) fn predicts_worse_than(&self, inner: &Self) -> bool {
        let most = (1.0 + MIN_GAIN) * inner.held_out_over_noise;
        self.held_out_over_noise.is_nan() || self.held_out_over_noise > most
    }

    pub(super) fn held_out_over_noise(&self) -> f64 {
        self.held_out_over_noise
    }

    /// Refused where the fit has not converged.
    pub fn settled(self) -> Result<Self> {
        match self.fit.converged {
            true => Ok(self),
            false => Err(not_converged(&self.model)),
        }
    }

    pub(super) fn found(model: &Model, data: &Data, fit: JointFit) -> Result<Self> {
        if !fit.sum_of_squares.is_finite() {
            return Err(not_converged(model));
        }
        let mut fit = fit.with_discrepancy(&data.releases());
        if let ([only], [recorded]) = (&mut fit.fits[..], &data.fitted[..]) {
            *only = told(&recorded.decay, only.clone());
        }
        let model = model_fit::updated(model, data, &fit);
        let held_out_over_noise = model_fit::held_out(&model, data, &fit)?;
        Ok(Self { model, fit, held_out_over_noise })
    }

    pub fn fitted(model: &Model, data: &Data) -> Result<Self> {
        Self::new(model, data, model_fit::fit(model, data)?)
    }

    /// Of each record, those held out behind those fitted.
    pub(super) fn fits(&self, data: &Data) -> Result<Vec<Fitted>> {
        let mut fits = self.fit.fits.clone();
        for held_out in &data.held_out {
            fits.push(held_against(&self.model, held_out, 1.0)?);
        }
        Ok(fits)
    }

    pub fn appraisal(&self, data: &Data) -> Result<Appraisal> {
        let recorded: Vec<&Recorded> = data.fitted.iter().chain(&data.held_out).collect();
        let fits = self.fits(data)?;
        let fitted = data.fitted.len();
        let over_noise = self.fit.over_noise();
        let held_out = self.held_out_over_noise;
        let found = appraise(&self.model, &recorded, &fits, fitted, over_noise, held_out);
        // It has just been fitted to these.
        Ok(Appraisal { stale: Vec::new(), ..found })
    }
}

fn not_converged(model: &Model) -> Error {
    let names: Vec<&str> = model.effects.iter().map(|e| e.effect.id()).collect();
    let with = if names.is_empty() { "no effects".to_owned() } else { names.join(", ") };
    Error::new(Exit::Quality, format!("the fit with {with} did not converge; nothing is changed"))
        .help("leave out an effect that the records do not show, or loosen bounds")
}

/// What a step changes.
pub(crate) struct Change {
    pub model: Model,
    pub added: Option<Effect>,
    pub removed: Option<Effect>,
    pub before: Option<Residuals>,
    pub evidence: Option<f64>,
    pub appraisal: Appraisal,
}

impl Change {
    pub fn to(current: &Current, data: &Data) -> Result<Self> {
        Ok(Self {
            model: current.model.clone(),
            added: None,
            removed: None,
            before: None,
            evidence: None,
            appraisal: current.appraisal(data)?,
        })
    }

    pub fn into_revision(self, step: Option<usize>) -> Revision {
        Revision {
            step,
            added: self.added,
            removed: self.removed,
            before: self.before,
            evidence: self.evidence,
            appraisal: self.appraisal,
        }
    }
}

/// Writes the step to model and journal.
pub(super) fn finish(
    store: Store,
    asked: &RevisionRequest,
    step: JournalStep,
    change: Change,
) -> Result<Revision> {
    interrupt::check()?;
    let appraisal = &change.appraisal;
    let known = |c: &Condition| {
        let modal = KnownModal {
            natural_frequency_rad_s: c.modal.natural_frequency_rad_s.into(),
            damping_ratio: c.modal.damping_ratio.into(),
        };
        (c.condition.clone(), modal)
    };
    let step = JournalStep {
        command: asked.command.clone(),
        why: asked.why.clone(),
        before: change.before,
        after: Some(appraisal.residuals),
        parameters: appraisal
            .parameters
            .iter()
            .map(|(n, q)| (n.clone(), Known::from(*q)))
            .collect(),
        modal: appraisal.conditions.iter().map(known).collect(),
        covariance: appraisal.covariance.clone().filter(Covariance::is_finite),
        model: change.model.text(store.text())?,
        ..step
    };
    let number = store.commit(step)?;
    Ok(change.into_revision(Some(number)))
}
