//! Free decays in memory: identified, simulated with effects, fitted, diagnosed, and turned into derivatives.
#![forbid(unsafe_code)]

pub mod derivatives;
pub mod diagnosis;
pub mod effects;
pub mod error;
pub mod fit;
pub mod identify;
pub mod motion;
pub mod quantity;
pub mod record;
pub mod solver;
pub mod stop;
