//! The program: its verbs, their text, and the demo.
#![forbid(unsafe_code)]
// In a browser verbs answer and do not run.
#![cfg_attr(target_family = "wasm", allow(dead_code))]

pub use yawrig_base::{say, warn};

pub mod answer;
mod batch;
pub mod cli;
mod commands;
pub mod course;
#[cfg(not(target_family = "wasm"))]
mod demo;
#[cfg(not(target_family = "wasm"))]
mod doctor;
pub mod flags;
#[cfg(not(target_family = "wasm"))]
pub mod terminal;
