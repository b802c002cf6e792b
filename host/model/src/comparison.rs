//! A model compared with records, its own or others, with effects tried on top of it. Nothing is written.

use crate::appraisal::{appraise, as_it_is, Appraisal};
use crate::document::{Model, RecordEntry, DEFAULT};
use crate::edits;
use crate::model_fit::{combined, held_against, Data, Recorded};
use crate::records;
use crate::revise::{check_addable, tried, Change, Current, Revision};
use rayon::prelude::*;
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_core::bic::MARGIN;
use yawrig_core::diagnosis::diagnose::FITTED_SHARE;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{held_out_over_noise, Fitted};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Record;
use yawrig_records::Selection;

/// A model as it is against other records; the later part of each is held out, the record's own numbers
/// having been fitted to the earlier part.
fn as_it_is_elsewhere(model: &Model, recorded: &[Recorded]) -> Result<Appraisal> {
    let both =
        |r: &Recorded| Ok((held_against(model, r, 1.0)?, held_against(model, r, FITTED_SHARE)?));
    let both: Vec<(Fitted, Fitted)> = recorded.par_iter().map(both).collect::<Result<_>>()?;
    interrupt::check()?;
    let (mut n, mut sum) = (0.0, 0.0);
    for ((_, part), recorded) in both.iter().zip(recorded) {
        let later = (recorded.decay.yaw_rad.len() - part.count) as f64;
        n += later;
        sum += later * held_out_over_noise(&recorded.decay, part).powi(2);
    }
    let fits: Vec<Fitted> = both.into_iter().map(|(whole, _)| whole).collect();
    let recorded: Vec<&Recorded> = recorded.iter().collect();
    let over_noise = combined(&fits, &recorded);
    Ok(appraise(model, &recorded, &fits, fits.len(), over_noise, f64::sqrt(sum / n)))
}

/// What is compared with what.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// The model's file; None for a second-order model.
    pub model: Option<PathBuf>,
    /// Records; none for the model's own.
    pub files: Vec<PathBuf>,
    /// How these are read, where their files do not say it.
    pub reading: Selection,
    /// Effects to be tried on top of the model, all of which is then fitted.
    pub effects: Vec<Effect>,
    pub unknown_zero: bool,
}

/// Compares a model with records. Nothing is written.
///
/// # Errors
/// Exit 2 where an effect cannot be added, 3 where a file cannot be used, 6 where a fit does not converge.
pub fn compare(comparison: &Comparison) -> Result<Revision> {
    let here = PathBuf::from(DEFAULT);
    let path = comparison.model.as_deref().unwrap_or(&here);
    let mut model = match &comparison.model {
        Some(path) => Model::read(path)?,
        None => Model { unknown_zero: comparison.unknown_zero, ..Model::default() },
    };
    let mut entries = Vec::new();
    for file in &comparison.files {
        let entry = records::known_or_new(&model, path, file)?.read_as(&comparison.reading);
        entries.push(RecordEntry { held_out: false, ..entry });
    }
    if comparison.model.is_some() && comparison.effects.is_empty() {
        let appraisal = if entries.is_empty() {
            as_it_is(&model, &Data::new(&model, path)?)
        } else {
            let read = |entry: RecordEntry| {
                let file = Model::record_path(path, &entry);
                Recorded::read(entry, file)
            };
            edits::warn(&model, path);
            let recorded: Vec<Recorded> = entries.into_iter().map(read).collect::<Result<_>>()?;
            as_it_is_elsewhere(&model, &recorded)
        }?;
        return Ok(Revision {
            step: None,
            added: None,
            removed: None,
            before: None,
            evidence: None,
            appraisal,
        });
    }
    if !entries.is_empty() {
        model.modal.retain(|c, _| entries.iter().any(|e| e.condition == *c));
        model.records = entries;
    }
    let data = Data::new(&model, path)?;
    let model = data.seen(model);
    let (change, current) = on_top(&model, &data, &comparison.effects)?;
    if comparison.model.is_none() {
        warn_of_zero(&current, &data);
    }
    Ok(change.into_revision(None))
}

/// What a model was compared with, and how it came out.
pub struct Compared {
    pub revision: Revision,
    pub recorded: Vec<Recorded>,
    pub fits: Vec<Fitted>,
}

