//! `diagnose`: which physical effect a second-order model of a record, or of a campaign's, lacks.

use super::common::{bare, print_json, print_line, EffectsArg, SCHEMA_VERSION};
use super::diagnose_campaign;
use super::model::JudgeArgs;
use crate::criticism::campaign;
use crate::criticism::diagnose::{diagnose, Diagnosis, Options, Status, Step};
use crate::criticism::effects::Effect;
use crate::derivatives::campaign::CampaignFile;
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
///
/// A campaign.toml has all its releases judged together: which effects they need, whether each is there with the wind
/// off (mechanical) or only with it on (aerodynamic), and what it does to the derivatives.
#[derive(Args, Debug, Clone)]
pub struct Diagnose {
    /// Record (CSV: time_s,yaw_deg), or campaign.toml
    #[arg(value_name = "FILE|campaign.toml")]
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
        let options = Options { zero_unknown: self.judge.unknown_zero, own };
        if self.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            return self.run_campaign(&options);
        }
        let record = Record::read(&self.file)?;
        let diagnosis = diagnose(&record, &options)?;
        if self.judge.json {
            return print_json(&Object { schema_version: SCHEMA_VERSION, diagnosis: &diagnosis });
        }
        print_line(&text(&self.file.display().to_string(), &diagnosis))
    }

    fn run_campaign(&self, options: &Options) -> Result<()> {
        let file = CampaignFile::read_releases(&self.file)?;
        crate::say!("fitting {} releases", file.campaign.release.len());
        let diagnosis = &campaign::diagnose(&file, options)?;
        if self.judge.json {
            let (schema_version, campaign) = (SCHEMA_VERSION, &self.file);
            return print_json(&CampaignObject { schema_version, campaign, diagnosis });
        }
        print_line(&diagnose_campaign::text(&self.file.display().to_string(), diagnosis))
    }
}

#[derive(Serialize)]
struct CampaignObject<'a> {
    schema_version: u32,
    campaign: &'a PathBuf,
    #[serde(flatten)]
    diagnosis: &'a campaign::CampaignDiagnosis,
}

/// The verdict, to be read.
fn text(file: &str, d: &Diagnosis) -> String {
    let verdict = verdict(d.status, &d.effects);
    let mut out = format!("{file}: {verdict}\n");
    let _ = writeln!(
        out,
        "  wn {} rad/s, zeta {}, noise {:.4} deg",
        d.modal.natural_frequency_rad_s, d.modal.damping_ratio, d.noise_rms_deg
    );
    let _ = writeln!(out, "{}", step_rows(&d.steps));
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
    d.effects.iter().for_each(|effect| out.push_str(&card(*effect)));
    out.truncate(out.trim_end().len());
    out
}

/// In one line.
pub(super) fn verdict(status: Status, effects: &[Effect]) -> String {
    let names: Vec<&str> = effects.iter().map(|e| e.id()).collect();
    match status {
        Status::Adequate => "adequate: the second-order model explains it to its noise".to_owned(),
        Status::Explained => format!("explained by {}", names.join(", ")),
        Status::Unexplained if names.is_empty() => {
            "unexplained: no effect of the library accounts for it".to_owned()
        }
        Status::Unexplained => {
            format!("unexplained: {} helped, but not to the noise", names.join(", "))
        }
    }
}

pub(super) fn step_rows(steps: &[Step]) -> comfy_table::Table {
    let mut rows = bare(&["model", "residual (deg)", "over noise", "held out over noise"]);
    for step in steps {
        rows.add_row([
            step.added.map_or("second order".to_string(), |e| format!("+ {e}")),
            format!("{:.4}", step.residual_rms_deg),
            format!("{:.3}", step.residual_over_noise),
            format!("{:.3}", step.held_out_over_noise),
        ]);
    }
    rows
}

/// An effect's card, to be read.
pub(super) fn card(effect: Effect) -> String {
    let card = effect.card();
    format!(
        "\n{}: {}\n  usual cause: {}\n  fingerprint: {}\n  to confirm: {}\n  to remove: {}\n",
        card.title, card.formula, card.cause, card.fingerprint, card.confirm, card.remove
    )
}
