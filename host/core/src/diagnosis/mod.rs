//! Where a model fails and which effect it lacks, in one record or a campaign.

pub mod amplitude;
pub mod buffeting;
pub mod campaign;
mod campaign_fit;
pub mod compare;
pub mod diagnose;
pub mod forced;
pub mod late_release;
pub mod origin;
pub mod search;
pub mod together;
