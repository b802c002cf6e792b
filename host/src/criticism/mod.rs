//! Where a second-order model fails, which physical effect is missing, and what adding it does.
//!
//! A record's free swing is taken as block means over a fiftieth of a period ([`swing`]); a model with any effects of
//! the library ([`effects`]) is simulated ([`simulate`]) and fitted ([`fitting`]); [`diagnose`] fits every effect,
//! alone and together, and judges by evidence, held-out data and physical size; [`compare`] says where a model fails.

pub mod buffeting;
pub mod cards;
pub mod compare;
pub mod diagnose;
pub mod effects;
pub mod fitting;
mod forced;
pub mod noise;
mod origin;
mod search;
pub mod simulate;
mod starts;
pub mod swing;
