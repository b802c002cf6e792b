//! A campaign's records read and diagnosed in one joint fit.

use super::CampaignFile;
use rayon::prelude::*;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_core::diagnosis::campaign::{self, CampaignDiagnosis, Diagnosed};
use yawrig_core::diagnosis::diagnose::Options;
use yawrig_core::fit::free_decay::FreeDecay;

/// Judges the campaign in `file`.
///
/// # Errors
/// As [`diagnose_with_fits`].
pub fn diagnose(file: &CampaignFile, options: &Options) -> Result<CampaignDiagnosis> {
    Ok(diagnose_with_fits(file, options)?.diagnosis)
}

/// Judges the campaign in `file`, and keeps what was fitted.
///
/// # Errors
/// Exit 3 where a record cannot be read or has no free decay in it, 130 where the user stops it.
pub fn diagnose_with_fits(file: &CampaignFile, options: &Options) -> Result<Diagnosed> {
    let read = |index: usize| {
        interrupt::check()?;
        let mut decay = FreeDecay::of(&yawrig_records::read(&file.record_path(index))?)?;
        decay.stop = options.stop.clone();
        decay.wind_speed_m_s = file.campaign.release[index].wind_speed_m_s;
        Ok(decay)
    };
    let releases = 0..file.campaign.release.len();
    let decays: Vec<Result<FreeDecay>> = releases.into_par_iter().map(read).collect();
    // Collected first, so that of several bad records always the first is named.
    let decays = decays.into_iter().collect::<Result<Vec<_>>>()?;
    for warning in decays.iter().flat_map(|decay| &decay.warnings) {
        crate::say!("yawrig: warning: {warning}");
    }
    Ok(campaign::diagnose_with_fits(&file.campaign, decays, options)?)
}
