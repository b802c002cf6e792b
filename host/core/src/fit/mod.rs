//! Models with effects fitted to one release or to several.

pub(crate) mod about_rest;
pub mod at_amplitude;
pub(crate) mod fitted;
pub mod fitting;
pub mod free_decay;
pub mod joint;
mod known;
pub(crate) mod layout;
pub(crate) mod linear_gain;
pub mod lines;
pub(crate) mod noise;
mod noise_floor;
pub mod own;
pub(crate) mod part;
pub(crate) mod pieces;
pub(crate) mod problem;
pub(crate) mod segments;
pub(crate) mod starts;
pub(crate) mod structure;
pub mod two_modes;
mod valley;
