//! The program: its verbs, their text, and the demo.
#![forbid(unsafe_code)]

pub use yawrig_base::{say, warn};

pub mod answer;
mod batch;
pub mod cli;
mod commands;
pub mod course;
mod demo;
mod doctor;
pub mod flags;
pub mod terminal;
