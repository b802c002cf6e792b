//! What the verbs of the model have in common: which model, and what they print.

use super::common::{bare, print_json, print_line, SCHEMA_VERSION};
use crate::answer::Answer;
use clap::Args;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_core::effects::Effect;
use yawrig_core::fit::at_amplitude::AtAmplitude;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Measurand;
use yawrig_model::appraisal::{Appraisal, RecordAppraisal};
use yawrig_model::effects::named;
use yawrig_model::journal::Residuals;
use yawrig_model::revise::{quoted, Revision, RevisionRequest};
use yawrig_report::units::sized;

pub use yawrig_model::document::DEFAULT;

#[derive(Args, Debug, Clone)]
pub struct ModelArg {
    /// The model's file; its journal lies beside it
    #[arg(short, long, value_name = "MODEL", default_value = DEFAULT)]
    pub model: PathBuf,
}

/// Whether the sensor's zero is known, and how the result is printed.
#[derive(Args, Debug, Clone)]
pub struct JudgeArgs {
    /// The sensor was not zeroed: fit its zero, and leave out the constant moment
    #[arg(long)]
    pub unknown_zero: bool,
    /// Print one JSON object
    #[arg(short, long)]
    pub json: bool,
}

/// The command as it was typed, for the journal.
pub fn asked(why: Option<&str>) -> RevisionRequest {
    let words: Vec<String> =
        std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy())).collect();
    RevisionRequest {
        command: format!("yawrig {}", words.join(" ")),
        why: why.map(str::to_owned),
        keep: false,
    }
}

#[derive(Serialize)]
pub(super) struct Object<'a> {
    schema_version: u32,
    model: Option<&'a Path>,
    #[serde(flatten)]
    revision: &'a Revision,
}

/// What `--json` prints of a step.
pub(super) fn revised<'a>(model: Option<&'a Path>, revision: &'a Revision) -> Object<'a> {
    Object { schema_version: SCHEMA_VERSION, model, revision }
}

/// What `--json` prints of a step, with its verdict.
///
/// # Errors
/// Those of [`Answer::new`].
pub fn answered(model: &Path, revision: &Revision) -> Result<Answer> {
    let r = &revision.appraisal.residuals;
    let sentence = format!(
        "{}: residual {:.3} times the noise, held out {:.3}",
        model.display(),
        r.residual_over_noise,
        r.held_out_over_noise
    );
    Answer::new(&revised(Some(model), revision), sentence)
}

/// Prints what a step has done, as JSON or as text.
///
/// # Errors
/// Where stdout cannot be written.
pub fn print_revision(model: Option<&Path>, revision: &Revision, json: bool) -> Result<()> {
    if json {
        return print_json(&revised(model, revision));
    }
    let mut out = String::new();
    let what = match (revision.added.clone(), revision.removed.clone()) {
        (Some(effect), _) => format!("added {effect}"),
        (_, Some(effect)) => format!("removed {effect}"),
        _ => "fitted".to_owned(),
    };
    let model = model.map_or_else(String::new, |m| m.display().to_string());
    if let Some(step) = revision.step {
        let _ = writeln!(out, "{model}, step {step}: {what}");
    }
    out.push_str(&summary(revision));
    print_line(out.trim_end())
}

/// Residuals before and after, and every value of the model.
pub fn summary(revision: &Revision) -> String {
    let a = &revision.appraisal;
    let measurand = &a.said.measurand();
    let plain = |number| format!("{number:.3}");
    let mut out = format!(
        "  residual {} {}; over noise {}; held out {}",
        change(revision, |r| sized(measurand, r.residual_rms_deg, 4)),
        measurand.unit(),
        change(revision, |r| plain(r.residual_over_noise)),
        change(revision, |r| plain(r.held_out_over_noise)),
    );
    if let Some(evidence) = revision.evidence {
        let of =
            <std::option::Option<yawrig_core::effects::Effect> as Clone>::clone(&revision.removed)
                .map_or_else(String::new, |effect| format!(" for {effect}"));
        let _ = write!(out, "; difference of BIC{of} {evidence:.1}");
        if let Some(effect) = revision.added.as_ref().filter(|_| evidence < 0.0) {
            let _ =
                write!(out, "\n  {effect} does not help: it costs more numbers than it explains");
        }
    }
    out.push('\n');
    for c in &a.conditions {
        let name =
            if a.conditions.len() > 1 { format!("{}: ", c.condition) } else { String::new() };
        let _ = writeln!(
            out,
            "  {name}wn {} rad/s, zeta {}",
            c.modal.natural_frequency_rad_s, c.modal.damping_ratio
        );
    }
    for effect in &a.effects {
        for known in effect.parameters() {
            let name = format!("{effect}.{}", known.name);
            if let Some(value) = a.parameters.get(&name) {
                let _ = writeln!(out, "  {}", parameter_of(measurand, effect, &name, value));
            }
        }
    }
    out.push_str(&needed(&a.needed_by_prediction));
    out.push_str(&records(a));
    out.push_str(&amplitude_rows(measurand, &a.at_amplitude));
    out
}

