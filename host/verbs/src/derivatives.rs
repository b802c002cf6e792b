//! `derivatives`: a campaign of releases to the table of aerodynamic derivatives.

use super::common::{bare, print_json, print_line, wrapped, AnalysisArgs};
use super::critical_speed;
use super::csv;
use super::identify::MethodChoice;
use super::transfer::{Reported, TransferArgs, Transfers};
use super::typeset::Typeset;
use crate::answer::{Answer, Drawn, Progress};
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use yawrig_base::error::{Error, Result};
use yawrig_campaign::doubted;
use yawrig_campaign::evaluate;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::at::At;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::{ByAxis, InertiaLine, InertiaOrigin, Point, Table};
use yawrig_core::diagnosis::wind::Dimensionless;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{identify, Method};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Record;
use yawrig_model::derived::{self, OfModel};
use yawrig_text::quoted;

/// Aerodynamic derivatives of a campaign, with uncertainties, budget and validation.
///
/// The campaign's file says under what each record was made. Uncertainties it does not give are taken as zero
/// and listed. Each wind-on record is compared with the response computed back from the derivatives.
#[derive(Args, Debug, Clone)]
pub struct Derivatives {
    /// The campaign's file
    #[arg(value_name = "campaign.toml")]
    pub campaign: PathBuf,
    /// How natural frequency and damping are identified in a record; several, separated by commas, to compare
    /// them
    #[arg(long, value_delimiter = ',', value_enum, default_value = "least-squares")]
    pub method: Vec<MethodChoice>,
    /// By a model that was fitted to the campaign, whose effects are then no part of the derivatives
    #[arg(short, long, value_name = "MODEL", conflicts_with = "method")]
    pub model: Option<PathBuf>,
    #[command(flatten)]
    pub analysis: AnalysisArgs,
    #[command(flatten)]
    pub transfer: TransferArgs,
    /// Print CSV, a row for each point and method, units in the header
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
    /// Print the table for another document
    #[arg(long, value_name = "KIND", value_enum, conflicts_with_all = ["csv", "json"])]
    pub table: Option<Typeset>,
    /// Print one JSON object; the tables of further methods under "others"
    #[arg(short, long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Tables {
    #[serde(flatten)]
    first: Reported,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    others: Vec<Reported>,
}

impl Derivatives {
    pub fn run(&self) -> Result<()> {
        let file = self.file()?;
        let mut tables = self.tables(&file, &|_, _| {})?;
        let written = self.written(&file, &tables[0])?;
        if self.csv {
            return csv::derivatives(&tables);
        }
        if let Some(kind) = self.table {
            let all: Vec<String> = tables.iter().map(|of| kind.of(&of.table)).collect();
            return print_line(all.join("\n\n").trim_end());
        }
        if !self.json {
            let mut all = Vec::new();
            for (k, Reported { table, transfers, dimensionless }) in tables.iter().enumerate() {
                all.push(text(table));
                all.extend(of_effects(dimensionless));
                let written = if k == 0 { &written[..] } else { &[] };
                all.extend(transfers.as_ref().map(|t| t.text(&file, table, written)));
            }
            return print_line(&all.join("\n\n"));
        }
        let first = tables.remove(0);
        print_json(&Tables { first, others: tables })
    }

    /// Of the first method, where a folder is given.
    fn written(&self, file: &CampaignFile, first: &Reported) -> Result<Vec<PathBuf>> {
        match (&self.transfer.out, &first.transfers) {
            (Some(folder), Some(transfers)) => transfers.write(folder, file, &first.table),
            _ => Ok(Vec::new()),
        }
    }
}

impl Derivatives {
    /// What was asked for is checked before it is read.
    fn file(&self) -> Result<CampaignFile> {
        self.analysis.settings()?;
        CampaignFile::read(&self.campaign)
    }

    fn tables(&self, file: &CampaignFile, progress: &Progress) -> Result<Vec<Reported>> {
        if let Some(model) = &self.model {
            let OfModel { table, dimensionless } = derived::of_model(file, model)?;
            return Ok(vec![Reported { dimensionless, ..self.reported(file, table)? }]);
        }
        let settings = self.analysis.settings()?;
        let methods: Vec<Method> =
            self.method.iter().flat_map(|choice| choice.methods()).copied().collect();
        let all = methods.len() * file.campaign.release.len();
        let done = AtomicUsize::new(0);
        let mut tables = Vec::new();
        for method in methods {
            let table = evaluate(file, &name(method)?, &|record: &Record| {
                let found = identify(record, &[method], &settings)?;
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, all);
                Identified::from_identification(found).ok_or_else(|| {
                    Error::internal(format!("{}: no estimate", record.file.display()))
                })
            })?;
            tables.push(self.reported(file, table)?);
        }
        Ok(tables)
    }

    fn reported(&self, file: &CampaignFile, table: Table) -> Result<Reported> {
        let transfer = self.transfer.transfer;
        let transfers = transfer.then(|| Transfers::new(file, &table)).transpose()?;
        Ok(Reported { table, transfers, dimensionless: BTreeMap::new() })
    }

    /// The answer that `--json` prints.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, progress: &Progress) -> Result<Answer> {
        let mut tables = self.tables(&self.file()?, progress)?;
        let (first, others) = (tables.remove(0), tables);
        let table = &first.table;
        let sentence =
            format!("{} by {}: {} points", table.model, table.method, table.points.len());
        let drawn = Drawn::Derivatives(Box::new(table.clone()));
        Ok(Answer::new(&Tables { first, others }, sentence)?.drawn_from(drawn))
    }
}

