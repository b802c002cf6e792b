//! The yaw motion with effects, integrated.

pub(crate) mod own_motion;
pub mod simulate;
