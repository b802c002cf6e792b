//! What the records say where no effect of the library does: the law itself, its name, and what no law can
//! hold.

pub mod beside;
pub mod estimate;
pub(crate) mod forms;
pub mod left;
mod line;
pub mod names;
mod on_curve;
mod roughness;
pub mod tables;
mod trials;
