//! Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#![forbid(unsafe_code)]

pub mod cli;
pub mod derivatives;
pub mod error;
pub mod files;
pub mod fit;
pub mod identify;
pub mod interrupt;
pub mod quantity;
pub mod record;
pub mod rig;
