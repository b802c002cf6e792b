//! The program: its verbs, the demo, and how it shows what it has to say.
#![forbid(unsafe_code)]

pub use yawrig_base::{say, warn};

pub mod cli;
mod demo;
mod doctor;
pub mod terminal;
