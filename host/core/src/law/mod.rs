//! What the records say where no effect of the library does: the law itself, its name, and what no law can hold.

pub mod estimate;
pub mod forms;
pub mod names;
pub mod releases;
mod roughness;
