//! The steps of the loop: fit, add, remove, return; and the comparison that shows what they did.

use crate::adding;
use crate::appraisal::{appraise, as_it_is, Appraisal, Condition};
use crate::document::{read_text, EffectEntry, Model, RecordEntry};
use crate::journal::{path_of, Action, JournalStep, Known, KnownModal, Residuals};
use crate::model_fit::{self, held_against, Data, Recorded};
use crate::records;
use crate::store::Store;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_core::effects::{Effect, MOST_OWN};
use yawrig_core::fit::fitting::{Covariance, Fitted};
use yawrig_core::fit::joint::JointFit;
use yawrig_records::Selection;
use yawrig_text::nearest;

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
}

/// A word of a command line.
pub fn quoted(word: &str) -> String {
    match word.contains(|c: char| c.is_whitespace() || c == '"') {
        true => format!("{word:?}"),
        false => word.to_owned(),
    }
}

/// A model fitted to its records.
pub(super) struct Current {
    pub model: Model,
    pub fit: JointFit,
    held_out_over_noise: f64,
}

impl Current {
    fn of(model: &Model, data: &Data, fit: JointFit) -> Result<Self> {
        Self::found(model, data, fit)?.settled()
    }

    /// Refused where the fit has not converged.
    pub fn settled(self) -> Result<Self> {
        match self.fit.converged {
            true => Ok(self),
            false => Err(not_converged(&self.model)),
        }
    }

    fn found(model: &Model, data: &Data, fit: JointFit) -> Result<Self> {
        if !fit.sum_of_squares.is_finite() {
            return Err(not_converged(model));
        }
        let fit = fit.with_discrepancy(&data.releases());
        let model = model_fit::updated(model, data, &fit);
        let held_out_over_noise = model_fit::held_out(&model, data, &fit)?;
        Ok(Self { model, fit, held_out_over_noise })
    }

    pub fn fitted(model: &Model, data: &Data) -> Result<Self> {
        Self::of(model, data, model_fit::fit(model, data)?)
    }

