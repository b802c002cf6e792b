//! The first step: a model of records, or that which is there fitted again.

use super::step::{finish, Change, Current, Revision, RevisionRequest};
use crate::appraisal::as_it_is;
use crate::document::{read_text, EffectEntry, Model, RecordEntry};
use crate::journal::{path_of, Action, JournalStep};
use crate::model_fit::{Data, Recorded};
use crate::records;
use crate::store::Store;
use std::path::{Path, PathBuf};
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_core::fit::fitting::Fitted;
use yawrig_records::Selection;

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
    let data = Data::new(model, store.path())?;
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

/// The model at `path`, which must be there.
pub(crate) fn opened(path: &Path) -> Result<(Store, Model)> {
    if !disk::exists(path) && !disk::exists(&path_of(path)) {
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
