//! The sensors that a rig may have.

pub mod absolute;
pub mod as5600;
pub mod potentiometer;
pub mod quadrature;
mod turns;
