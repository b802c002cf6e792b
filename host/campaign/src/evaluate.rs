//! From the records of a campaign to its table, on all cores.

use super::doubted::{placed, refusal};
use super::CampaignFile;
use rayon::prelude::*;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_base::message::Progress;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::plausible::Doubt;
use yawrig_core::derivatives::table::Table;
use yawrig_core::derivatives::validation;
use yawrig_core::derivatives::{plausible, Computed};
use yawrig_core::record::faults::Facts;
use yawrig_core::record::Record;

/// A method: from a record to natural frequency and damping ratio.
pub type Identify<'a> = dyn Fn(&Record) -> Result<Identified> + Sync + 'a;

/// What was found in each record, with the record's own facts, in the order of the campaign. At most one
/// record per core is in memory.
///
/// # Errors
/// Of the whole: 130 where the user stops it. Of one: exit 3 where it cannot be read or nothing is found.
pub fn looked_at(
    file: &CampaignFile,
    identify: &Identify,
) -> Result<Vec<Result<(Identified, Facts)>>> {
    let progress = Progress::new(file.campaign.release.len(), "identifying");
    let one = |index: usize| {
        interrupt::check()?;
        let record = file.record(index)?;
        let found = identify(&record)?;
        let wn = found.natural_frequency_rad_s.value;
        let facts = Facts::new(&record, found.from_s, found.to_s, wn);
        progress.one();
        Ok((found, facts))
    };
    let found = (0..file.campaign.release.len()).into_par_iter().map(one).collect();
    interrupt::check()?;
    Ok(found)
}

/// All that is doubtful about a campaign in whose records this was found, with file and line.
pub fn doubts(file: &CampaignFile, identified: &[Identified], facts: &[Facts]) -> Vec<Doubt> {
    placed(file, plausible::doubts(&file.campaign, identified, facts))
}

/// Identifies every record, computes the table and validates it against the wind-on records. `method` is the
/// name to print.
///
/// # Errors
/// Exit 3 for a record that cannot be read or in which nothing is found, for a campaign that cannot be true,
/// or where there is no point to compute; 130 where the user stops it.
pub fn evaluate(file: &CampaignFile, method: &str, identify: &Identify) -> Result<Table> {
    // Collected first, so that of several bad records always the first is named.
    let found = looked_at(file, identify)?.into_iter().collect::<Result<Vec<_>>>()?;
    let (identified, facts): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    let doubts = doubts(file, &identified, &facts);
    if let Some(error) = refusal(&doubts) {
        return Err(error);
    }
    table(file, method, &identified, doubts)
}

/// The table of what was found, validated.
///
/// # Errors
/// As [`evaluate`].
pub fn table(
    file: &CampaignFile,
    method: &str,
    identified: &[Identified],
    doubts: Vec<Doubt>,
) -> Result<Table> {
    let computed = Computed::new(&file.campaign, identified).map_err(|e| {
        let named = Error::from(e);
        Error { message: format!("{}: {}", file.path.display(), named.message), ..named }
    })?;
    let responses = computed.responses();
    let progress = Progress::new(file.campaign.release.len(), "validating");
    let validate = |index: usize| {
        interrupt::check()?;
        progress.one();
        let Some(modal) = &responses[index] else { return Ok(None) };
        let record = file.record(index)?;
        let Identified { from_s, to_s, .. } = &identified[index];
        Ok(validation::mean_squared_error_deg2(&record, *from_s, *to_s, modal))
    };
    let releases = 0..file.campaign.release.len();
    let errors: Vec<Option<f64>> = releases.into_par_iter().map(validate).collect::<Result<_>>()?;
    let mut table = computed.table(&file.path, method);
    for (release, error) in table.releases.iter_mut().zip(errors) {
        release.validation_mse_deg2 = error;
    }
    table.doubts = doubts;
    Ok(table)
}
