//! A campaign of releases, wind off and on, to aerodynamic derivatives.

pub mod campaign;
pub mod simulated;

#[cfg(test)]
mod campaign_tests;
