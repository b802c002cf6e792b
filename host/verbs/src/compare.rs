//! `compare`: a model, with any effects on top, against records.

use super::common::{
    bare, print_json, print_line, with_words, wrapped, EffectsArg, SCHEMA_VERSION,
};
use super::model::{revised, summary, JudgeArgs, DEFAULT};
use super::releases::ReleaseArg;
use crate::answer::{Answer, Drawn, OfRecord};
use crate::commands::{self, new_model, Addition, Making, Words};
use clap::Args;
use serde::Serialize;
use serde_json::json;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::SourceKind;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::{Measurand, Record};
use yawrig_model::appraisal::Appraisal;
use yawrig_model::comparison::{compare, compare_records, Compared, Comparison};
use yawrig_model::document::is_model;
use yawrig_model::journal::Residuals;
use yawrig_model::revise::Revision;
use yawrig_model::side_by_side::{side_by_side, Side};
use yawrig_report::units::sized;

/// Compare a model with records and show where it fails.
///
/// The free decay is simulated from the release. Where there is a model.toml (or --model names one) its
/// values are held against its records, or those given; only what a record has of its own is fitted, as its
/// initial state. With --effect the effect is tried on top, and all is fitted. Without a model a second-order
/// one is fitted. Nothing is written.
#[derive(Args, Debug, Clone)]
pub struct Compare {
    /// Records (CSV: time_s,yaw_deg); none: those of the model
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub release: ReleaseArg,
    #[command(flatten)]
    pub effects: EffectsArg,
    /// The model's file [default: model.toml where there is one]; several are compared with each other
    #[arg(short, long, value_name = "MODEL")]
    pub model: Vec<PathBuf>,
    /// Compare a second-order model even where there is a model.toml
    #[arg(long, conflicts_with = "model")]
    pub no_model: bool,
    #[command(flatten)]
    pub judge: JudgeArgs,
}

impl Compare {
    pub fn run(&self) -> Result<()> {
        let (models, files): (Vec<PathBuf>, Vec<PathBuf>) =
            self.files.iter().cloned().partition(|file| is_model(file));
        let files = self.release.of(&files)?;
        let mut named = self.model.clone();
        named.extend(models);
        if let [_, _, ..] = named.as_slice() {
            return self.side_by_side(&named, &files);
        }
        let named = named.pop();
        let found = || Some(PathBuf::from(DEFAULT)).filter(|path| path.exists() && !self.no_model);
        let model = named.clone().or_else(found);
        if model.is_none() && files.is_empty() {
            return Err(Error::usage("there is neither a record nor a model to compare")
                .help("name a record: yawrig compare RECORD.csv"));
        }
        if let Some(path) = &model {
            if self.judge.unknown_zero {
                return Err(Error::usage("--unknown-zero beside a model, whose file says it")
                    .help("leave it out, or compare a second-order model with --no-model"));
            }
            if named.is_none() {
                yawrig_base::say!(
                    "comparing {} (a second-order model: --no-model)",
                    path.display()
                );
            }
        }
        let revision = compare(&Comparison {
            model: model.clone(),
            files: files.clone(),
            reading: self.release.selection()?,
            effects: self.effects.effects()?,
            unknown_zero: self.judge.unknown_zero,
        })?;
        let commands = self.commands(model.as_deref(), &files, &revision)?;
        if self.judge.json {
            let revision = revised(model.as_deref(), &revision);
            return print_json(&Object { revision, commands });
        }
        let mut text = text(model.as_deref(), &revision);
        if !commands.is_empty() {
            text = format!("{}\n\n{}", text.trim_end(), commands::lines(&commands));
        }
        print_line(&text)
    }

