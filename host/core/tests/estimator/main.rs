//! Estimator, diagnosis and laws on data of the independent rig.

mod contact_by_side;
mod critical_speed;
mod diagnose;
mod hidden;
mod law;
mod let_go;
mod memory_as_state;
mod names_of_effects;
mod other_quantities;
mod over_window;
mod plan;
mod planted_laws;
mod planted_releases;
mod plausible;
mod record_faults;
mod releases;
mod same_answer;
mod scale_free;
mod stamps;