/// Natural frequency and damping ratio against amplitude, and where they change, of what the values above
/// them are; nothing without rows.
pub fn amplitude_rows(measurand: &Measurand, rows: &[AtAmplitude]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let amplitude = format!("  amplitude ({})", measurand.coordinate_unit());
    let mut table = bare(&[&amplitude, "wn (rad/s)", "zeta"]);
    for row in rows {
        table.add_row([
            format!("  {}", sized(measurand, row.amplitude_deg, 4)),
            row.natural_frequency_rad_s.to_string(),
            row.damping_ratio.to_string(),
        ]);
    }
    let changes = |of: fn(&AtAmplitude) -> Quantity| {
        rows.iter().any(|row| !of(row).holds(of(&rows[0]).value, 2.0))
    };
    let said = match changes(|r| r.natural_frequency_rad_s) || changes(|r| r.damping_ratio) {
        true => "  (a cycle begun at that amplitude; wn and zeta above are those at rest, which no amplitude has)\n",
        false => "",
    };
    format!("{}\n{said}", table.trim_fmt())
}

/// An effect's parameter (`coulomb_friction.c`) with its value and unit.
pub fn parameter(measurand: &Measurand, name: &str, value: &Quantity) -> String {
    match name.split_once('.').and_then(|(effect, _)| named(effect).ok()) {
        Some(effect) => parameter_of(measurand, &effect, name, value),
        None => format!("{name} = {value}"),
    }
}

/// What the ± of these effects is, which their predictions need.
pub fn needed(effects: &[Effect]) -> String {
    let names: Vec<&str> = effects.iter().map(Effect::id).collect();
    match names.len() {
        0 => String::new(),
        _ => format!(
            "  the ± of {} is half of the number at most: what the model lacks might stand in for it, but without it the prediction is worse\n",
            names.join(", ")
        ),
    }
}

fn parameter_of(measurand: &Measurand, effect: &Effect, name: &str, value: &Quantity) -> String {
    let own = name.rsplit_once('.').map_or(name, |(_, own)| own);
    match effect.unit_in(measurand, own).as_str() {
        "" | "1" => format!("{name} = {value}"),
        unit => format!("{name} = {value} {unit}"),
    }
}

fn change(revision: &Revision, shown: impl Fn(&Residuals) -> String) -> String {
    let after = shown(&revision.appraisal.residuals);
    match &revision.before {
        Some(before) => format!("{} -> {after}", shown(before)),
        None => after,
    }
}

/// A row for each record, where there are several.
fn records(a: &Appraisal) -> String {
    if a.records.len() < 2 {
        return String::new();
    }
    let measurand = &a.said.measurand();
    let [noise, residual] = ["noise", "residual"].map(|of| format!("{of} ({})", measurand.unit()));
    let mut rows = bare(&["record", "", &noise, &residual, "over noise"]);
    for r in &a.records {
        let RecordAppraisal { file, held_out, .. } = r;
        rows.add_row([
            file.clone(),
            if *held_out { "held out" } else { "fitted" }.to_owned(),
            sized(measurand, r.noise_rms_deg, 4),
            sized(measurand, r.residual_rms_deg, 4),
            format!("{:.3}", r.residual_over_noise),
        ]);
    }
    format!("{}\n", rows.trim_fmt())
}
