//! Steps that fit nothing: an effect rejected, an earlier model taken up again.

use crate::document::how_to_name;
use crate::journal::{path_of, Action, JournalStep};
use crate::revise::{opened, RevisionRequest};
use crate::store::Store;
use std::path::Path;
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::Effect;

/// Writes down that `effect` was considered and is not to be added, with the reason; the model stays as it
/// is.
///
/// # Errors
/// Exit 2 where the effect is in the model, 3 where there is no model, or the files cannot be written.
pub fn reject(path: &Path, effect: Effect, asked: &RevisionRequest) -> Result<JournalStep> {
    let (store, model) = opened(path)?;
    if model.effect(effect.clone()).is_some() {
        return Err(Error::usage(format!("{effect} is in the model"))
            .help(format!("take it out: yawrig remove {effect}")));
    }
    let last = store.journal().last().filter(|_| !store.is_edited());
    let standing = last.and_then(|last| last.after);
    // As it stands: what was edited is still not of a fit.
    let text = match store.text() {
        Some(text) => text.to_owned(),
        None => model.text(None)?,
    };
    let mut step = JournalStep {
        rejected: Some(effect.id().into()),
        why: asked.why.clone(),
        before: standing,
        after: standing,
        parameters: last.map(|last| last.parameters.clone()).unwrap_or_default(),
        modal: last.map(|last| last.modal.clone()).unwrap_or_default(),
        ..JournalStep::now(Action::Reject, &asked.command, text)
    };
    step.step = store.commit(step.clone())?;
    Ok(step)
}

/// Puts the model of step `number` in the file, as a new step.
///
/// # Errors
/// Exit 2 where there is no such step, 3 where the files cannot be written.
pub fn return_to(path: &Path, number: usize, asked: &RevisionRequest) -> Result<JournalStep> {
    if !disk::exists(&path_of(path)) {
        return Err(Error::data(format!("{} has no journal", path.display())).help(how_to_name()));
    }
    let store = Store::open(path)?;
    let to = store.journal().step(number)?.clone();
    let mut step = JournalStep {
        returned_to: Some(number),
        why: asked.why.clone(),
        before: store.journal().last().and_then(|last| last.after).filter(|_| !store.is_edited()),
        after: to.after,
        parameters: to.parameters,
        modal: to.modal,
        ..JournalStep::now(Action::Return, &asked.command, to.model)
    };
    step.step = store.commit(step.clone())?;
    Ok(step)
}
