//! The steps of the loop as the page asks for them, each the one of the command line.

use super::bench::Bench;
use super::job::Job;
use super::law;
use super::session::{RecordSource, Session, Standing, Together};
use super::shown_law::about;
use rayon::prelude::*;
use serde_json::json;
use std::path::PathBuf;
use std::slice::from_ref;
use std::sync::Arc;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_core::diagnosis::diagnose::{self, Diagnosed, Grouping, SECOND_ORDER};
use yawrig_core::effects::{Effect, MEASURED_LAW};
use yawrig_core::record::Record;
use yawrig_model::document::RecordEntry;
use yawrig_model::measured;
use yawrig_model::revise::{self, quoted, Revision, RevisionRequest};
use yawrig_model::unfitted;
use yawrig_report::view::{options, Ghost, Loaded, View};

/// A copy of what a job needs of the session, which stays unlocked meanwhile.
struct Taken {
    path: PathBuf,
    standing: Standing,
    wanted: Vec<RecordEntry>,
    are_ticks_changed: bool,
    unknown_zero: bool,
    own: Vec<Effect>,
}

impl Taken {
    fn new(session: &Session) -> Self {
        Self {
            path: session.model_path.clone(),
            standing: session.standing.clone(),
            wanted: session.wanted(),
            are_ticks_changed: session.are_ticks_changed(),
            unknown_zero: session.unknown_zero,
            own: session.own.clone(),
        }
    }

    /// The command that would do the same, for the journal.
    fn asked(&self, words: &str, why: Option<&str>) -> RevisionRequest {
        let why = why.filter(|why| !why.trim().is_empty());
        let model = match self.path.to_str() {
            Some(yawrig_model::document::DEFAULT) => String::new(),
            _ => format!(" --model {}", quoted(&self.path.display().to_string())),
        };
        let reason = why.map_or_else(String::new, |why| format!(" --why {why:?}"));
        RevisionRequest {
            command: format!("yawrig {words}{model}{reason} # workbench"),
            why: why.map(str::to_owned),
            keep: false,
        }
    }

    fn fit(&self) -> Result<Revision> {
        if !self.wanted.iter().any(|e| !e.held_out) {
            return Err(Error::usage("no release is ticked to be fitted")
                .help("tick one in the list on the left"));
        }
        let mut words = "fit".to_owned();
        for entry in &self.wanted {
            words.push_str(if entry.held_out { " --hold-out " } else { " " });
            words.push_str(&quoted(&entry.file));
        }
        let asked = self.asked(&words, None);
        revise::fit_to(&self.path, self.wanted.clone(), self.unknown_zero, &asked)
    }

    /// A model to take a step with, about the releases that are ticked.
    fn begun(&self) -> Result<()> {
        if self.standing.model.is_none() || self.are_ticks_changed {
            self.fit()?;
        }
        Ok(())
    }
}

/// The releases of which there is no view with the present model, those of `wanted` first, then the most
/// recent.
pub fn without_view(bench: &Bench, wanted: Vec<usize>) -> Vec<usize> {
    let session = bench.session();
    let others = (0..session.releases.len()).rev();
    let mut next: Vec<usize> = Vec::new();
    for id in wanted.into_iter().chain(others) {
        let is_missing = id < session.releases.len() && session.view(id).is_none();
        if is_missing && !next.contains(&id) {
            next.push(id);
        }
    }
    next
}

