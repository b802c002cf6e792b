//! `diagnose`: which physical effect a second-order model of a record lacks.

use super::common::{bare, print_json, print_line, EffectsArg, SCHEMA_VERSION};
use super::model::JudgeArgs;
use crate::criticism::diagnose::{diagnose, Diagnosis, Options, Status};
use crate::error::Result;
use crate::record::Record;
use clap::Args;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Which physical effect a second-order model of a record lacks.
///
/// Every effect of the library is fitted, alone and together with others, and judged by evidence, by the later part of
/// the record and by its size. A reading at rest that is not nought counts as a constant moment unless --unknown-zero
/// says that the sensor was not zeroed. Your own effect, a moment written as an expression in a file, competes with them
/// when --effect names it.
#[derive(Args, Debug, Clone)]
pub struct Diagnose {
    /// Record (CSV: time_s,yaw_deg)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    #[command(flatten)]
    pub effects: EffectsArg,
    #[command(flatten)]
    pub judge: JudgeArgs,
}

#[derive(Serialize)]
struct Object<'a> {
    schema_version: u32,
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
}

impl Diagnose {
    pub fn run(&self) -> Result<()> {
        let own = self.effects.effects()?;
        let record = Record::read(&self.file)?;
        let options = Options { zero_unknown: self.judge.unknown_zero, own };
        let diagnosis = diagnose(&record, &options)?;
        if self.judge.json {
            return print_json(&Object { schema_version: SCHEMA_VERSION, diagnosis: &diagnosis });
        }
        print_line(&text(&self.file.display().to_string(), &diagnosis))
    }
}

/// The verdict, to be read.
fn text(file: &str, d: &Diagnosis) -> String {
    let names: Vec<&str> = d.effects.iter().map(|e| e.id()).collect();
    let verdict = match d.status {
        Status::Adequate => "adequate: the second-order model explains it to its noise".to_string(),
        Status::Explained => format!("explained by {}", names.join(", ")),
        Status::Unexplained if names.is_empty() => {
            "unexplained: no effect of the library accounts for it".to_string()
        }
        Status::Unexplained => {
            format!("unexplained: {} helped, but not to the noise", names.join(", "))
        }
    };
    let mut out = format!("{file}: {verdict}\n");
    let _ = writeln!(
        out,
        "  wn {} rad/s, zeta {}, noise {:.4} deg",
        d.modal.natural_frequency_rad_s, d.modal.damping_ratio, d.noise_rms_deg
    );
    let mut steps = bare(&["model", "residual (deg)", "over noise", "held out over noise"]);
    for step in &d.steps {
        steps.add_row([
            step.added.map_or("second order".to_string(), |e| format!("+ {e}")),
            format!("{:.4}", step.residual_rms_deg),
            format!("{:.3}", step.residual_over_noise),
            format!("{:.3}", step.held_out_over_noise),
        ]);
    }
    let _ = writeln!(out, "{steps}");
    for (name, value) in d.steps.last().iter().flat_map(|s| &s.parameters) {
        let _ = writeln!(out, "  {name} = {value}");
    }
    let mut candidates = bare(&["effect alone", "over noise", "evidence"]);
    for c in d.candidates.iter().take(5) {
        let evidence =
            if c.converged { format!("{:.1}", c.evidence) } else { "not converged".to_string() };
        candidates.add_row([
            c.effect.to_string(),
            format!("{:.3}", c.residual_over_noise),
            evidence,
        ]);
    }
    let _ = writeln!(out, "\n{candidates}");
    for [a, b] in &d.indistinguishable {
        let _ = writeln!(
            out,
            "\n  {a} and {b} cannot be told apart in this record; what would: {}",
            a.card().release
        );
    }
    for effect in &d.effects {
        let card = effect.card();
        let _ = write!(
            out,
            "\n{}: {}\n  usual cause: {}\n  fingerprint: {}\n  to confirm: {}\n  to remove: {}\n",
            card.title, card.formula, card.cause, card.fingerprint, card.confirm, card.remove
        );
    }
    out.truncate(out.trim_end().len());
    out
}
