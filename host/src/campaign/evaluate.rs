//! From the records of a campaign to its table, on all cores.

use super::CampaignFile;
use rayon::prelude::*;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::Table;
use yawrig_core::derivatives::validation;
use yawrig_core::derivatives::{Computed, Doubt};
use yawrig_core::record::Record;

/// A method: from a record to natural frequency and damping ratio.
pub type Identify<'a> = dyn Fn(&Record) -> Result<Identified> + Sync + 'a;

/// Identifies every record, computes the table and validates it against the wind-on records. `method` is the name
/// to print. At most one record per core is in memory.
///
/// # Errors
/// Exit 3 for a record that cannot be read or in which nothing is found, or where there is no point to compute;
/// 130 where the user stops it.
pub fn evaluate(file: &CampaignFile, method: &str, identify: &Identify) -> Result<Table> {
    let releases = 0..file.campaign.release.len();
    let one = |index: usize| {
        interrupt::check()?;
        identify(&yawrig_records::read(&file.record_path(index))?)
    };
    let found: Vec<Result<Identified>> = releases.clone().into_par_iter().map(one).collect();
    // Collected first, so that of several bad records always the first is named.
    let identified = found.into_iter().collect::<Result<Vec<_>>>()?;
    let computed = Computed::new(&file.campaign, &identified).map_err(|e| {
        let named = Error::from(e);
        Error { message: format!("{}: {}", file.path.display(), named.message), ..named }
    })?;
    let doubts = computed.doubts();
    let at = |doubt: &Doubt| match doubt.release {
        Some(index) => file.error_at(index, &doubt.what),
        None => Error::data(format!("{}: {}", file.path.display(), doubt.what)),
    };
    if let Some(impossible) = doubts.iter().find(|doubt| doubt.is_impossible) {
        return Err(at(impossible).help("correct the entry: lengths in m, stiffness in N/m"));
    }
    let responses = computed.responses();
    let validate = |index: usize| {
        interrupt::check()?;
        let Some(modal) = &responses[index] else { return Ok(None) };
        let record = yawrig_records::read(&file.record_path(index))?;
        let Identified { from_s, to_s, .. } = &identified[index];
        Ok(validation::mean_squared_error_deg2(&record, *from_s, *to_s, modal))
    };
    let errors: Vec<Option<f64>> = releases.into_par_iter().map(validate).collect::<Result<_>>()?;
    let mut table = computed.table(&file.path, method);
    for (release, error) in table.releases.iter_mut().zip(errors) {
        release.validation_mse_deg2 = error;
    }
    table.notes.splice(..0, doubts.iter().map(|doubt| at(doubt).message));
    Ok(table)
}
