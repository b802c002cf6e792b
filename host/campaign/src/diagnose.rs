//! A campaign's records read and diagnosed as one.

use super::CampaignFile;
use rayon::prelude::*;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_base::message::Progress;
use yawrig_core::diagnosis::diagnose::{self as core, Diagnosed, Grouping, Options};
use yawrig_core::record::Record;

/// Judges the campaign in `file`.
///
/// # Errors
/// Exit 3 where a record cannot be read or has no free decay in it, 130 where the user stops it.
pub fn diagnose(file: &CampaignFile, options: &Options) -> Result<Diagnosed> {
    let progress = Progress::new(file.campaign.release.len(), "reading");
    let read = |index: usize| {
        interrupt::check()?;
        progress.one();
        file.record(index)
    };
    let releases = 0..file.campaign.release.len();
    let records: Vec<Result<Record>> = releases.into_par_iter().map(read).collect();
    // Collected first, so that of several bad records always the first is named.
    let records = records.into_iter().collect::<Result<Vec<_>>>()?;
    let diagnosed = core::diagnose(&records, &Grouping::Campaign(&file.campaign), options)?;
    for warning in diagnosed.decays.iter().flat_map(|decay| &decay.warnings) {
        yawrig_base::warn!("{warning}");
    }
    Ok(diagnosed)
}
