//! `model.toml`, its journal, and the steps taken with it: comparing, adding and removing effects, fitting, a
//! law measured, further releases planned, and the model as a program of another language.
#![forbid(unsafe_code)]

pub mod adding;
pub mod appraisal;
pub mod comparison;
mod data;
pub mod derived;
pub mod document;
pub mod edits;
pub mod effects;
pub mod export;
pub mod journal;
pub mod law;
pub mod limits;
pub mod measured;
pub mod model_fit;
mod model_reading;
mod model_text;
pub mod plan;
pub mod records;
pub mod revise;
pub mod side_by_side;
pub mod sources;
pub mod store;
pub mod training;
pub mod unfitted;
