//! `model.toml`, its journal, and the steps taken with it.

pub mod adding;
pub mod appraisal;
pub mod comparison;
pub mod document;
pub mod edits;
pub mod effects;
pub mod journal;
pub mod limits;
pub mod measured;
pub mod model_fit;
mod model_reading;
mod model_text;
pub mod records;
pub mod revise;
pub mod side_by_side;
pub mod store;
pub mod training;
pub mod unfitted;
