//! Where a model fails and which effect it lacks, in one record or a campaign.

pub(crate) mod account;
mod alike;
pub(crate) mod alone;
pub mod amplitude;
pub(crate) mod answer;
pub(crate) mod buffeting;
mod by_likelihood;
pub mod campaign;
mod campaign_fit;
pub mod compare;
pub mod diagnose;
mod flexible;
pub(crate) mod forced;
pub(crate) mod guards;
pub(crate) mod late_release;
pub(crate) mod likelihood;
mod lines;
pub mod origin;
pub(crate) mod over_pieces;
pub(crate) mod prediction;
mod reach;
pub(crate) mod releases;
pub mod search;
mod search_start;
pub mod several;
mod several_fit;
pub(crate) mod survivors;
