//! Where a model fails and which effect it lacks, in one record or a campaign.

pub mod account;
pub mod amplitude;
pub mod answer;
pub mod buffeting;
pub mod campaign;
mod campaign_fit;
pub mod compare;
pub mod diagnose;
pub mod forced;
pub mod late_release;
pub mod origin;
mod prediction;
mod reach;
pub mod search;
pub mod survivors;
pub mod together;
