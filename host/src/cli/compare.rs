//! `compare`: a model, with any effects on top, against records.

use super::common::{bare, print_line, EffectsArg};
use super::model::{print_revision, summary, JudgeArgs, DEFAULT};
use crate::model::appraisal::Appraisal;
use crate::model::comparison::{compare, Comparison};
use crate::model::revise::Revision;
use clap::Args;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_core::quantity::Quantity;

/// Compare a model with records and show where it fails.
///
/// The free decay is simulated from the release. Where there is a model.toml (or --model names one) its values are
/// held against its records, or those given; only what a record has of its own is fitted, as its initial state. With
/// --effect the effect is tried on top, and all is fitted. Without a model a second-order one is fitted. Nothing is
/// written.
#[derive(Args, Debug, Clone)]
pub struct Compare {
    /// Records (CSV: time_s,yaw_deg); none: those of the model
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub effects: EffectsArg,
    /// The model's file [default: model.toml where there is one]
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Compare a second-order model even where there is a model.toml
    #[arg(long, conflicts_with = "model")]
    pub no_model: bool,
    #[command(flatten)]
    pub judge: JudgeArgs,
}

impl Compare {
    pub fn run(&self) -> Result<()> {
        let found = || Some(PathBuf::from(DEFAULT)).filter(|path| path.exists() && !self.no_model);
        let model = self.model.clone().or_else(found);
        if model.is_none() && self.files.is_empty() {
            return Err(Error::usage("there is neither a record nor a model to compare")
                .help("name a record: yawrig compare RECORD.csv"));
        }
        if let Some(path) = &model {
            if self.judge.unknown_zero {
                return Err(Error::usage("--unknown-zero beside a model, whose file says it")
                    .help("leave it out, or compare a second-order model with --no-model"));
            }
            if self.model.is_none() {
                crate::say!("comparing {} (a second-order model: --no-model)", path.display());
            }
        }
        let revision = compare(&Comparison {
            model: model.clone(),
            files: self.files.clone(),
            effects: self.effects.effects()?,
            unknown_zero: self.judge.unknown_zero,
        })?;
        if self.judge.json {
            return print_revision(model.as_deref(), &revision, true);
        }
        print_line(&text(model.as_deref(), &revision))
    }
}

fn text(model: Option<&Path>, revision: &Revision) -> String {
    let a = &revision.appraisal;
    let with: String = a.effects.iter().map(|e| format!(" + {e}")).collect();
    let name = model.map_or_else(String::new, |m| format!("{}: ", m.display()));
    let mut out = format!("{name}second order{with}\n{}", summary(revision));
    let w = &a.where_;
    let white = if w.correlation.abs() <= w.correlation_of_white { "white" } else { "not white" };
    let _ = writeln!(
        out,
        "  noise {:.4} deg; residual {white}: lag-one correlation {:.3}, of white noise within {:.3}",
        a.noise_rms_deg, w.correlation, w.correlation_of_white
    );
    let _ = write!(
        out,
        "\nwhat is left of {}, and where; residuals below are of means over a fiftieth of a period, as in \"over noise\"\n\n",
        a.where_file
    );
    out.push_str(&tables(a).map(|t| t.trim_fmt()).join("\n\n"));
    out
}

fn tables(a: &Appraisal) -> [comfy_table::Table; 6] {
    let w = &a.where_;
    let rows = |header: [&str; 2], rows: Vec<(String, f64, String)>| {
        let mut table = bare(&[header[0], header[1], ""]);
        if let Some(column) = table.column_mut(2) {
            column.set_cell_alignment(comfy_table::CellAlignment::Left);
        }
        let most = rows.iter().fold(f64::MIN_POSITIVE, |m, r| m.max(r.1.abs()));
        for (at, size, shown) in rows {
            table.add_row([at, shown, "#".repeat((BAR * size.abs() / most).round() as usize)]);
        }
        table
    };
    let deg = |at: String, rms: f64| (at, rms, format!("{rms:.4}"));
    let law = |at: f64, moment: f64, u: f64| {
        (format!("{at:.2}"), moment, Quantity::new(moment, u).to_string())
    };
    let time = w.time.iter().map(|t| deg(format!("{:.2} - {:.2}", t.from_s, t.to_s), t.rms_deg));
    let amplitude =
        w.amplitude.iter().map(|t| deg(format!("{:.2} - {:.2}", t.from_deg, t.to_deg), t.rms_deg));
    let damping = w.damping_law.iter().map(|p| law(p.rate_deg_s, p.moment_rad_s2, p.u_rad_s2));
    let stiffness = w.stiffness_law.iter().map(|p| law(p.yaw_deg, p.moment_rad_s2, p.u_rad_s2));
    let frequency = w
        .frequency
        .iter()
        .filter(|f| f.share >= 0.005)
        .map(|f| (format!("{:.3}", f.hz), f.share, format!("{:.1}", 100.0 * f.share)));
    let mut windows = bare(&["amplitude (deg)", "wn (rad/s)", "zeta"]);
    for w in &a.windows {
        windows.add_row([
            format!("{:.3}", w.amplitude_deg),
            format!("{:.4}", w.natural_frequency_rad_s),
            format!("{:.5}", w.damping_ratio),
        ]);
    }
    [
        rows(["time (s)", "residual (deg)"], time.collect()),
        rows(["amplitude (deg)", "residual (deg)"], amplitude.collect()),
        rows(["rate at zero yaw (deg/s)", "missing moment (rad/s2)"], damping.collect()),
        rows(["yaw at zero rate (deg)", "missing moment (rad/s2)"], stiffness.collect()),
        rows(["frequency (Hz)", "share of the residual (%)"], frequency.collect()),
        windows,
    ]
}

/// Length of the longest bar.
const BAR: f64 = 30.0;
