//! The condition that a record was made under, as the campaign beside it says.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::campaign::ReleaseEntry;

/// The name of a campaign's file in the folder of its records.
const CAMPAIGN: &str = "campaign.toml";

/// What campaigns say, each read once.
#[derive(Clone, Debug, Default)]
pub(super) struct Conditions {
    /// By the folder of the campaign, the condition of each record.
    known: HashMap<PathBuf, HashMap<PathBuf, String>>,
}

impl Conditions {
    /// `None` where no campaign lies in the record's folder or in the one above, or none names it.
    pub(super) fn of(&mut self, record: &Path) -> Option<String> {
        record.ancestors().skip(1).take(2).find_map(|folder| {
            let known = self.known.entry(folder.to_owned());
            known.or_insert_with(|| read(&folder.join(CAMPAIGN))).get(record).cloned()
        })
    }
}

/// Nothing where it is not there; where it cannot be read that is said, and the records go without.
fn read(path: &Path) -> HashMap<PathBuf, String> {
    if !path.is_file() {
        return HashMap::new();
    }
    match CampaignFile::read_listed(path) {
        Ok(file) => {
            let each = file.campaign.release.iter().enumerate();
            each.map(|(k, release)| (file.record_path(k), condition(release))).collect()
        }
        Err(error) => {
            yawrig_base::say!("yawrig: conditions are not known: {error}");
            HashMap::new()
        }
    }
}

fn condition(release: &ReleaseEntry) -> String {
    let ReleaseEntry { spring, axis, wind_speed_m_s, at, .. } = release;
    let wind = match *wind_speed_m_s {
        0.0 => "wind off".to_owned(),
        wind => format!("{wind} m/s"),
    };
    let under = if at.is_empty() { String::new() } else { format!(", {at}") };
    format!("{spring}, {axis}, {wind}{under}")
}
