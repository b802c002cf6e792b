//! The derivatives of a campaign from the natural frequencies and damping ratios of a model's steps.

use super::session::Standing;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::table::Table;
use yawrig_model::derived::{self, ByCondition};

/// The tables by the journal's last step without effects, and by its last step; none where there is no such step
/// or no point.
pub fn before_and_after(
    campaign: &CampaignFile,
    standing: &Standing,
) -> (Option<Table>, Option<Table>) {
    let mut steps = standing.steps.iter().rev();
    let after = steps.clone().find(|s| !s.modal.is_empty());
    let before = steps.find(|s| !s.modal.is_empty() && s.parameters.is_empty());
    let table = |modal: &ByCondition| derived::table(campaign, modal);
    (
        before.and_then(|s| table(&s.modal)),
        after.filter(|s| !s.parameters.is_empty()).and_then(|s| table(&s.modal)),
    )
}
