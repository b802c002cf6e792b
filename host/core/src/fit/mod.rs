//! Models with effects fitted to one release or to several.

pub mod fitting;
pub mod floor;
pub mod joint;
pub mod noise;
pub mod problem;
pub mod promise;
pub mod segments;
pub mod sharing;
pub mod starts;
pub mod structure;
pub mod swing;