/// Does a job; returns a sentence about the outcome.
///
/// # Errors
/// Those of the library's steps; 130 where it is stopped, and then nothing is changed.
pub fn run(bench: &Bench, job: &Job) -> Result<String> {
    if !matches!(
        job,
        Job::Diagnose { .. } | Job::Try { .. } | Job::Remove { .. } | Job::Return { .. }
    ) {
        leave_out_bad(bench)?;
    }
    let taken = Taken::new(&bench.session());
    let named = |id: &str| bench.session().effect(id);
    match job {
        Job::Fit => taken.fit().map(|r| said("fitted", &r)),
        Job::Add { effect, why, may_drive, source, keep } => {
            let drives = if *may_drive { " --may-drive" } else { "" };
            let from = source
                .map_or_else(String::new, |source| format!(" {}", settings::name(source.name())));
            let kept = if *keep { " --keep" } else { "" };
            let words = format!("add {}{drives}{from}{kept}", quoted(effect));
            let asked = RevisionRequest { keep: *keep, ..taken.asked(&words, why.as_deref()) };
            let revision = if effect == MEASURED_LAW {
                taken.begun()?;
                measured::add(&taken.path, !may_drive, &asked)?
            } else {
                // Before a first step makes another model of it: its law's formulas are then no longer shown.
                let formula = bench.session().formula(effect);
                let effect = named(effect)?;
                taken.begun()?;
                if let Some(file) = formula {
                    // The journal's command reads it.
                    file.write()?;
                }
                revise::add_from(&taken.path, effect, *source, &asked)?
            };
            Ok(said(&format!("added {effect}"), &revision))
        }
        Job::Remove { effect, why } => {
            let asked = taken.asked(&format!("remove {effect}"), why.as_deref());
            let revision = revise::remove(&taken.path, effect, &asked)?;
            Ok(said(&format!("removed {effect}"), &revision))
        }
        Job::Reject { effect, why } => {
            taken.begun()?;
            let asked = taken.asked(&format!("reject {effect}"), why.as_deref());
            let step = unfitted::reject(&taken.path, named(effect)?, &asked)?;
            Ok(format!("step {}: {effect} is rejected", step.step))
        }
        Job::Return { step, why } => {
            let asked = taken.asked(&format!("history --return {step}"), why.as_deref());
            let taken = unfitted::return_to(&taken.path, *step, &asked)?;
            Ok(format!("step {} returns to step {step}", taken.step))
        }
        Job::Diagnose { release } => diagnose(bench, &taken, *release),
        Job::Law { may_drive } => {
            let model = bench.session().next_model();
            law::measure(bench, &model, &taken.path, !may_drive)
        }
        Job::Judge => judge(bench, &taken),
        Job::Together => together(bench, &taken),
        Job::Try { release, effect } => try_effect(bench, &taken, *release, named(effect)?),
    }
}

/// Reads records not read yet, and unticks those that are bad data.
fn leave_out_bad(bench: &Bench) -> Result<()> {
    let sources: Vec<_> = bench.session().releases.iter().map(|r| r.source.clone()).collect();
    sources.par_iter().try_for_each(|source| {
        let _ = source.loaded();
        interrupt::check()
    })?;
    bench.session().leave_out_bad();
    Ok(())
}

fn said(what: &str, revision: &Revision) -> String {
    let after = &revision.appraisal.residuals;
    let change = |before: Option<f64>, after: f64| match before {
        Some(before) => format!("{before:.2} → {after:.2}"),
        None => format!("{after:.2}"),
    };
    format!(
        "step {}: {what}. Residual over noise {}, held out {}",
        revision.step.unwrap_or_default(),
        change(revision.before.map(|b| b.residual_over_noise), after.residual_over_noise),
        change(revision.before.map(|b| b.held_out_over_noise), after.held_out_over_noise),
    )
}

/// The model's name for a user.
fn presented(standing: &Standing) -> &'static str {
    match &standing.model {
        Some(model) if !model.effects.is_empty() => "the present model",
        _ => SECOND_ORDER,
    }
}

fn diagnose(bench: &Bench, taken: &Taken, id: usize) -> Result<String> {
    let source = bench.session().release(id)?.source.clone();
    let loaded = source.loaded().map_err(Clone::clone)?;
    let decay = loaded.decay.as_ref().map_err(Clone::clone)?;
    let options = options(taken.standing.model.as_deref(), decay, taken.unknown_zero, &taken.own)?;
    let diagnosed = diagnose::diagnose(from_ref(&loaded.record), &Grouping::default(), &options)?;
    interrupt::check()?;
    let model = presented(&taken.standing);
    let text = diagnosed.diagnosis.verdict(model);
    keep_diagnosed(bench, id, &source, taken.standing.key, diagnosed)?;
    Ok(text)
}

/// What was found missing in release `id`, beside the model of that key.
///
/// # Errors
/// Exit 2 where another part of its record is analysed by now.
pub fn keep_diagnosed(
    bench: &Bench,
    id: usize,
    source: &Arc<RecordSource>,
    key: u64,
    diagnosed: Diagnosed,
) -> Result<()> {
    let ghosts = Ghost::all_of(&diagnosed);
    let mut session = bench.session();
    if !session.is_of(id, source) {
        return Err(cut_meanwhile());
    }
    for ghost in ghosts {
        session.ghosts.insert((id, key, ghost.name.clone()), Arc::new(ghost));
    }
    session.diagnosed.insert((id, key), Arc::new(diagnosed));
    Ok(())
}

