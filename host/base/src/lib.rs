//! What every crate of the host that touches the outside shares: an error as the user sees it, messages and
//! progress for a program to show, files written whole or by one at a time, and Ctrl-C.
#![forbid(unsafe_code)]

pub mod built;
pub mod clock;
pub mod disk;
pub mod error;
pub mod files;
pub mod interrupt;
pub mod lock;
pub mod message;
pub mod settings;
