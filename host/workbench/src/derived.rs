//! The derivatives of a campaign from the natural frequencies and damping ratios of a model's steps.

use super::session::Standing;
use std::collections::BTreeMap;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::campaign::ReleaseEntry;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::Point;
use yawrig_core::derivatives::Computed;
use yawrig_core::quantity::Quantity;
use yawrig_model::document::MadeUnder;
use yawrig_model::journal::{Known, KnownModal};

type Modal = BTreeMap<String, KnownModal>;

/// Of the journal's last step without effects, and of its last step; none where there is no such step or no
/// point.
pub fn before_and_after(
    campaign: &CampaignFile,
    standing: &Standing,
) -> (Option<Vec<Point>>, Option<Vec<Point>>) {
    let mut steps = standing.steps.iter().rev();
    let after = steps.clone().find(|s| !s.modal.is_empty());
    let before = steps.find(|s| !s.modal.is_empty() && s.parameters.is_empty());
    let points = |modal: &Modal| points(campaign, modal);
    (
        before.and_then(|s| points(&s.modal)),
        after.filter(|s| !s.parameters.is_empty()).and_then(|s| points(&s.modal)),
    )
}

/// Of the releases whose condition is known.
fn points(campaign: &CampaignFile, modal: &Modal) -> Option<Vec<Point>> {
    let known = |entry: &ReleaseEntry| {
        let made = MadeUnder {
            spring: entry.spring.clone(),
            axis: entry.axis,
            wind_speed_m_s: entry.wind_speed_m_s,
        };
        modal.get(&made.condition()).copied()
    };
    let mut chosen = campaign.clone();
    chosen.campaign.release.clear();
    chosen.release_lines.clear();
    let mut identified = Vec::new();
    let releases = campaign.campaign.release.iter().zip(&campaign.release_lines);
    // Repeats share one fit: counted once, or they would look like repeats that agree by a miracle.
    let mut seen: Vec<String> = Vec::new();
    for (entry, line) in releases {
        let Some(found) = known(entry) else { continue };
        let condition = format!("{} {} {}", entry.spring, entry.axis, entry.wind_speed_m_s);
        if seen.contains(&condition) {
            continue;
        }
        seen.push(condition);
        chosen.campaign.release.push(entry.clone());
        chosen.release_lines.push(*line);
        let quantity = |k: Known| Quantity::new(k.value, k.u.unwrap_or(0.0));
        let [wn, zeta] = [found.natural_frequency_rad_s, found.damping_ratio].map(quantity);
        identified.push(Identified::new(wn, zeta, 0.0, 0.0));
    }
    let computed = Computed::new(&chosen.campaign, &identified).ok()?;
    let points = computed.table(&chosen.path, "model").points;
    (!points.is_empty()).then_some(points)
}