    /// Which make the model with the effects that were tried, `found`.
    fn commands(
        &self,
        model: Option<&Path>,
        files: &[PathBuf],
        found: &Revision,
    ) -> Result<Vec<Words>> {
        let effects = self.effects.effects()?;
        let making = Making {
            files: if model.is_some() { &[] } else { files },
            reading: &self.release.selection()?,
            unknown_zero: self.judge.unknown_zero,
            model: model.map_or_else(new_model, Path::to_owned),
            own: &self.effects.own_files()?,
        };
        let after = &found.appraisal.residuals;
        let rises = |before: &Residuals| after.held_out_over_noise > before.held_out_over_noise;
        let rises = found.before.as_ref().is_some_and(rises);
        // What the first of several do alone is not known.
        let is_last = |i: usize| i + 1 == effects.len();
        let added = effects.iter().enumerate().map(|(i, e)| Addition {
            effect: e.id(),
            source: SourceKind::Mechanical,
            keep: rises || !is_last(i),
        });
        let added: Vec<Addition> = added.collect();
        Ok(if added.is_empty() { Vec::new() } else { making.commands(&added) })
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Object<'a> {
    #[serde(flatten)]
    revision: super::model::Object<'a>,
    commands: Vec<Words>,
}

impl Compare {
    /// The answer about `records`, which are in memory: of a second-order model, or of the one that --model
    /// names.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, records: Vec<Record>) -> Result<Answer> {
        let model = self.model.first().cloned();
        let comparison = Comparison {
            model: model.clone(),
            files: Vec::new(),
            reading: self.release.selection()?,
            effects: self.effects.effects()?,
            unknown_zero: self.judge.unknown_zero,
        };
        let Compared { revision, recorded, fits } = compare_records(&comparison, records)?;
        let a = &revision.appraisal;
        let with: String = a.effects.iter().map(|e| format!(" + {e}")).collect();
        let sentence = format!(
            "second order{with}: residual {:.3} times the noise, held out {:.3}",
            a.residuals.residual_over_noise, a.residuals.held_out_over_noise
        );
        let both = recorded.into_iter().zip(fits);
        let fitted = both.map(|(recorded, model)| OfRecord::new(recorded, model)).collect();
        let revision = revised(model.as_deref(), &revision);
        let object = Object { revision, commands: Vec::new() };
        Ok(Answer::new(&object, sentence)?.drawn_from(Drawn::Fitted(fitted)))
    }

    fn side_by_side(&self, models: &[PathBuf], files: &[PathBuf]) -> Result<()> {
        if !self.effects.effects()?.is_empty() {
            return Err(Error::usage("--effect beside several models")
                .help("add it to one of them first: yawrig add EFFECT --model MODEL"));
        }
        let sides = side_by_side(models, files, &self.release.selection()?)?;
        if self.judge.json {
            return print_json(&json!({"schema_version": SCHEMA_VERSION, "models": sides}));
        }
        print_line(&columns(&sides))
    }
}

