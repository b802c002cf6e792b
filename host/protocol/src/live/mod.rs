//! A device followed as it measures: [`session::Session`] makes [`item::Item`]s of what it says, and
//! [`releases::Releases`] cuts one release after the other out of them.

mod clock;
pub mod item;
pub mod releases;
pub mod session;
