//! `compare`: a second-order model, with any effects, against a record.

use super::common::{bare, print_json, print_line, EffectsArg, SCHEMA_VERSION};
use crate::criticism::diagnose::{compare, Comparison, Options};
use crate::error::Result;
use crate::record::Record;
use clap::Args;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Fit a second-order model, with any effects, to a record and show where it fails.
///
/// The free swing is simulated from the release; all parameters and the initial state are fitted.
#[derive(Args, Debug, Clone)]
pub struct Compare {
    /// Record (CSV: time_s,yaw_deg)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    #[command(flatten)]
    pub effects: EffectsArg,
    /// The sensor was not zeroed: fit its nought
    #[arg(long)]
    pub unknown_zero: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Object<'a> {
    schema_version: u32,
    #[serde(flatten)]
    comparison: &'a Comparison,
}

impl Compare {
    pub fn run(&self) -> Result<()> {
        let effects = self.effects.effects()?;
        let record = Record::read(&self.file)?;
        let options = Options { zero_unknown: self.unknown_zero, ..Options::default() };
        let comparison = compare(&record, &effects, &options)?;
        if self.json {
            return print_json(&Object { schema_version: SCHEMA_VERSION, comparison: &comparison });
        }
        print_line(&text(&self.file.display().to_string(), &comparison))
    }
}

fn text(file: &str, c: &Comparison) -> String {
    let mut out = format!(
        "{file}\n  wn {} rad/s, zeta {}, noise {:.4} deg\n  residual {:.4} deg, {:.3} times the noise, {:.3} on the later part held out, lag-one correlation {:.3}\n",
        c.modal.natural_frequency_rad_s,
        c.modal.damping_ratio,
        c.noise_rms_deg,
        c.step.residual_rms_deg,
        c.step.residual_over_noise,
        c.step.held_out_over_noise,
        c.where_.correlation
    );
    for (name, value) in &c.step.parameters {
        let _ = writeln!(out, "  {name} = {value}");
    }
    let mut time = bare(&["time (s)", "residual (deg)"]);
    for bin in &c.where_.time {
        time.add_row([
            format!("{:.2} - {:.2}", bin.from_s, bin.to_s),
            format!("{:.4}", bin.rms_deg),
        ]);
    }
    let mut amplitude = bare(&["amplitude (deg)", "residual (deg)"]);
    for bin in &c.where_.amplitude {
        amplitude.add_row([
            format!("{:.2} - {:.2}", bin.from_deg, bin.to_deg),
            format!("{:.4}", bin.rms_deg),
        ]);
    }
    let mut windows = bare(&["amplitude (deg)", "wn (rad/s)", "zeta"]);
    for w in &c.windows {
        windows.add_row([
            format!("{:.3}", w.amplitude_deg),
            format!("{:.4}", w.natural_frequency_rad_s),
            format!("{:.5}", w.damping_ratio),
        ]);
    }
    let _ = write!(out, "\n{time}\n\n{amplitude}\n\n{windows}");
    out
}
