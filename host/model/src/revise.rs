//! The steps of the loop: fit, add, remove, return; and the comparison that shows what they did.

mod fit;
mod step;

use crate::adding;
use crate::document::{EffectEntry, Model};
use crate::journal::{Action, JournalStep};
use crate::model_fit::Data;
use crate::sources;
pub(crate) use fit::opened;
pub use fit::{fit, fit_to, fit_with_models, Wanted};
use std::path::Path;
use step::finish;
pub(crate) use step::{Change, Current};
pub use step::{Revision, RevisionRequest};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_core::effects::{Effect, SourceKind, MAX_OWN};
use yawrig_text::nearest;

/// A word of a command line.
pub fn quoted(word: &str) -> String {
    match word.contains(|c: char| c.is_whitespace() || c == '"') {
        true => format!("{word:?}"),
        false => word.to_owned(),
    }
}

/// Why `effect` cannot be added to `model`.
///
/// # Errors
/// Exit 2 with the reason.
pub fn check_addable(model: &Model, effect: Effect) -> Result<()> {
    if effect.is_random() {
        return Err(Error::usage(format!("{effect} is random and cannot be simulated"))
            .help("run `yawrig diagnose`, which judges it by a filter"));
    }
    if model.unknown_zero && effect.moves_rest() {
        return Err(Error::usage(format!(
            "{effect} cannot be distinguished from the sensor's unknown zero"
        ))
        .help("leave one of the two out"));
    }
    if model.effect(effect.clone()).is_some() {
        return Err(Error::usage(format!("{effect}: it is in the model already"))
            .help("name each effect once"));
    }
    let own = |e: &&Effect| e.is_own();
    if own(&&effect) && model.effects.iter().map(|e| &e.effect).filter(own).count() >= MAX_OWN {
        return Err(Error::usage(format!("the model has {MAX_OWN} effects of your own"))
            .help("take one out first: yawrig remove ID"));
    }
    Ok(())
}

/// Adds `effect` to the model at `path`.
///
/// # Errors
/// Exit 2 where it is in the model already or cannot be simulated; else as [`fit`].
pub fn add(path: &Path, effect: Effect, asked: &RevisionRequest) -> Result<Revision> {
    add_from(path, effect, None, asked)
}

/// As [`add`], from this source; without one, from that with which it predicts best what was held out, the
/// rig unless another is better by a share that counts.
///
/// # Errors
/// As [`add`]; exit 2 where the model's records do not tell of the wind, or the air cannot make it.
pub fn add_from(
    path: &Path,
    effect: Effect,
    source: Option<SourceKind>,
    asked: &RevisionRequest,
) -> Result<Revision> {
    let check = |model: &Model| check_addable(model, effect.clone());
    add_by(path, asked, check, |inner, data| {
        let speeds = inner.model.wind_speeds();
        if let Some(source) = source {
            let effect = sources::sourced(&effect, source, &speeds)?;
            return Ok((effect.clone(), added(inner, data, effect)?));
        }
        let mut best = added(inner, data, effect.clone());
        let mut from = effect.clone();
        for (other, sourced) in others(&effect, SourceKind::Mechanical, &speeds) {
            // One that cannot be fitted is not the one.
            let Ok(found) = added(inner, data, sourced.clone()) else { continue };
            if best.as_ref().map_or(true, |best| best.predicts_worse_than(&found)) {
                yawrig_base::say!(
                    "{effect} from the source \"{}\": it predicts better",
                    other.name()
                );
                (best, from) = (Ok(found), sourced);
            }
        }
        interrupt::check()?;
        Ok((from, best?))
    })
}

/// `effect` from each source but one, as far as it may be, in a model of records at several of these wind
/// speeds.
fn others<'a>(
    effect: &'a Effect,
    but: SourceKind,
    speeds_m_s: &'a [f64],
) -> impl Iterator<Item = (SourceKind, Effect)> + 'a {
    let others = SourceKind::ALL.into_iter().filter(move |s| *s != but && speeds_m_s.len() > 1);
    others.filter_map(|s| Some((s, sources::sourced(effect.bare(), s, speeds_m_s).ok()?)))
}

