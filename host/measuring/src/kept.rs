//! What is kept of a campaign that is being measured: its file in the folder of the records.

use super::parts::{by_records, head};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_campaign::simulated::CAMPAIGN_FILE;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::campaign::{Campaign, ReleaseEntry};
use yawrig_core::derivatives::condition::Identified;

#[derive(Debug)]
pub(super) struct Kept {
    /// Those that were in the folder before, by their records.
    pub(super) before: Vec<(ReleaseEntry, Identified)>,
    /// What is written: the releases that have a record, those that were there before first.
    pub(super) campaign: Campaign,
    file: Option<PathBuf>,
}

impl Kept {
    /// What is there of `wanted`.
    ///
    /// # Errors
    /// Exit 3 where another campaign is in the folder.
    pub(super) fn new(wanted: &Campaign, folder: Option<&Path>) -> Result<Self> {
        let (mut campaign, mut before) = (head(wanted), Vec::new());
        let file = folder.map(|folder| folder.join(CAMPAIGN_FILE));
        if let Some(file) = file.as_ref().filter(|file| file.exists()) {
            let there = CampaignFile::read_releases(file)?;
            before = by_records(&there)?;
            let CampaignFile { campaign: there, .. } = there;
            campaign.rig.clock_u_ppm = campaign.rig.clock_u_ppm.or(there.rig.clock_u_ppm);
            if head(&there) != campaign {
                return Err(Error::data(format!(
                    "{} is of another model, air or rig than this campaign",
                    file.display()
                ))
                .help("record into another folder"));
            }
            campaign = there;
        }
        Ok(Self { before, campaign, file })
    }

    /// The campaign's file that is being made.
    pub(super) fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// The file has this release from now on.
    pub(super) fn list(&mut self, entry: ReleaseEntry) -> Result<()> {
        self.campaign.release.push(entry);
        self.write()
    }

    /// Takes the last release made as `entry` says out of the file, where that lists it.
    pub(super) fn unlist(&mut self, entry: &ReleaseEntry) -> Result<()> {
        let mut listed = self.campaign.release.iter().skip(self.before.len());
        let same = listed.rposition(|r| {
            (&r.spring, r.axis, &r.at, r.wind_speed_m_s)
                == (&entry.spring, entry.axis, &entry.at, entry.wind_speed_m_s)
        });
        let Some(at) = same else { return Ok(()) };
        self.campaign.release.remove(self.before.len() + at);
        self.write()
    }

    fn write(&self) -> Result<()> {
        let Some(path) = &self.file else { return Ok(()) };
        let text = toml::to_string(&self.campaign)
            .map_err(|e| Error::internal(format!("cannot write {}: {e}", path.display())))?;
        files::write_atomically(path, text.as_bytes())
    }
}