    /// Of each record, those held out behind those fitted.
    fn fits(&self, data: &Data) -> Result<Vec<Fitted>> {
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

/// Which records a new model is about, or which are held out of one that is there.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// Records and campaigns.
    pub files: Vec<PathBuf>,
    /// How they are read, where their files do not say it.
    pub reading: Selection,
    pub hold_out: Vec<PathBuf>,
    pub unknown_zero: bool,
}

/// Makes the model at `path` of `wanted` where there is none, and fits it.
///
/// # Errors
/// Exit 2 or 3 where there is nothing to fit or the model is about other records, 6 where the fit does not
/// converge, 130 where the user stops it; the model is then as it was.
pub fn fit(path: &Path, wanted: &Wanted, asked: &RevisionRequest) -> Result<Revision> {
    Ok(fit_wanted(path, wanted, asked)?.0)
}

/// As [`fit`], with the records and the model of each, those held out behind those fitted.
///
/// # Errors
/// As [`fit`].
pub fn fit_with_models(
    path: &Path,
    wanted: &Wanted,
    asked: &RevisionRequest,
) -> Result<(Revision, Vec<(Recorded, Fitted)>)> {
    let (revision, current, data) = fit_wanted(path, wanted, asked)?;
    let fits = current.fits(&data)?;
    let recorded = data.fitted.into_iter().chain(data.held_out);
    Ok((revision, recorded.zip(fits).collect()))
}

fn fit_wanted(
    path: &Path,
    wanted: &Wanted,
    asked: &RevisionRequest,
) -> Result<(Revision, Current, Data)> {
    let store = Store::open(path)?;
    let old = store.model()?;
    let model = match &old {
        Some(model) => {
            check_same(model, path, &wanted.files)?;
            model.clone()
        }
        None => begun(&store, wanted)?,
    };
    let model = with_held_out(model, path, wanted)?;
    fit_in(store, old, &model, asked)
}

/// Fits the model at `path`, made where there is none, to these records: its effects stay, whatever its
/// records were before.
///
/// # Errors
/// As [`fit`].
pub fn fit_to(
    path: &Path,
    records: Vec<RecordEntry>,
    unknown_zero: bool,
    asked: &RevisionRequest,
) -> Result<Revision> {
    let store = Store::open(path)?;
    let old = store.model()?;
    let begun = || Model { unknown_zero, ..Model::default() };
    let model = Model { records, ..old.clone().unwrap_or_else(begun) };
    let model = with_held_out(model, path, &Wanted::default())?;
    Ok(fit_in(store, old, &model, asked)?.0)
}

fn fit_in(
    store: Store,
    old: Option<Model>,
    model: &Model,
    asked: &RevisionRequest,
) -> Result<(Revision, Current, Data)> {
    let data = Data::of(model, store.path())?;
    let before = match &old {
        Some(old) => as_it_is(old, &data).ok().map(|a| a.residuals),
        None => None,
    };
    interrupt::check()?;
    let current = Current::fitted(&data.seen(model.clone()), &data)?;
    let step = JournalStep::now(Action::Fit, "", String::new());
    let change = Change { before, ..Change::to(&current, &data)? };
    Ok((finish(store, asked, step, change)?, current, data))
}

fn begun(store: &Store, wanted: &Wanted) -> Result<Model> {
    let path = store.path();
    if wanted.files.is_empty() {
        return Err(match store.journal().last() {
            Some(last) => Error::data(format!(
                "{} is not there, but its journal has {} steps",
                path.display(),
                last.step
            ))
            .help(format!(
                "`{}` brings the last one back",
                settings::command("history", &[], &[("return", &last.step.to_string())])
            )),
            None => Error::usage(format!("there is no model {}", path.display())).help(format!(
                "name the records it is to be made of: {}",
                settings::command("fit", &["RECORD.csv"], &[])
            )),
        });
    }
    let records = records::entries(&wanted.files, &wanted.reading, path)?;
    Ok(Model { unknown_zero: wanted.unknown_zero, records, ..Model::default() })
}

/// Refuses `files` that are not what the model is fitted to.
fn check_same(model: &Model, path: &Path, files: &[PathBuf]) -> Result<()> {
    if files.is_empty() {
        return Ok(());
    }
    let given = records::entries(files, &Selection::default(), path)?;
    let found: Vec<Option<usize>> = given.iter().map(|e| records::find(model, path, e)).collect();
    let all =
        (0..model.records.len()).all(|k| model.records[k].held_out || found.contains(&Some(k)));
    if all && found.iter().all(Option::is_some) {
        return Ok(());
    }
    let names: Vec<&str> = model.records.iter().map(|r| r.file.as_str()).take(3).collect();
    Err(Error::usage(format!(
        "{} is about other records ({}{})",
        path.display(),
        names.join(", "),
        if model.records.len() > 3 { ", ..." } else { "" }
    ))
    .help(format!(
        "make another model with {}; to see this one against a record: {}",
        settings::given("model", "OTHER.toml"),
        settings::command("compare", &["RECORD.csv"], &[])
    )))
}

fn with_held_out(mut model: Model, path: &Path, wanted: &Wanted) -> Result<Model> {
    for entry in records::entries(&wanted.hold_out, &wanted.reading, path)? {
        match records::find(&model, path, &entry) {
            Some(k) => model.records[k].held_out = true,
            None => model.records.push(RecordEntry { held_out: true, ..entry }),
        }
    }
    if wanted.unknown_zero && !model.unknown_zero {
        if let Some(EffectEntry { effect, .. }) = model.rest() {
            return Err(Error::usage(format!("{} beside {effect} in the model", settings::name("unknown_zero"))).help(format!(
                "a constant moment cannot be distinguished from the sensor's zero: yawrig remove {effect}"
            )));
        }
        model.unknown_zero = true;
    }
    // Conditions of records that are no longer fitted are no longer known.
    let fitted = |c: &String| model.records.iter().any(|r| !r.held_out && r.condition == *c);
    let known = model.modal.into_iter().filter(|(c, _)| fitted(c)).collect();
    model.modal = known;
    Ok(model)
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
    if own(&&effect) && model.effects.iter().map(|e| &e.effect).filter(own).count() >= MOST_OWN {
        return Err(Error::usage(format!("the model has {MOST_OWN} effects of your own"))
            .help("take one out first: yawrig remove ID"));
    }
    Ok(())
}

/// Adds `effect` to the model at `path`.
///
/// # Errors
/// Exit 2 where it is in the model already or cannot be simulated; else as [`fit`].
pub fn add(path: &Path, effect: Effect, asked: &RevisionRequest) -> Result<Revision> {
    let check = |model: &Model| check_addable(model, effect.clone());
    add_by(path, asked, check, |inner, data| {
        Ok((effect.clone(), added(inner, data, effect.clone())?))
    })
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
    let data = Data::of(&model, path)?;
    let inner = Current::fitted(&model, &data)?;
    let (effect, outer) = adding(&inner, &data)?;
    data.check_seen(&effect)?;
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
    let data = Data::of(&model, path)?;
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

/// The model at `path`, which must be there.
pub(super) fn opened(path: &Path) -> Result<(Store, Model)> {
    if !path.exists() && !path_of(path).exists() {
        // Refused before a journal is made.
        read_text(path)?;
    }
    let store = Store::open(path)?;
    let model = match store.model()? {
        Some(model) => model,
        None => begun(&store, &Wanted::default())?,
    };
    Ok((store, model))
}

/// What a step changes.
pub(super) struct Change {
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
fn finish(
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
