//! From the host to a device: a serial port, frames, and the emulated devices behind one.

pub mod bench;
pub mod client;
pub mod emulated;
pub mod events;
pub mod flash;
pub mod hub;
pub mod image;
pub mod key;
pub mod port;
pub mod qemu;
pub mod terminal;
