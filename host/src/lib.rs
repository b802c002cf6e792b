//! Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#![forbid(unsafe_code)]

pub mod cli;
pub mod criticism;
pub mod demo;
pub mod derivatives;
pub mod error;
pub mod files;
pub mod fit;
pub mod follow;
pub mod identify;
pub mod interrupt;
pub mod link;
pub mod quantity;
pub mod record;
pub mod replay;
pub mod rig;
pub mod train;
