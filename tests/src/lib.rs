//! What the end-to-end tests in `tests/` share: the program run as a user runs it, and lines with
//! a device, or something else, at their other end.
#![forbid(unsafe_code)]

pub mod browser;
pub mod desk;
pub mod line;
pub mod networks;
pub mod process;
