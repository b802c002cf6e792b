//! What the end-to-end tests in `tests/` share: the program run as a user runs it, and lines with
//! a device, or something else, at their other end.
#![forbid(unsafe_code)]

use std::time::Duration;

/// How long anything is waited for before its test gives up: only what hangs takes so long, however slow the
/// machine is.
pub const PATIENCE: Duration = Duration::from_secs(600);

pub mod browser;
pub mod converter;
pub mod desk;
mod ended;
pub mod firefox;
pub mod line;
pub mod networks;
pub mod process;
mod program;
pub mod swinging;