fn judge(bench: &Bench, taken: &Taken) -> Result<String> {
    let file = bench.session().usable_campaign().ok_or_else(|| {
        Error::usage("these records are not known to be a campaign")
            .help("open a campaign.toml: yawrig workbench campaign.toml")
    })?;
    if file.campaign.release.is_empty() {
        return Err(Error::data("no record of the campaign can be read")
            .help("put them back, and start the workbench again"));
    }
    let options = diagnose::Options {
        stop: interrupt::stop(),
        zero_unknown: taken.unknown_zero,
        own: taken.own.clone(),
        ..Default::default()
    };
    let judged = yawrig_campaign::diagnose(&file, &options)?.diagnosis;
    let text = judged.verdict(SECOND_ORDER);
    bench.session().judged = Some(Arc::new(judged));
    Ok(text)
}

/// As `yawrig diagnose` judges several records.
fn together(bench: &Bench, taken: &Taken) -> Result<String> {
    let (sources, about) = {
        let session = bench.session();
        (session.fitted_sources(), about(&session.next_model()))
    };
    if sources.len() < 2 {
        return Err(Error::usage("fewer than two releases are ticked to be fitted")
            .help("tick another in the list on the left, or ask what is missing in this one"));
    }
    let loaded = sources.iter().map(|source| source.loaded().map_err(Clone::clone));
    let loaded: Vec<&Loaded> = loaded.collect::<Result<_>>()?;
    let decay = loaded[0].decay.as_ref().map_err(Clone::clone)?;
    let mut options =
        options(taken.standing.model.as_deref(), decay, taken.unknown_zero, &taken.own)?;
    options.wind_speeds_m_s = sources.iter().map(|s| s.wind_speed_m_s).collect();
    let records: Vec<Record> = loaded.iter().map(|loaded| loaded.record.clone()).collect();
    let found = diagnose::diagnose(&records, &Grouping::default(), &options)?.diagnosis;
    let text = found.verdict(presented(&taken.standing));
    let said = format!("the {} ticked releases together: {text}", records.len());
    let sentence = found.sentence;
    bench.session().together = Some(Together { about, text: said.clone(), sentence });
    Ok(said)
}

fn try_effect(bench: &Bench, taken: &Taken, id: usize, effect: Effect) -> Result<String> {
    let source = bench.session().release(id)?.source.clone();
    let loaded = source.loaded().map_err(Clone::clone)?;
    let decay = loaded.decay.as_ref().map_err(Clone::clone)?;
    let model = taken.standing.model.as_deref();
    revise::check_addable(&model.cloned().unwrap_or_default(), effect.clone())?;
    let options = options(model, decay, taken.unknown_zero, &taken.own)?;
    let ghost = Ghost::fit(decay, &options, &effect)?;
    let text = ghost.said();
    let place = (id, taken.standing.key, ghost.name.clone());
    let mut session = bench.session();
    if !session.is_of(id, &source) {
        return Err(cut_meanwhile());
    }
    session.ghosts.insert(place, Arc::new(ghost));
    drop(session);
    Ok(text)
}

fn cut_meanwhile() -> Error {
    Error::usage("another part of the record is analysed by now").help("ask again")
}

/// The view of a release with the model as it is.
pub fn make_view(bench: &Bench, id: usize) {
    let (release, standing, unknown_zero) = {
        let session = bench.session();
        let Ok(release) = session.release(id) else { return };
        (release.clone(), session.standing.clone(), session.unknown_zero)
    };
    let made = release
        .source
        .loaded()
        .map_err(Clone::clone)
        .and_then(|loaded| loaded.recorded(&release.entry))
        .and_then(|recorded| View::new(standing.model.as_deref(), recorded, unknown_zero));
    if made.as_ref().is_err_and(|e| e.exit == yawrig_base::error::Exit::Interrupted) {
        return;
    }
    let mut session = bench.session();
    // Another part of its record may be analysed by now.
    if session.is_of(id, &release.source) {
        session.views.insert((id, standing.key), made.map(Arc::new));
        session.leave_out_bad();
    }
    drop(session);
    bench.tell(&json!({"kind": "view", "release": id}));
}
