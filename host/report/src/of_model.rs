//! The report of a model: its journal, and how far it is from its records.

use super::answer::Answer;
use super::criticism::{effects, LATER_PART, SECOND_ORDER};
use super::of_records::{blank, drawn_release, with_effects};
use super::{
    Criticism, Estimate, JournalRow, Kind, Made, Report, SettingRow, SourceFile, StaircaseStep,
    TRACE_NUMBERS,
};
use std::path::Path;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_core::diagnosis::compare::locate;
use yawrig_core::fit::fitting::{fit_plain, Fitted};
use yawrig_model::appraisal::known;
use yawrig_model::comparison::{compare, Comparison};
use yawrig_model::document::{read_text, Model};
use yawrig_model::journal::{self, Journal};
use yawrig_model::model_fit::{held_against, Data, Recorded};

/// The report of the model at `path`.
///
/// # Errors
/// Exit 3 where the model, its journal or a record cannot be read, or the model is not fitted yet.
pub fn of_model(path: &Path, made: Made) -> Result<Report> {
    let model = Model::read(path)?;
    let data = Data::new(&model, path)?;
    let journal = Journal::new(path)?;
    let appraisal =
        compare(&Comparison { model: Some(path.to_owned()), ..Comparison::default() })?.appraisal;
    let mut report = Report::new(Kind::Model, path.display().to_string(), made);
    let zero = if model.unknown_zero { "unknown, fitted" } else { "known" };
    report.settings.push(SettingRow::new("sensor's zero", zero, ""));
    report.sources.push(SourceFile::new(path)?);
    let names = appraisal.effects.iter().map(|e| e.id()).collect::<Vec<_>>().join(", ");
    let r = appraisal.residuals;
    report.verdict = format!(
        "The model ({}) leaves {:.2} times the noise on what was fitted and {:.2} times on what was held out.",
        if names.is_empty() { "second order".to_owned() } else { format!("second order with {names}") },
        r.residual_over_noise,
        r.held_out_over_noise
    );
    if read_text(path)? != journal.last().map_or("", |step| step.model.as_str()) {
        report.notes.push("The model's file is not as its last step left it.".to_owned());
    }
    report.notes.extend(appraisal.stale.iter().cloned());
    report.journal = journal.steps.iter().map(row).collect();
    let recorded: Vec<&Recorded> = data.fitted.iter().chain(&data.held_out).collect();
    let numbers = TRACE_NUMBERS / recorded.len();
    let mut wheres = Vec::new();
    let found = effects(&appraisal.said.measurand(), &appraisal.effects, &appraisal.parameters);
    for recorded in recorded {
        interrupt::check()?;
        let decay = &recorded.decay;
        let record = yawrig_records::read_selected(&recorded.path, &recorded.entry.reading)?;
        report.sources.push(SourceFile::new(&recorded.path)?);
        let fit = known(&model, recorded, &held_against(&model, recorded, 1.0)?);
        let plain = fit_plain(decay, model.unknown_zero, decay.yaw_rad.len());
        let with = with_effects(&fit);
        let mut models: Vec<(&str, &Fitted)> = vec![(SECOND_ORDER, &plain)];
        if !model.effects.is_empty() {
            models.push((&with, &fit));
        }
        let name = recorded.path.display().to_string();
        if name == appraisal.where_file {
            wheres = models.iter().map(|(n, m)| ((*n).to_owned(), locate(decay, m))).collect();
        }
        let condition =
            appraisal.conditions.iter().find(|c| c.condition == recorded.entry.condition);
        let estimates = condition.map(|c| Estimate {
            method: "the model".to_owned(),
            natural_frequency_rad_s: c.modal.natural_frequency_rad_s,
            damping_ratio: c.modal.damping_ratio,
            residual_rms_deg: Some(decay.raw_rms_deg(fit.rms_rad())),
            residual_over_noise: None,
            refused: false,
            remarks: Vec::new(),
        });
        let over_noise = fit.over_noise(decay);
        let answer = condition.map(|c| Answer::new(&with, &c.modal, &found, over_noise));
        let held_out = recorded.entry.held_out;
        let release = super::ReleaseReport {
            held_out,
            estimates: estimates.into_iter().collect(),
            answer,
            ..blank(name)
        };
        report.releases.push(drawn_release(&record, decay, &models, &models, numbers, release));
    }
    report.criticism = Some(Criticism {
        said: appraisal.said.clone(),
        status: None,
        sentences: Vec::new(),
        steps: journal.steps.iter().filter_map(step).collect(),
        held_out: match data.held_out.is_empty() {
            true => LATER_PART.to_owned(),
            false => "the records held out".to_owned(),
        },
        candidates: Vec::new(),
        effects: found,
        indistinguishable: Vec::new(),
        wheres,
        where_file: appraisal.where_file,
    });
    Ok(report)
}

fn what(step: &journal::JournalStep) -> String {
    let named = |id: &Option<String>| id.clone().unwrap_or_default();
    match step.action {
        journal::Action::Fit => "fit".to_owned(),
        journal::Action::Add => format!("+ {}", named(&step.added)),
        journal::Action::Remove => format!("- {}", named(&step.removed)),
        journal::Action::Return => {
            format!("return to {}", step.returned_to.unwrap_or_default())
        }
        journal::Action::Reject => format!("reject {}", named(&step.rejected)),
        journal::Action::Edit => "edit by hand".to_owned(),
    }
}

fn row(step: &journal::JournalStep) -> JournalRow {
    JournalRow {
        step: step.step,
        time_utc: step.time_utc.clone(),
        what: what(step),
        command: step.command.clone(),
        why: step.why.clone().unwrap_or_default(),
        residual_over_noise: step.after.map(|r| r.residual_over_noise),
        held_out_over_noise: step.after.map(|r| r.held_out_over_noise),
    }
}

/// A rejection changes nothing and is no step of the staircase.
fn step(step: &journal::JournalStep) -> Option<StaircaseStep> {
    let after = step.after.filter(|_| step.action != journal::Action::Reject)?;
    Some(StaircaseStep {
        name: format!("{}. {}", step.step, what(step)),
        residual_rms_deg: after.residual_rms_deg,
        residual_over_noise: after.residual_over_noise,
        held_out_over_noise: after.held_out_over_noise,
    })
}
