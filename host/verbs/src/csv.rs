//! Results as CSV: one row a result, names and units in the header.

use super::common::print;
use super::transfer::Reported;
use std::fmt::Write as _;
use yawrig_base::error::Result;
use yawrig_campaign::doubted;
use yawrig_core::derivatives::at::At;
use yawrig_core::derivatives::table::{Point, Table};
use yawrig_core::diagnosis::diagnose::Diagnosis;
use yawrig_core::identify::Identification;
use yawrig_core::quantity::Quantity;
use yawrig_model::journal::JournalStep;
use yawrig_shared::axis::Axis;

/// A row, its cells quoted where they have to be.
fn row(cells: impl IntoIterator<Item = String>) -> String {
    let mut line = String::new();
    for (k, cell) in cells.into_iter().enumerate() {
        if k > 0 {
            line.push(',');
        }
        match cell.contains([',', '"', '\n']) {
            true => drop(write!(line, "\"{}\"", cell.replace('"', "\"\""))),
            false => line.push_str(&cell),
        }
    }
    line.push('\n');
    line
}

/// A number as JSON has it; an empty cell for what is not known.
fn number(x: f64) -> String {
    if x.is_finite() {
        format!("{x}")
    } else {
        String::new()
    }
}

fn quantity(q: Option<Quantity>) -> [String; 2] {
    q.map_or([String::new(), String::new()], |q| [number(q.value), number(q.u)])
}

