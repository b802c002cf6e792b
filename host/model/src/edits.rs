//! Values edited by hand since they were fitted: the uncertainty beside one is another value's.

use crate::document::{Model, ParameterEntry};
use crate::journal::{Action, JournalStep};
use std::path::Path;

/// `model`, which was read as `text` from `path`, without the uncertainties that by the `steps` of its
/// journal belong to other values.
pub fn seen(mut model: Model, text: &str, path: &Path, steps: &[JournalStep]) -> Model {
    let is_fit = |action: Action| matches!(action, Action::Fit | Action::Add | Action::Remove);
    let fits = || steps.iter().filter(|step| is_fit(step.action));
    if fits().any(|step| step.model == text) {
        return model;
    }
    let mut fits: Vec<Model> =
        fits().filter_map(|step| Model::parse(&step.model, path).ok()).collect();
    let fitted: Vec<(String, ParameterEntry)> = fits
        .iter_mut()
        .flat_map(|fit| numbers(fit).into_iter().map(|(name, entry)| (name, *entry)))
        .collect();
    for (name, entry) in numbers(&mut model) {
        let mut same_u = fitted.iter().filter(|(n, f)| *n == name && f.u == entry.u).peekable();
        let is_of_fits = entry.u.is_some() && same_u.peek().is_some();
        if is_of_fits && same_u.all(|(_, fit)| fit.value != entry.value) {
            entry.u = Some(f64::NAN);
        }
    }
    model
}

/// What to say of the values that were edited.
pub fn said(model: &Model) -> Option<String> {
    let mut model = model.clone();
    let edited: Vec<String> = numbers(&mut model)
        .into_iter()
        .filter(|(_, entry)| entry.u.is_some_and(f64::is_nan))
        .map(|(name, _)| name)
        .collect();
    (!edited.is_empty()).then(|| {
        format!(
            "{} edited since the fit, the uncertainty unknown until `yawrig fit`: {}",
            if edited.len() > 1 { "values were" } else { "a value was" },
            edited.join(", ")
        )
    })
}

/// Says which values of the model at `path` were edited.
pub fn warn(model: &Model, path: &Path) {
    if let Some(said) = said(model) {
        yawrig_base::warn!("{}: {said}", path.display());
    }
}

/// Each number of the model, by a name of its own.
fn numbers(model: &mut Model) -> Vec<(String, &mut ParameterEntry)> {
    let modal = model.modal.iter_mut().flat_map(|(condition, modal)| {
        [
            (format!("natural_frequency_rad_s of {condition}"), &mut modal.natural_frequency_rad_s),
            (format!("damping_ratio of {condition}"), &mut modal.damping_ratio),
        ]
    });
    let effects = model.effects.iter_mut().flat_map(|entry| {
        let effect = entry.effect.clone();
        let names: Vec<String> =
            effect.parameters().iter().map(|p| format!("{effect}.{}", p.name)).collect();
        names.into_iter().zip(&mut entry.parameters)
    });
    modal.chain(effects).collect()
}