/// What a model's effects are as derivatives.
fn of_effects(dimensionless: &BTreeMap<String, Dimensionless>) -> Option<String> {
    let line =
        |(effect, d): (&String, &Dimensionless)| format!("{} {} ({effect})", d.name, d.quantity);
    let lines: Vec<String> = dimensionless.iter().map(line).collect();
    let head = "Effects of the air as dimensionless derivatives, about the middle axis:";
    (!lines.is_empty()).then(|| format!("{head}\n  {}", lines.join("\n  ")))
}

/// The method's name as it is in files.
fn name(method: Method) -> Result<String> {
    match serde_json::to_value(method) {
        Ok(serde_json::Value::String(name)) => Ok(name),
        other => Err(Error::internal(format!("a method without a name: {other:?}"))),
    }
}

/// The table as a reader wants it: what could make it wrong first.
fn text(table: &Table) -> String {
    let mut text =
        vec![format!("{} by {}, from {}", table.model, table.method, table.campaign.display())];
    text.extend(doubted::lines(&table.doubts));
    text.extend(wrapped(&assumptions(table), 80, "  "));
    text.extend(flags(table).iter().flat_map(|line| wrapped(line, 80, "  ")));
    text.extend(table.notes.iter().flat_map(|note| wrapped(&format!("Note: {note}"), 80, "  ")));
    text.extend([
        inertia_lines(table),
        String::new(),
        groups(table).join("\n\n"),
        "per rad, about the middle axis, with standard uncertainties (k = 1).".to_owned(),
        "Cn_r is the combined damping derivative Cn_r - Cn_betadot: in pure yaw the two".to_owned(),
        "are one motion. mse: record less the response computed from the derivatives,".to_owned(),
        "mean over both axes' releases, deg2.".to_owned(),
    ]);
    text.extend(critical_speed::lines(table.critical_speed.as_deref().unwrap_or_default()));
    text.extend(repeats(table));
    text.extend([
        String::new(),
        "Where the uncertainty comes from, in percent of the value:".to_owned(),
        budget_rows(table).trim_fmt(),
    ]);
    text.join("\n")
}

/// Which uncertainties nobody has given: the u below lacks them.
fn assumptions(table: &Table) -> String {
    match table.assumed_zero.is_empty() {
        true => "Every uncertainty of the instruments is stated.".to_owned(),
        false => format!(
            "Each u below is a lower bound; assumed zero: {}",
            table.assumed_zero.join(", ")
        ),
    }
}

/// What was remarked of releases: each remark once, with the releases, and where to look.
fn flags(table: &Table) -> Vec<String> {
    let mut said: Vec<(Flag, Vec<&str>)> = Vec::new();
    for release in &table.releases {
        for &flag in &release.identified.flags {
            match said.iter_mut().find(|(known, _)| *known == flag) {
                Some((_, files)) => files.push(&release.file),
                None => said.push((flag, vec![&release.file])),
            }
        }
    }
    let line = |(flag, files): (Flag, Vec<&str>)| {
        let which = match files.len() {
            n if n > 4 => format!("{n} of {} releases, {} first", table.releases.len(), files[0]),
            _ => files.join(", "),
        };
        let next = match flag {
            Flag::ResidualAboveNoise => {
                format!(
                    "; what is missing: yawrig diagnose {}",
                    quoted(&table.campaign.to_string_lossy())
                )
            }
            _ => String::new(),
        };
        format!("{which}: {}{next}", flag.reason())
    };
    said.into_iter().map(line).collect()
}

/// What was released several times: mean, scatter and number, and the scatter against what the fits state.
fn repeats(table: &Table) -> Vec<String> {
    let repeated: Vec<_> = table.conditions.iter().filter(|c| c.scatter.is_some()).collect();
    if repeated.is_empty() {
        return Vec::new();
    }
    let mut rows = bare(&[
        "spring", "axis", "V m/s", "n", "wn rad/s", "sd", "chi2/n-1", "zeta", "sd", "chi2/n-1",
    ]);
    for c in repeated {
        let Some(scatter) = &c.scatter else { continue };
        let chi = |chi: Option<f64>, birge: f64| {
            let widened = if birge > 1.0 { " w" } else { "" };
            chi.map_or("-".to_owned(), |chi| format!("{chi:.2}{widened}"))
        };
        let birge = c.birge_ratio.map_or([1.0; 2], |b| [b.natural_frequency, b.damping]);
        rows.add_row(vec![
            c.spring.clone(),
            c.axis.to_string(),
            format!("{:.4}", c.wind_speed_m_s)
                .trim_end_matches('0')
                .trim_end_matches('.')
                .to_owned(),
            c.repeats.to_string(),
            c.natural_frequency_rad_s.to_string(),
            format!("{:.2e}", scatter.natural_frequency_rad_s),
            chi(scatter.natural_frequency_chi_squared, birge[0]),
            c.damping_ratio.to_string(),
            format!("{:.2e}", scatter.damping_ratio),
            chi(scatter.damping_chi_squared, birge[1]),
        ]);
    }
    vec![
        String::new(),
        "Repeats: mean, standard deviation between releases, chi squared a degree of".to_owned(),
        "freedom against what the fits state (w: the mean's u is widened for it):".to_owned(),
        rows.trim_fmt(),
    ]
}

