//! From the host to a device: a serial port, frames, and the emulated devices behind one.

#![forbid(unsafe_code)]

pub mod advice;
pub mod amplitude_trend;
pub mod bench;
pub mod client;
pub mod condition;
pub mod emulated;
pub mod events;
pub mod flash;
pub mod follow;
pub mod holders;
pub mod hub;
pub mod image;
pub mod key;
pub mod linearity;
pub mod live;
pub mod log;
pub mod numbers;
pub mod port;
#[cfg(unix)]
mod pty;
#[cfg(unix)]
pub mod qemu;
pub mod replay;
mod socket;
pub mod terminal;