/// Adds the effect that `adding` finds beside a fitted model to the one at `path`, where `check` allows it.
pub(super) fn add_by(
    path: &Path,
    asked: &RevisionRequest,
    check: impl FnOnce(&Model) -> Result<()>,
    adding: impl FnOnce(&Current, &Data) -> Result<(Effect, Current)>,
) -> Result<Revision> {
    let (store, model) = opened(path)?;
    check(&model)?;
    let data = Data::new(&model, path)?;
    let inner = Current::fitted(&model, &data)?;
    let (effect, outer) = adding(&inner, &data)?;
    data.check_seen(&effect)?;
    if outer.predicts_worse_than(&inner) {
        worse(&inner, &outer, &data, &effect, asked)?;
    }
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
            evidence: Some(outer.fit.bic().gain_over(&inner.fit.bic())),
            ..Change::to(&outer, &data)?
        },
    )
}

/// Says that `effect` makes the prediction of what was held out worse, and what would not.
///
/// # Errors
/// Exit 6 where it is not to be kept all the same.
fn worse(
    inner: &Current,
    outer: &Current,
    data: &Data,
    effect: &Effect,
    asked: &RevisionRequest,
) -> Result<()> {
    let what = format!(
        "with {effect} what was held out is predicted worse: {:.3} -> {:.3} times the noise",
        inner.held_out_over_noise(),
        outer.held_out_over_noise()
    );
    if asked.keep {
        yawrig_base::warn!("{what}");
        return Ok(());
    }
    let mut help = format!("to add it all the same: {}", settings::given("keep", ""));
    let speeds = inner.model.wind_speeds();
    for (source, other) in others(effect, effect.source().kind(), &speeds) {
        // What cannot be fitted is no advice.
        let Ok(other) = added(inner, data, other) else { continue };
        if !other.predicts_worse_than(inner) {
            let command = settings::command("add", &[effect.id()], &[(source.name(), "")]);
            let held_out = other.held_out_over_noise();
            help = format!("{held_out:.3} times with `{command}`; {help}");
        }
    }
    interrupt::check()?;
    Err(Error::new(Exit::Quality, format!("{what}; nothing is changed")).help(help))
}

pub(super) fn added(inner: &Current, data: &Data, effect: Effect) -> Result<Current> {
    tried(inner, data, effect)?.settled()
}

/// `inner` with `effect`, though the fit may not have converged: with another effect it may.
pub(super) fn tried(inner: &Current, data: &Data, effect: Effect) -> Result<Current> {
    let mut model = inner.model.clone();
    model.effects.push(EffectEntry::unfitted(effect.clone()));
    let fit = adding::add(data, &inner.fit, effect)?;
    Current::found(&model, data, fit)
}

/// Takes the effect `id` out of the model at `path`.
///
/// # Errors
/// Exit 2 where it is not in the model; else as [`fit`].
pub fn remove(path: &Path, id: &str, asked: &RevisionRequest) -> Result<Revision> {
    let (store, model) = opened(path)?;
    let Some(effect) = model.effects.iter().map(|e| e.effect.clone()).find(|e| e.id() == id) else {
        let ids = || model.effects.iter().map(|e| e.effect.id());
        let help = match (nearest(id, ids()), ids().count()) {
            (_, 0) => "the model has no effects".to_owned(),
            (Some(id), _) => format!("did you mean {id}?"),
            _ => format!("its effects: {}", ids().collect::<Vec<_>>().join(", ")),
        };
        return Err(Error::usage(format!("{id} is not in {}", path.display())).help(help));
    };
    let data = Data::new(&model, path)?;
    let outer = Current::fitted(&model, &data)?;
    let mut smaller = outer.model.clone();
    smaller.effects.retain(|e| e.effect != effect);
    let inner = Current::fitted(&smaller, &data)?;
    let step = JournalStep {
        removed: Some(effect.id().into()),
        ..JournalStep::now(Action::Remove, "", String::new())
    };
    finish(
        store,
        asked,
        step,
        Change {
            removed: Some(effect),
            before: Some(outer.appraisal(&data)?.residuals),
            evidence: Some(outer.fit.bic().gain_over(&inner.fit.bic())),
            ..Change::to(&inner, &data)?
        },
    )
}