/// A name as it stands in JSON.
fn name(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

/// Columns that end in `_deg` are in `unit`, those of amplitudes in `amplitude_unit`, where these are given.
pub const IDENTIFIED: &str =
    "file,method,natural_frequency_rad_s,natural_frequency_u_rad_s,damping_ratio,damping_ratio_u,\
    residual_rms_deg,noise_rms_deg,from_deg,to_deg,cycles,release_time_s,rate_hz,flags,quantity,unit,amplitude_unit\n";

/// A row for each method.
pub fn identified(found: &Identification) -> String {
    let rows = found.estimates.iter().map(|e| {
        let [wn, wn_u] = quantity(Some(e.natural_frequency_rad_s));
        let [zeta, zeta_u] = quantity(Some(e.damping_ratio));
        let flags: Vec<String> = e.flags.iter().map(name).collect();
        let w = &found.window;
        let numbers = [
            e.residual_rms_deg,
            found.noise_rms_deg,
            w.from_deg,
            w.to_deg,
            w.cycles,
            found.release_time_s,
            found.rate_hz,
        ];
        let first = [found.file.clone(), name(&e.method), wn, wn_u, zeta, zeta_u];
        let said = &found.said;
        let units = [&said.quantity, &said.unit, &said.amplitude_unit];
        let units = units.map(|unit| unit.clone().unwrap_or_default());
        row(first.into_iter().chain(numbers.map(number)).chain([flags.join(" ")]).chain(units))
    });
    rows.collect()
}

/// A row for each point and method; where they were asked for with what the transfer function has there.
pub fn derivatives(tables: &[Reported]) -> Result<()> {
    let mut out = "method,spring,wind_speed_m_s,reduced_frequency,cn_beta_per_rad,cn_beta_u_per_rad,cn_r_per_rad,\
        cn_r_u_per_rad,cy_beta_per_rad,cy_beta_u_per_rad,cy_r_per_rad,cy_r_u_per_rad,validation_mse_deg2,\
        critical_speed_m_s,critical_speed_u_m_s,damping_ratio_at_rest,damping_ratio_at_rest_u,limit_cycle_deg,\
        limit_cycle_u_deg,flags,doubts,assumed_zero,notes"
        .to_owned();
    let names = At::names(tables.iter().flat_map(|of| &of.table.points).map(|point| &point.at));
    out += &names.iter().map(|name| format!(",{name}")).collect::<String>();
    let transfer = tables.iter().any(|of| of.transfers.is_some());
    if transfer {
        out += ",transfer_cn_beta_per_rad,transfer_cn_beta_u_per_rad,transfer_cn_r_per_rad,transfer_cn_r_u_per_rad,\
            transfer_lags,transfer_parameters";
    }
    out.push('\n');
    for Reported { table, transfers, .. } in tables {
        for point in &table.points {
            let Point {
                spring,
                wind_speed_m_s,
                reduced_frequency,
                cn_beta,
                cn_r,
                cy_beta,
                cy_r,
                ..
            } = point;
            let first = [
                table.method.clone(),
                spring.clone(),
                number(*wind_speed_m_s),
                number(*reduced_frequency),
            ];
            let quantities = [Some(*cn_beta), Some(*cn_r), *cy_beta, *cy_r].map(quantity);
            let flags = table.releases_of(point).into_iter().flat_map(|release| {
                let of = |flag| format!("{}:{}", release.file, name(flag));
                release.identified.flags.iter().map(of)
            });
            let quantities = quantities.into_iter().flatten();
            let numbers = quantities.chain([number(table.validation_mse_deg2(point))]);
            let critical = critical(table, point).map(quantity).into_iter().flatten();
            let last = [
                flags.collect::<Vec<_>>().join(" "),
                table.doubts.iter().map(doubted::line).collect::<Vec<_>>().join("; "),
                table.assumed_zero.join(" "),
                table.notes.join("; "),
            ];
            let at = names.iter().map(|name| point.at.shown(name));
            let cells = first.into_iter().chain(numbers).chain(critical).chain(last);
            let fitted = transfers.as_ref().map(|all| all.cells(point));
            let fitted = fitted.into_iter().flat_map(|found| match found {
                Some((at, lags, numbers)) => {
                    let columns = [at.cn_beta, at.cn_r].map(|q| quantity(Some(q))).into_iter();
                    columns.flatten().chain([lags.to_string(), numbers]).collect()
                }
                None => vec![String::new(); 6],
            });
            out += &row(cells.chain(at).chain(fitted));
        }
    }
    print(&out)
}

/// About the middle axis, as the point: the speed from which on it swings by itself, the damping ratio at rest at
/// the point's own speed and the amplitude that it goes to there.
fn critical(table: &Table, point: &Point) -> [Option<Quantity>; 3] {
    let mut all = table.critical_speed.iter().flatten();
    let its = all.find(|c| (&c.spring, c.axis, &c.at) == (&point.spring, Axis::Mid, &point.at));
    let Some(its) = its else { return [None; 3] };
    let row = its.rows().into_iter().find(|row| row.0 == point.wind_speed_m_s);
    let (zeta, cycle) = row.map_or((None, None), |(_, zeta, cycle)| (zeta, cycle));
    [Some(its.wind_speed_m_s), zeta, cycle]
}

/// A row for each model that was gone through, the last being the answer.
pub fn diagnosed(what: &str, diagnosis: &Diagnosis) -> Result<()> {
    let Diagnosis { status, steps, said, .. } = diagnosis;
    let mut out =
        "of,status,added,residual_rms_deg,residual_over_noise,held_out_over_noise,parameters,quantity,unit\n"
            .to_owned();
    for step in steps {
        let parameters: Vec<String> = step
            .parameters
            .iter()
            .map(|(name, q)| format!("{name}={}+-{}", number(q.value), number(q.u)))
            .collect();
        out += &row([
            what.to_owned(),
            name(status),
            step.added.as_ref().map_or(String::new(), ToString::to_string),
            number(step.residual_rms_deg),
            number(step.residual_over_noise),
            number(step.held_out_over_noise),
            parameters.join(" "),
            said.quantity.clone().unwrap_or_default(),
            said.unit.clone().unwrap_or_default(),
        ]);
    }
    print(&out)
}

/// A row for each step.
pub fn history(steps: &[JournalStep]) -> Result<()> {
    let mut out = "step,time_utc,action,effect,residual_rms_deg,residual_over_noise,held_out_over_noise,why\n".to_owned();
    for step in steps {
        let effect = step.added.as_ref().or(step.removed.as_ref()).or(step.rejected.as_ref());
        let after = step.after.map_or([f64::NAN; 3], |r| {
            [r.residual_rms_deg, r.residual_over_noise, r.held_out_over_noise]
        });
        let first = [
            step.step.to_string(),
            step.time_utc.clone(),
            name(&step.action),
            effect.cloned().unwrap_or_default(),
        ];
        let why = step.why.clone().unwrap_or_default();
        out += &row(first.into_iter().chain(after.map(number)).chain([why]));
    }
    print(&out)
}
