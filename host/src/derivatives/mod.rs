//! A campaign of releases, wind off and on, to aerodynamic derivatives.

pub mod campaign;
pub mod condition;
mod inputs;
pub mod line;
pub mod simulated;
pub mod table;
mod validation;

#[cfg(test)]
mod campaign_tests;