/// As [`compare`], of `records` in memory in place of the files.
///
/// # Errors
/// As [`compare`].
pub fn compare_records(comparison: &Comparison, records: Vec<Record>) -> Result<Compared> {
    let data = Data::of_records(records)?;
    let mut model = match &comparison.model {
        Some(path) => Model::read(path)?,
        None => Model { unknown_zero: comparison.unknown_zero, ..Model::default() },
    };
    if comparison.model.is_some() && comparison.effects.is_empty() {
        let fits = data.fitted.iter().map(|r| held_against(&model, r, 1.0));
        let fits = fits.collect::<Result<_>>()?;
        let appraisal = as_it_is_elsewhere(&model, &data.fitted)?;
        let revision = Revision {
            step: None,
            added: None,
            removed: None,
            before: None,
            evidence: None,
            appraisal,
        };
        return Ok(Compared { revision, recorded: data.fitted, fits });
    }
    model.records = data.fitted.iter().map(|r| r.entry.clone()).collect();
    model.modal.retain(|c, _| model.records.iter().any(|e| e.condition == *c));
    let model = data.seen(model);
    let (change, current) = on_top(&model, &data, &comparison.effects)?;
    if comparison.model.is_none() {
        warn_of_zero(&current, &data);
    }
    let fits = current.fit.fits;
    Ok(Compared { revision: change.into_revision(None), recorded: data.fitted, fits })
}

/// `model` fitted with `effects` on top of it, one after the other.
fn on_top(model: &Model, data: &Data, effects: &[Effect]) -> Result<(Change, Current)> {
    let mut current = Current::fitted(model, data)?;
    let mut change = Change::to(&current, data)?;
    for effect in effects {
        if current.model.effect(effect.clone()).is_some() {
            yawrig_base::say!(
                "{effect} is in the model already: all of it is fitted, with nothing on top"
            );
            continue;
        }
        check_addable(&current.model, effect.clone())?;
        data.check_seen(effect)?;
        let outer = tried(&current, data, effect.clone())?;
        let mut next = Change::to(&outer, data)?;
        next.added = Some(effect.clone());
        next.before = Some(change.appraisal.residuals);
        next.evidence = Some(outer.fit.bic().gain_over(&current.fit.bic()));
        change = next;
        current = outer;
    }
    Ok((change, current.settled()?))
}

/// Warns where the sensor's zero, taken as known, is not where the model rests: where a free zero is worth as
/// much as the effects, or worth itself beside them.
fn warn_of_zero(current: &Current, data: &Data) {
    let Model { effects, unknown_zero, .. } = &current.model;
    let is_free = *unknown_zero || current.model.rest().is_some();
    if is_free || effects.is_empty() {
        return;
    }
    let with_zero = |model: &Model| {
        let free = Current::fitted(&Model { unknown_zero: true, ..model.clone() }, data).ok()?;
        let gain = free.fit.bic().gain_over(&current.fit.bic());
        Some((free, gain))
    };
    let instead = with_zero(&Model { effects: Vec::new(), ..current.model.clone() });
    let beside = || with_zero(&current.model).filter(|(_, gain)| *gain > MARGIN);
    let Some((free, gain)) = instead.filter(|(_, gain)| *gain > 0.0).or_else(beside) else {
        return;
    };
    for (recorded, fit) in data.fitted.iter().zip(&free.fit.fits) {
        let zero = fit.sensor_zero_rad().filter(|zero| !zero.holds(0.0, 3.0));
        let Some(zero) = zero else { continue };
        let measurand = &recorded.decay.measurand;
        yawrig_base::warn!(
            "{}: the model rests at {} {}, off the sensor's zero, and the effects may only make up for \
             that (difference of BIC of a free zero {} them: {gain:.1}). Where the sensor's zero is not known, compare with \
             {}; where it is, a constant moment is the cause: {}",
            recorded.path.display(),
            Quantity::new(measurand.shown(zero.value), measurand.shown(zero.u)),
            measurand.unit(),
            if free.model.effects.is_empty() { "in place of" } else { "beside" },
            settings::name("unknown_zero"),
            settings::given("effect", &Effect::of_rest().to_string()),
        );
    }
}
