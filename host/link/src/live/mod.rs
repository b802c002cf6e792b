//! A device followed as it measures: its potentiometer's trace at 1 kHz, results as they come, and
//! both stored.
//!
//! [`session::Session`] makes [`item::Item`]s of what a device says; [`stored::Stored`] makes the same
//! items of a session that was stored by [`recording::Recording`]. Who shows them need not know which.

pub mod built_in_rig;
pub mod disk;
mod names;
pub mod recording;
pub mod session;
pub mod sessions;
pub mod stored;

pub use yawrig_protocol::live::{item, releases};
