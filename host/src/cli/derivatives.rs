//! `derivatives`: a campaign of releases to the table of aerodynamic derivatives.

use super::common::{bare, print_json, print_line, AnalysisArgs};
use super::csv;
use super::identify::MethodChoice;
use crate::campaign::evaluate;
use crate::campaign::CampaignFile;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use yawrig_base::error::{Error, Result};
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::{Budget, ByAxis, Table};
use yawrig_core::identify::{identify, Method};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Record;

/// Aerodynamic derivatives of a campaign, with uncertainties, budget and validation.
///
/// The campaign's file says under what each record was made. Uncertainties it does not give are taken as zero and
/// listed. Each wind-on record is compared with the response computed back from the derivatives.
#[derive(Args, Debug, Clone)]
pub struct Derivatives {
    /// The campaign's file
    #[arg(value_name = "campaign.toml")]
    pub campaign: PathBuf,
    /// How natural frequency and damping are identified in a record; several, separated by commas, to compare them
    #[arg(long, value_delimiter = ',', value_enum, default_value = "least-squares")]
    pub method: Vec<MethodChoice>,
    #[command(flatten)]
    pub analysis: AnalysisArgs,
    /// Print CSV, a row for each point and method, units in the header
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
    /// Print one JSON object; the tables of further methods under "others"
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Tables {
    #[serde(flatten)]
    first: Table,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    others: Vec<Table>,
}

impl Derivatives {
    pub fn run(&self) -> Result<()> {
        let settings = self.analysis.settings()?;
        let file = CampaignFile::read(&self.campaign)?;
        let mut tables = Vec::new();
        for &method in self.method.iter().flat_map(|choice| choice.methods()) {
            tables.push(evaluate(&file, &name(method)?, &|record: &Record| {
                let found = identify(record, &[method], &settings)?;
                Identified::of(found).ok_or_else(|| {
                    Error::internal(format!("{}: no estimate", record.file.display()))
                })
            })?);
        }
        if self.csv {
            return csv::derivatives(&tables);
        }
        if !self.json {
            return print_line(&tables.iter().map(text).collect::<Vec<_>>().join("\n\n"));
        }
        let first = tables.remove(0);
        print_json(&Tables { first, others: tables })
    }
}

/// The method's name as it is in files.
fn name(method: Method) -> Result<String> {
    match serde_json::to_value(method) {
        Ok(serde_json::Value::String(name)) => Ok(name),
        other => Err(Error::internal(format!("a method without a name: {other:?}"))),
    }
}

/// The table as a reader wants it.
fn text(table: &Table) -> String {
    let mut text = vec![
        format!("{} by {}, from {}", table.model, table.method, table.campaign.display()),
        inertia_lines(table),
        String::new(),
        point_rows(table).trim_fmt(),
        "per rad, about the middle axis, with standard uncertainties (k = 1).".to_owned(),
        "Cn_r is the combined damping derivative Cn_r - Cn_betadot: in pure yaw the two are one motion.".to_owned(),
        "mse: record less the response computed from the derivatives, mean over both axes' releases.".to_owned(),
    ];
    text.extend(table.notes.iter().map(|note| format!("Note: {note}")));
    text.extend([
        String::new(),
        "Where the uncertainty comes from, in percent of the value:".to_owned(),
        budget_rows(table).trim_fmt(),
    ]);
    if !table.assumed_zero.is_empty() {
        text.push(format!("Uncertainties assumed zero: {}", table.assumed_zero.join(", ")));
    }
    for release in &table.releases {
        for flag in &release.identified.flags {
            text.push(format!("{}: {}", release.file, flag.reason()));
        }
    }
    text.join("\n")
}

fn inertia_lines(table: &Table) -> String {
    let ByAxis { mid, front } = table.inertia_kg_m2;
    let lines =
        [("middle", mid, table.inertia_line.mid), ("front", front, table.inertia_line.front)];
    lines
        .into_iter()
        .filter_map(|(axis, inertia, line)| {
            let inertia = inertia?;
            let origin = match line {
                Some(line) => format!(
                    "from {} springs, Kr intercept {} N m/rad",
                    line.springs, line.intercept_nm
                ),
                None => "given, or from one spring".to_owned(),
            };
            Some(format!("Izz about the {axis} axis {inertia} kg m2 ({origin})"))
        })
        .collect::<Vec<_>>()
        .join("\n")
}

fn point_rows(table: &Table) -> comfy_table::Table {
    let mut rows = bare(&[
        "spring",
        "V m/s",
        "km",
        "Cn_beta",
        "Cn_r - Cn_betadot",
        "Cy_beta",
        "Cy_r",
        "mse deg²",
    ]);
    let shown = |quantity: Option<Quantity>| quantity.map_or("-".to_owned(), |q| format!("{q:.4}"));
    for point in &table.points {
        let errors: Vec<f64> = table
            .releases
            .iter()
            .filter(|r| r.spring == point.spring && r.wind_speed_m_s > 0.0)
            .filter(|r| {
                (r.wind_speed_m_s - point.wind_speed_m_s).abs() < 0.05 * point.wind_speed_m_s
            })
            .filter_map(|r| r.validation_mse_deg2)
            .collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        rows.add_row(vec![
            point.spring.clone(),
            format!("{:.4}", point.wind_speed_m_s)
                .trim_end_matches('0')
                .trim_end_matches('.')
                .to_owned(),
            format!("{:.3}", point.reduced_frequency),
            shown(Some(point.cn_beta)),
            shown(Some(point.cn_r)),
            shown(point.cy_beta),
            shown(point.cy_r),
            if errors.is_empty() { "-".to_owned() } else { format!("{mean:.5}") },
        ]);
    }
    rows
}

fn budget_rows(table: &Table) -> comfy_table::Table {
    let mut rows = bare(&[
        "spring",
        "",
        "all",
        "fit",
        "repeatability",
        "inertia",
        "air density",
        "wind speed",
        "geometry",
        "clock",
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
            let Budget { repeatability, fit, inertia, air_density, wind_speed, geometry, clock } =
                budget;
            let mut row = vec![point.spring.clone(), name.to_owned(), percent(quantity.u)];
            let sources = [fit, repeatability, inertia, air_density, wind_speed, geometry, clock];
            row.extend(sources.into_iter().map(percent));
            rows.add_row(row);
        }
    }
    rows
}
