//! What a campaign that is being measured is made of: its head, the releases that are there, conditions, its
//! table in lines.

use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_campaign::doubted;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::campaign::{Campaign, ReleaseEntry};
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::Table;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{rig_id, Condition};

/// A campaign without its releases.
pub(super) fn head(campaign: &Campaign) -> Campaign {
    Campaign { release: Vec::new(), ..campaign.clone() }
}

/// The releases of a campaign that is there, by least squares.
pub(super) fn by_records(file: &CampaignFile) -> Result<Vec<(ReleaseEntry, Identified)>> {
    let one = |(index, entry): (usize, &ReleaseEntry)| {
        let record = file.record(index)?;
        let found = identify(&record, &[Method::LeastSquares], &Settings::default())?;
        let nothing = || Error::internal(format!("{}: no estimate", record.file.display()));
        Ok((entry.clone(), Identified::from_identification(found).ok_or_else(nothing)?))
    };
    file.campaign.release.iter().enumerate().map(one).collect()
}

/// The condition of this release as the device takes it.
pub(super) fn condition(
    campaign: &Campaign,
    entry: &ReleaseEntry,
    inertia_kg_m2: Option<f64>,
) -> Condition {
    let model = &campaign.model;
    // The device holds a wind-on release against the wind-off ones of its rig: what a reference was made
    // under is of it.
    let reference = match entry.wind_speed_m_s {
        0.0 => &entry.at,
        _ => campaign.reference_of(entry).unwrap_or(&entry.at),
    };
    let mounted = match reference.is_empty() {
        true => entry.spring.clone(),
        false => format!("{}, {reference}", entry.spring),
    };
    Condition {
        rig: rig_id(&mounted, entry.axis.name()),
        wind: Wind {
            density_kg_m3: campaign.density_kg_m3(entry),
            speed_m_s: entry.wind_speed_m_s,
        },
        model: Model { length_m: model.length_m, frontal_area_m2: model.frontal_area_m2 },
        inertia_kg_m2: inertia_kg_m2.unwrap_or(0.0),
    }
}

/// The table in lines.
pub(super) fn text(table: &Table, file: Option<&Path>) -> String {
    let mut lines = doubted::lines(&table.doubts);
    lines.extend([
        "derivatives by the device's estimates, per rad, about the middle axis:".to_owned()
    ]);
    for point in &table.points {
        let mut line = format!(
            "  {} at {} m/s, reduced frequency {:.3}: Cn_beta {}, Cn_r {}",
            point.spring, point.wind_speed_m_s, point.reduced_frequency, point.cn_beta, point.cn_r
        );
        if let (Some(cy_beta), Some(cy_r)) = (point.cy_beta, point.cy_r) {
            line.push_str(&format!(", Cy_beta {cy_beta}, Cy_r {cy_r}"));
        }
        lines.push(line);
    }
    if let Some(file) = file {
        lines.push(format!("from the records: yawrig derivatives {}", file.display()));
    }
    lines.join("\n")
}
