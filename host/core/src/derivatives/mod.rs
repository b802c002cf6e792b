//! A campaign of releases, wind off and on, to aerodynamic derivatives.
//!
//! Records are identified one by one, repeats averaged ([`condition`]), the inertia taken from a straight
//! line (`line`), the derivatives computed by the formulas host and device share, and every uncertainty
//! carried through all of it.

mod alike;
pub mod at;
pub mod campaign;
pub mod can;
mod computed;
pub mod condition;
pub mod critical;
mod decay_rate;
mod doubt;
mod inputs;
pub(crate) mod line;
pub mod plausible;
mod propagation;
mod repeats;
pub mod table;
pub mod transfer;
pub mod validation;

pub use computed::{inertia_kg_m2, Computed};