/// A column for each model.
fn columns(sides: &[Side]) -> String {
    let header: Vec<String> = std::iter::once(String::new())
        .chain(sides.iter().map(|s| s.model.display().to_string()))
        .collect();
    let mut table = bare(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let mut add = |name: &str, of: &dyn Fn(&Side) -> String| {
        table.add_row(std::iter::once(name.to_owned()).chain(sides.iter().map(of)));
    };
    let measurand = sides.first().map(|s| s.appraisal.said.measurand()).unwrap_or_default();
    let residual = format!("residual ({})", measurand.unit());
    add(&residual, &|s| sized(&measurand, s.appraisal.residuals.residual_rms_deg, 4));
    add("over noise", &|s| format!("{:.3}", s.appraisal.residuals.residual_over_noise));
    add("held out over noise", &|s| format!("{:.3}", s.appraisal.residuals.held_out_over_noise));
    add("numbers fitted", &|s| s.numbers.to_string());
    add("difference of BIC to the first", &|s| format!("{:+.1}", s.bic_gain));
    let conditions = sides.iter().flat_map(|s| &s.appraisal.conditions).map(|c| &c.condition);
    for condition in conditions.collect::<BTreeSet<_>>() {
        let modal = |s: &Side| {
            s.appraisal.conditions.iter().find(|c| c.condition == *condition).map(|c| c.modal)
        };
        let shown = |q: Option<Quantity>| q.map_or("-".to_owned(), |q| q.to_string());
        add(&format!("wn (rad/s), {condition}"), &|s| {
            shown(modal(s).map(|m| m.natural_frequency_rad_s))
        });
        add(&format!("zeta, {condition}"), &|s| shown(modal(s).map(|m| m.damping_ratio)));
    }
    for name in sides.iter().flat_map(|s| s.appraisal.parameters.keys()).collect::<BTreeSet<_>>() {
        add(name, &|s| s.appraisal.parameters.get(name).map_or("-".to_owned(), |q| q.to_string()));
    }
    // Where they differ: the residual over amplitude, in the bins of the first.
    if let Some(first) = sides.first() {
        for bin in &first.appraisal.where_.amplitude {
            let at = 0.5 * (bin.from_deg + bin.to_deg);
            let [from, to] = [bin.from_deg, bin.to_deg].map(|at| sized(&measurand, at, 2));
            let unit = measurand.coordinate_unit();
            add(&format!("{residual} at {from} - {to} {unit}"), &|s| {
                let bins = &s.appraisal.where_.amplitude;
                let found = bins.iter().find(|b| b.from_deg <= at && at <= b.to_deg);
                found.map_or("-".to_owned(), |b| sized(&measurand, b.rms_deg, 4))
            });
        }
    }
    format!("{}\nresiduals over amplitude are of means over a fiftieth of a period, of the record that fits worst", table.trim_fmt())
}

fn text(model: Option<&Path>, revision: &Revision) -> String {
    let a = &revision.appraisal;
    let measurand = &a.said.measurand();
    let with: String = a.effects.iter().map(|e| format!(" + {e}")).collect();
    let name = model.map_or_else(String::new, |m| format!("{}: ", m.display()));
    let mut out = format!("{name}second order{with}\n");
    let stale =
        a.stale.iter().flat_map(|line| wrapped(&format!("Not of what is here: {line}"), 80, "  "));
    stale.for_each(|line| out.push_str(&format!("{line}\n")));
    out.push_str(&summary(revision));
    let w = &a.where_;
    let white = if w.correlation.abs() <= w.correlation_of_white { "white" } else { "not white" };
    let _ = writeln!(
        out,
        "  noise {} {}; residual {white}: lag-one correlation {:.3}, of white noise within {:.3}",
        sized(measurand, a.noise_rms_deg, 4),
        measurand.unit(),
        w.correlation,
        w.correlation_of_white
    );
    let _ = write!(
        out,
        "\nwhat is left of {}, and where; residuals below are of means over a fiftieth of a period, as in \"over noise\"\n\n",
        a.where_file
    );
    let tables = tables(a, measurand);
    let tables = tables.iter().filter(|t| !t.is_empty()).map(|t| t.trim_fmt());
    out.push_str(&tables.collect::<Vec<_>>().join("\n\n"));
    out
}

fn tables(a: &Appraisal, measurand: &Measurand) -> [comfy_table::Table; 6] {
    let w = &a.where_;
    let rows = |header: [&str; 2], rows: Vec<(String, f64, String)>| {
        let mut table = with_words(&[header[0], header[1], ""], &[2]);
        let most = rows.iter().fold(f64::MIN_POSITIVE, |m, r| m.max(r.1.abs()));
        for (at, size, shown) in rows {
            table.add_row([at, shown, "#".repeat((BAR * size.abs() / most).round() as usize)]);
        }
        table
    };
    let deg = |at: String, rms: f64| (at, rms, sized(measurand, rms, 4));
    let at = |x: f64| sized(measurand, x, 2);
    let law = |at: f64, moment: f64, u: f64| {
        (sized(measurand, at, 2), moment, Quantity::new(moment, u).to_string())
    };
    let time = w.time.iter().map(|t| deg(format!("{:.2} - {:.2}", t.from_s, t.to_s), t.rms_deg));
    let by_amplitude = w
        .amplitude
        .iter()
        .map(|t| deg(format!("{} - {}", at(t.from_deg), at(t.to_deg)), t.rms_deg));
    let damping = w.damping_law.iter().map(|p| law(p.rate_deg_s, p.moment_rad_s2, p.u_rad_s2));
    let stiffness = w.stiffness_law.iter().map(|p| law(p.yaw_deg, p.moment_rad_s2, p.u_rad_s2));
    let frequency = w
        .frequency
        .iter()
        .filter(|f| f.share >= 0.005)
        .map(|f| (format!("{:.3}", f.hz), f.share, format!("{:.1}", 100.0 * f.share)));
    let (unit, of) = (measurand.unit(), measurand.coordinate_unit());
    let (residual, amplitude) = (format!("residual ({unit})"), format!("amplitude ({of})"));
    let (rate, moment) = (measurand.rate_unit(), measurand.parameter_unit("rad/s2"));
    let (word, moment) = (measurand.word(), format!("missing moment ({moment})"));
    let mut windows = bare(&[&amplitude, "wn (rad/s)", "zeta"]);
    for w in &a.windows {
        windows.add_row([
            sized(measurand, w.amplitude_deg, 3),
            format!("{:.4}", w.natural_frequency_rad_s),
            format!("{:.5}", w.damping_ratio),
        ]);
    }
    [
        rows(["time (s)", &residual], time.collect()),
        rows([&amplitude, &residual], by_amplitude.collect()),
        rows([&format!("rate at zero {word} ({rate})"), &moment], damping.collect()),
        rows([&format!("{word} at zero rate ({of})"), &moment], stiffness.collect()),
        rows(["frequency (Hz)", "share of the residual (%)"], frequency.collect()),
        windows,
    ]
}

/// Length of the longest bar.
const BAR: f64 = 30.0;
