//! The entry: what the releases of a rig, or of a campaign, lack.

use crate::derivatives::campaign::Campaign;
pub use crate::diagnosis::answer::{
    step, BeforeAndAfter, Candidate, Coefficient, Condition, Diagnosed, Diagnosis, HeldOut, Left,
    Options, ReleaseVerdict, Status, Step, FITTED_SHARE,
};
use crate::diagnosis::campaign::of_campaign;
use crate::diagnosis::one::of_one;
pub use crate::diagnosis::over_pieces::fit_over_pieces;
use crate::diagnosis::several::of_several;
pub use crate::diagnosis::several_fit::Common;
pub use crate::diagnosis::verdict::{name_of, verdict, SECOND_ORDER};
use crate::error::Result;
pub use crate::fit::fitting::Modal;
use crate::record::Record;

/// What releases have to do with each other.
#[derive(Clone, Debug)]
pub enum Grouping<'a> {
    /// One rig in one condition; a release by itself is one of these.
    Rig(Common),
    /// A campaign's, in its order: wind, springs and axis of each are known. It begins from the
    /// second-order model, whatever is present.
    Campaign(&'a Campaign),
}

impl Default for Grouping<'_> {
    fn default() -> Self {
        Self::Rig(Common::default())
    }
}

/// Judges `releases`, one or several.
///
/// # Errors
/// Naming the record without a free decay; a present model that cannot be fitted; interrupted.
pub fn diagnose(releases: &[Record], grouping: &Grouping, options: &Options) -> Result<Diagnosed> {
    match (grouping, releases) {
        (Grouping::Campaign(made), _) => of_campaign(made, releases, options),
        (Grouping::Rig(_), [only]) => of_one(only, options),
        (Grouping::Rig(common), _) => of_several(releases, common, options),
    }
}
