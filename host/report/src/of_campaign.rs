//! The report of a campaign: its derivatives, and what the joint fit of its releases lacks.

use super::answer::refuses;
use super::criticism::{candidates, effects, pairs, status, steps, verdict, SECOND_ORDER};
use super::of_records::{analysis, blank, drawn_release, method_name, over_noise, with_effects};
use super::{
    beside, Criticism, Estimate, Kind, Made, PointReport, ReleaseReport, Report, SettingRow,
    SourceFile, TRACE_NUMBERS,
};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_campaign::diagnose;
use yawrig_campaign::evaluate;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::Table;
use yawrig_core::diagnosis::diagnose::{Diagnosed, Options};
use yawrig_core::fit::fitting::Fitted;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;
use yawrig_shared::axis::Axis;

/// How it is analysed, and what else is asked for.
pub struct Also<'a> {
    pub settings: &'a Settings,
    pub options: &'a Options,
    /// Another campaign, or its report.
    pub beside: Option<&'a Path>,
}

/// The report of the campaign at `path`.
///
/// # Errors
/// Those of [`evaluate`] and [`diagnose`].
pub fn of_campaign(path: &Path, also: &Also, made: Made) -> Result<Report> {
    let Also { settings, options, beside } = *also;
    let identified = |record: &Record| {
        Identified::from_identification(identify(record, &[Method::LeastSquares], settings)?)
            .ok_or_else(|| Error::internal(format!("{}: no estimate", record.file.display())))
    };
    let method = method_name(Method::LeastSquares);
    let beside = beside.map(|path| beside::read(path, method, &identified)).transpose()?;
    let file = CampaignFile::read(path)?;
    let count = file.campaign.release.len();
    yawrig_base::say!("{count} releases: identifying them");
    let table = evaluate(&file, method, &identified)?;
    yawrig_base::say!("{count} releases: looking for what they lack");
    let diagnosed = diagnose(&file, options)?;
    let mut report = Report::new(Kind::Campaign, path.display().to_string(), made);
    report.settings = analysis(settings);
    let campaign = &file.campaign;
    report.settings.extend([
        SettingRow::new("campaign", path.display(), ""),
        SettingRow::new("model", &campaign.model.name, ""),
        SettingRow::new("length", campaign.model.length_m, "m"),
        SettingRow::new("frontal area", campaign.model.frontal_area_m2, "m²"),
        SettingRow::new("air density", campaign.air.density_kg_m3, "kg/m³"),
        SettingRow::new("spring arm", campaign.rig.spring_arm_m, "m"),
        SettingRow::new("axis offset", campaign.rig.axis_offset_m, "m"),
    ]);
    report.sources.push(SourceFile::new(path)?);
    let inertia = [(Axis::Mid, table.inertia_kg_m2.mid), (Axis::Front, table.inertia_kg_m2.front)];
    report.inertia_kg_m2 = inertia.into_iter().filter_map(|(a, q)| Some((a, q?))).collect();
    report.points = table.points.iter().map(PointReport::from).collect();
    let d = &diagnosed.diagnosis;
    report.verdict = verdict(d);
    if let (Some(derivatives), false) = (&d.derivatives, d.effects.is_empty()) {
        report.points_before = derivatives.before.iter().map(PointReport::from).collect();
        report.points = derivatives.after.iter().map(PointReport::from).collect();
    }
    report.beside = beside;
    report.title = campaign.model.name.clone();
    report.doubts = table.doubts.clone();
    report.assumed_zero = table.assumed_zero.clone();
    report.springs = table.springs.clone();
    report.critical_speed = table.critical_speed.clone().unwrap_or_default();
    report.notes.extend(table.notes.iter().cloned());
    report.criticism = Some(criticism(&diagnosed));
    for index in 0..count {
        interrupt::check()?;
        report.sources.push(SourceFile::new(&file.record_path(index))?);
        report.releases.push(release(&file, options, &diagnosed, &table, index)?);
    }
    Ok(report)
}

/// The report of a table, for its drawing.
pub fn of_table(table: &Table) -> Report {
    let points = table.points.iter().map(PointReport::from).collect();
    let made = Made::now(String::new());
    let critical_speed = table.critical_speed.clone().unwrap_or_default();
    Report { points, critical_speed, ..Report::new(Kind::Campaign, table.model.clone(), made) }
}

fn criticism(diagnosed: &Diagnosed) -> Criticism {
    let d = &diagnosed.diagnosis;
    let values = d.steps.last().map(|s| s.parameters.clone()).unwrap_or_default();
    let mut effects = effects(&d.said.measurand(), &d.effects, &values);
    for effect in &mut effects {
        let origin = d.origin.get(&effect.id).map(ToString::to_string);
        effect.origin = origin.zip(d.origin_reason.get(&effect.id).cloned()).map(|(a, b)| [a, b]);
    }
    Criticism {
        said: d.said.clone(),
        status: Some(status(d.status)),
        sentences: Vec::new(),
        steps: steps(&d.steps, SECOND_ORDER),
        held_out: d.held_out.words().to_owned(),
        candidates: candidates(&d.candidates),
        effects,
        indistinguishable: pairs(&d.indistinguishable),
        wheres: vec![("the final model".to_owned(), d.where_.clone())],
        where_file: d.where_release.clone(),
    }
}

fn release(
    file: &CampaignFile,
    options: &Options,
    diagnosed: &Diagnosed,
    table: &Table,
    index: usize,
) -> Result<ReleaseReport> {
    let entry = &file.campaign.release[index];
    let record = file.record(index)?;
    let (decay, last) = (&diagnosed.decays[index], diagnosed.last(index));
    let plain = &diagnosed.path[0][index];
    let with = with_effects(last);
    let mut models: Vec<(&str, &Fitted)> = vec![(SECOND_ORDER, plain)];
    if !last.structure.effects.is_empty() {
        models.push((&with, last));
    }
    let row = &table.releases[index].identified;
    let verdict = &diagnosed.diagnosis.releases[index];
    let estimates = vec![
        Estimate {
            method: method_name(Method::LeastSquares).to_owned(),
            natural_frequency_rad_s: row.natural_frequency_rad_s,
            damping_ratio: row.damping_ratio,
            residual_rms_deg: None,
            residual_over_noise: Some(over_noise(
                decay,
                row.natural_frequency_rad_s.value,
                row.damping_ratio.value,
                options.zero_unknown,
            )),
            refused: refuses(diagnosed.diagnosis.status, verdict.explained, last),
            remarks: row.flags.iter().map(|f| f.reason().to_owned()).collect(),
        },
        Estimate {
            method: "the final model".to_owned(),
            natural_frequency_rad_s: verdict.modal.natural_frequency_rad_s,
            damping_ratio: verdict.modal.damping_ratio,
            residual_rms_deg: None,
            residual_over_noise: None,
            refused: false,
            remarks: Vec::new(),
        },
    ];
    let mut condition =
        format!("{}, {} axis, {} m/s", entry.spring, entry.axis, rounded(entry.wind_speed_m_s));
    if !entry.at.is_empty() {
        condition += &format!(", {}", entry.at);
    }
    let name = format!("{} ({condition})", entry.file);
    let numbers = TRACE_NUMBERS / diagnosed.decays.len();
    let release = ReleaseReport { estimates, condition: Some(condition), ..blank(name) };
    Ok(drawn_release(&record, decay, &models, &models, numbers, release))
}

/// A wind speed as it is shown: one that was computed has no end of digits.
fn rounded(speed_m_s: f64) -> f64 {
    (speed_m_s * 1e3).round() / 1e3
}