fn inertia_lines(table: &Table) -> String {
    let ByAxis { mid, front } = table.inertia_kg_m2;
    let axes = [
        ("middle", mid, table.inertia_origin.mid, table.inertia_line.mid),
        ("front", front, table.inertia_origin.front, table.inertia_line.front),
    ];
    let line = |(axis, inertia, origin, line): (&str, Option<Quantity>, _, Option<InertiaLine>)| {
        let inertia = inertia?;
        let origin = match (origin, line) {
            (_, Some(line)) => format!(
                "from {} springs,\n  Kr intercept {} N m/rad",
                line.springs, line.intercept_nm
            ),
            (Some(InertiaOrigin::Given), _) => "given in the campaign's file".to_owned(),
            _ => "from one spring,\n  other stiffness taken as zero".to_owned(),
        };
        Some(format!("Izz about the {axis} axis {inertia} kg m2 ({origin})"))
    };
    axes.into_iter().filter_map(line).collect::<Vec<_>>().join("\n")
}

/// The points, those of each setting by themselves; moments and side forces in a table each, for 80 columns.
fn groups(table: &Table) -> Vec<String> {
    let mut ats: Vec<&At> = Vec::new();
    for point in &table.points {
        if !ats.contains(&&point.at) {
            ats.push(&point.at);
        }
    }
    let one = |at: &At| {
        let points: Vec<&Point> = table.points.iter().filter(|point| point.at == *at).collect();
        let mut rows = vec![moment_rows(table, &points).trim_fmt()];
        if points.iter().any(|point| point.cy_beta.is_some()) {
            rows.extend([String::new(), force_rows(&points).trim_fmt()]);
        }
        if !at.is_empty() {
            rows.insert(0, format!("At {at}:"));
        }
        rows.join("\n")
    };
    ats.into_iter().map(one).collect()
}

fn speed(point: &Point) -> String {
    let text = format!("{:.4}", point.wind_speed_m_s);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn moment_rows(table: &Table, points: &[&Point]) -> comfy_table::Table {
    let mut rows = bare(&["spring", "V m/s", "km", "Cn_beta", "Cn_r - Cn_betadot", "mse deg²"]);
    for point in points {
        let mean = table.validation_mse_deg2(point);
        rows.add_row([
            point.spring.clone(),
            speed(point),
            format!("{:.3}", point.reduced_frequency),
            point.cn_beta.to_string(),
            point.cn_r.to_string(),
            if mean.is_nan() { "-".to_owned() } else { format!("{mean:.5}") },
        ]);
    }
    rows
}

fn force_rows(points: &[&Point]) -> comfy_table::Table {
    let mut rows = bare(&["spring", "V m/s", "km", "Cy_beta", "Cy_r"]);
    let shown = |quantity: Option<Quantity>| quantity.map_or("-".to_owned(), |q| q.to_string());
    for point in points {
        rows.add_row([
            point.spring.clone(),
            speed(point),
            format!("{:.3}", point.reduced_frequency),
            shown(point.cy_beta),
            shown(point.cy_r),
        ]);
    }
    rows
}

fn budget_rows(table: &Table) -> comfy_table::Table {
    let mut rows = bare(&[
        "spring", "", "all", "fit", "repeat", "inertia", "density", "wind", "geometry", "clock",
    ]);
    for point in &table.points {
        let budget = &point.budget;
        let lines = [
            ("Cn_beta", Some(point.cn_beta), Some(budget.cn_beta)),
            ("Cn_r", Some(point.cn_r), Some(budget.cn_r)),
            ("Cy_beta", point.cy_beta, budget.cy_beta),
            ("Cy_r", point.cy_r, budget.cy_r),
        ];
        for (name, quantity, budget) in lines {
            let (Some(quantity), Some(budget)) = (quantity, budget) else { continue };
            let percent = |u: f64| match 100.0 * u / quantity.value.abs() {
                0.0 => "0".to_owned(),
                share if share < 0.0005 => "<0.001".to_owned(),
                share => format!("{share:.3}"),
            };
            let mut row = vec![point.spring.clone(), name.to_owned(), percent(quantity.u)];
            row.extend(budget.sources().map(|(_, u)| percent(u)));
            rows.add_row(row);
        }
    }
    rows
}
