//! The entry: what the releases of a rig, or of a campaign, lack.

pub use crate::diagnosis::answer::{
    step, BeforeAndAfter, Candidate, Coefficient, Condition, Diagnosed, Diagnosis, HeldOut, Left,
    Options, ReleaseVerdict, Status, Step, FITTED_SHARE,
};
use crate::diagnosis::one::of_one;
pub use crate::diagnosis::over_pieces::fit_over_pieces;
pub use crate::diagnosis::prediction::MIN_GAIN;
use crate::diagnosis::search_start::held_by_law;
use crate::diagnosis::several::of_several;
pub use crate::diagnosis::several_fit::{Common, Grouping};
pub use crate::diagnosis::verdict::{name_of, SECOND_ORDER};
use crate::error::{Error, Result};
pub use crate::fit::fitting::Modal;
use crate::fit::free_decay::FreeDecay;
use crate::identify::gaps::{self, Warning};
use crate::identify::several;
use crate::linearity::Jumps;
use crate::record::Record;

/// Judges `releases`, one or several.
///
/// # Errors
/// No release at all; naming the record without a free decay; a present model that cannot be fitted; interrupted.
pub fn diagnose(releases: &[Record], grouping: &Grouping, options: &Options) -> Result<Diagnosed> {
    let mut found = match (grouping, releases) {
        (_, []) => Err(Error::NoRelease),
        (Grouping::Rig(_), [only]) => of_parts(only, options),
        _ => of_several(releases, grouping, options),
    }?;
    // What was cut short is no answer.
    options.stop.check()?;
    // A campaign begins from the second-order model, whatever is present.
    if let Grouping::Rig(_) = grouping {
        found.diagnosis.held_by_law = held_by_law(&found.decays, &options.present.effects);
    }
    if found.diagnosis.lacks_more() {
        let Diagnosis { releases: judged, where_release, .. } = &found.diagnosis;
        let worst = judged.iter().position(|release| release.file == *where_release);
        let jumps = worst.and_then(|i| releases.get(i)).and_then(Jumps::of_reading);
        found.diagnosis.has_jumps(jumps);
    }
    Ok(found)
}

/// One release; where gaps part it that are too long to be filled, what lies between them are releases of the
/// same rig, as far as they hold a free decay.
fn of_parts(record: &Record, options: &Options) -> Result<Diagnosed> {
    let (wind_speed_m_s, stop) = (options.wind_speed_m_s, options.stop.clone());
    let decay = FreeDecay { wind_speed_m_s, stop, ..FreeDecay::from_record(record)? };
    let alone = &options.in_wind(decay.wind_speed_m_s);
    let is_parted = decay.warnings.iter().any(|w| matches!(w, Warning::Parted { .. }));
    // What is released anew after a gap is another release, which the user chooses.
    if !is_parted || several::releases(record).len() > 1 {
        return of_one(record, decay, alone);
    }
    let mut parts = gaps::parts(record);
    parts.retain(|part| FreeDecay::from_record(part).is_ok());
    if parts.len() < 2 {
        return of_one(record, decay, alone);
    }
    let common = Common { same_rig: true, own: Vec::new() };
    let mut found = of_several(&parts, &Grouping::Rig(common), options)?;
    let joined = Warning::Joined { record: record.name(), parts: parts.len() };
    found.decays[0].warnings.push(joined);
    Ok(found)
}
