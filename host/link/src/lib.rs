//! From the host to a device: a serial port, frames, and the emulated devices behind one.

#![forbid(unsafe_code)]

pub mod bench;
pub mod client;
pub mod emulated;
pub mod flash;
pub mod holders;
pub mod hub;
pub mod image;
pub mod install;
pub mod key;
pub mod linearity;
pub mod live;
pub mod log;
pub mod port;
#[cfg(unix)]
mod pty;
#[cfg(unix)]
pub mod qemu;
pub mod replay;
mod socket;
pub mod terminal;

pub use yawrig_protocol::{about, advice, amplitude_trend, condition, events, follow, numbers};
