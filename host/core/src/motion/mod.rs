//! The yaw motion with effects, integrated.

mod along;
mod at_times;
mod linear_states;
pub(crate) mod oscillator;
mod own_effects;
pub(crate) mod own_motion;
mod own_states;
mod pace;
mod pair;
mod piece;
pub(crate) mod random;
#[cfg(test)]
#[path = "runge_kutta_tests.rs"]
mod runge_kutta;
mod side_by_side;
pub mod simulate;
mod slope;
mod smooth_own;

pub use at_times::readings_at;
