//! Figs 4.22 and 4.23: responses computed back from the derivatives against the records.

use super::report::{times, Outcome, Table};
use super::rig_records;
use super::setting::{Size, StudySetting};
use yawrig_base::error::{Error, Result};
use yawrig_campaign::CampaignFile;
use yawrig_campaign::{evaluate, simulated};
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;
use yawrig_report::plot::{Axis as PlotAxis, Curve, Plot};
use yawrig_rig::{End, Rig, Sensor, Start};
use yawrig_shared::axis::Axis;

const METHODS: [(Method, &str); 3] = [
    (Method::Conventional, "conventional"),
    (Method::Network, "network"),
    (Method::LeastSquares, "least squares"),
];
const WIND_SPEED_M_S: f64 = 10.0;

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let rig = Rig::default();
    let mut tables = Vec::new();
    let mut plots = Vec::new();
    let mut findings = vec![
        "Thesis: the mean squared error of both methods lies below 3.5 (Fig 4.22's axis), the network's on average \
         below the conventional method's. It leaves out what the sensor alone would leave."
            .into(),
    ];
    for (name, vary) in [("linear rig", false), ("softening springs and drag", true)] {
        let mut planned = simulated::plan(&rig, WIND_SPEED_M_S, 1, 3)?;
        if setting.size == Size::Quick {
            planned.retain(|p| ["K4", "K5"].contains(&p.condition.spring.name));
        }
        for record in &mut planned {
            if vary {
                let off = yawrig_rig::Condition { wind_speed_m_s: 0.0, ..record.condition };
                record.effects = rig_records::effects(&rig.modal(&off)?)?;
            }
        }
        let folder = tempfile::tempdir()
            .map_err(|e| Error::internal(format!("no folder for temporary files: {e}")))?;
        (setting.progress)(&format!("validation: releases of the {name}"));
        let end = End::Below { amplitude_deg: 0.8, at_most_s: 90.0 };
        let start = Start { end, ..Start::default() };
        let sensor = Sensor::default();
        let file = simulated::write(folder.path(), &rig, &planned, &start, &sensor, true)?;
        let campaign = CampaignFile::read(&file)?;
        let found: Vec<table::Table> = METHODS
            .iter()
            .map(|(method, title)| {
                (setting.progress)(&format!("validation: {name}, {title}"));
                evaluate(&campaign, title, &|record: &Record| {
                    let found = identify(record, &[*method], &Settings::default())?;
                    Identified::from_identification(found)
                        .ok_or_else(|| Error::internal("no answer"))
                })
            })
            .collect::<Result<_>>()?;
        tables.push(errors_table(name, &rig, &found, sensor.noise_deg));
        let curves = METHODS.iter().zip(&found).map(|((_, title), table)| {
            Curve::line(*title, of_mid(table).map(|(km, mse, _)| (km, mse)).collect())
        });
        let noise = sensor.noise_deg.powi(2);
        let ends: Vec<(f64, f64)> = of_mid(&found[0]).map(|(km, _, _)| (km, noise)).collect();
        let means: Vec<f64> = found
            .iter()
            .map(|t| {
                let all: Vec<f64> = of_mid(t).map(|(_, mse, _)| mse).collect();
                all.iter().sum::<f64>() / all.len() as f64
            })
            .collect();
        let said: Vec<String> = METHODS
            .iter()
            .zip(&means)
            .map(|((_, title), mean)| format!("{title} {mean:.4} deg^2 ({})", times(*mean, noise)))
            .collect();
        findings.push(format!(
            "{name}: on average {}; the sensor's noise alone, to which the brackets refer, leaves {noise:.4}.",
            said.join(", ")
        ));
        plots.push(Plot {
            title: format!("Computed response against record, {name} (Fig 4.22)"),
            x: PlotAxis::linear("reduced frequency"),
            y: PlotAxis::logarithmic("mean squared error, deg^2"),
            curves: curves.chain([Curve::dashed("sensor noise alone", ends)]).collect(),
        });
    }
    Ok(Outcome { tables, findings, plots })
}

/// Reduced frequency, validation error and point of each spring at the middle axis.
fn of_mid(table: &table::Table) -> impl Iterator<Item = (f64, f64, &table::Point)> {
    table.points.iter().filter_map(|point| {
        let row = table
            .releases
            .iter()
            .find(|r| r.spring == point.spring && r.axis == Axis::Mid && r.wind_speed_m_s > 0.0)?;
        Some((point.reduced_frequency, row.validation_mse_deg2?, point))
    })
}

fn errors_table(name: &str, rig: &Rig, found: &[table::Table], noise_deg: f64) -> Table {
    let mut table = Table::new(
        format!(
            "{name}: validation MSE in deg^2 (noise alone {:.4}), and Cn_beta and Cn_r less what was planted, %",
            noise_deg * noise_deg
        ),
        &["spring", "km", "conv.", "network", "least sq.", "Cn_beta conv.", "network", "least sq.", "Cn_r conv.", "network", "least sq."],
    );
    let columns: Vec<Vec<_>> = found.iter().map(|t| of_mid(t).collect()).collect();
    for i in 0..columns.iter().map(Vec::len).min().unwrap_or(0) {
        let (km, _, point) = columns[0][i];
        let Some(spring) = yawrig_rig::SPRINGS.into_iter().find(|s| s.name == point.spring) else {
            continue;
        };
        let truth = rig.truth(&spring);
        let mut row = vec![point.spring.clone(), format!("{km:.2}")];
        row.extend(columns.iter().map(|c| format!("{:.4}", c[i].1)));
        let off = |value: f64, truth: f64| format!("{:+.1}", 100.0 * (value / truth - 1.0));
        row.extend(columns.iter().map(|c| off(c[i].2.cn_beta.value, truth.cn_beta)));
        row.extend(columns.iter().map(|c| off(c[i].2.cn_r.value, truth.cn_r)));
        table.row(row);
    }
    table
}
