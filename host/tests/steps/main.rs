//! The program's verbs, and the libraries behind them, step by step.

mod by_hand;
mod campaign;
mod campaign_diagnosis;
mod damped_sinusoid;
mod derivatives;
mod formats;
#[allow(dead_code)] // The estimator's own tests use the rest.
#[path = "../../core/tests/estimator/hidden/mod.rs"]
mod hidden;
mod identify;
mod joint_fits;
mod large_swings;
mod model;
mod orders;
mod own_effect;
mod several;
mod simulate;
mod sources;
mod train;
mod transfer;
mod two_integrators;
mod walls;
