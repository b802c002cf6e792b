//! What the device does: potentiometer counts in, natural frequency and damping ratio out.
//!
//! [`device::Device`] is all a board needs: give it samples at 1 kHz and bytes from the serial
//! line, take bytes for the line from it. It never blocks, allocates or asks for the time; its
//! clock is the count of samples.
//!
//! In a program of one's own its results come as values, too ([`device::Device::events`]). [`sensors`] holds
//! other sensors than a potentiometer, [`input`] takes them at their own rate, and [`queue`] lets an
//! interrupt do the sampling.
//!
//! # A board
//!
//! brings three things of its own: flash for the networks, any
//! [`NorFlash`](embedded_storage::nor_flash::NorFlash) of four [places](slots), and behind them, where there is
//! room, of a [log](journal); a line to the host, which
//! says when it is ready ([`embedded_io`]); and a converter that is read every millisecond by a timer, never
//! by the program's loop. The rest is this:
//!
//! ```
//! use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};
//! use yawrig_firmware::{device::Device, serial, slots::MemoryFlash};
//!
//! // A serial port of the board's; crates for microcontrollers bring one that has these traits.
//! struct Port;
//! impl ErrorType for Port {
//!     type Error = ErrorKind; // of a read: a byte was lost
//! }
//! impl ReadReady for Port {
//!     fn read_ready(&mut self) -> Result<bool, ErrorKind> { Ok(false) }
//! }
//! impl Read for Port {
//!     fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> { Ok(0) }
//! }
//! impl WriteReady for Port {
//!     fn write_ready(&mut self) -> Result<bool, ErrorKind> { Ok(true) }
//! }
//! impl Write for Port {
//!     fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> { Ok(bytes.len()) }
//!     fn flush(&mut self) -> Result<(), ErrorKind> { Ok(()) }
//! }
//!
//! // What DMA has brought from the converter, whose timer makes a sample each millisecond: counts from 0 to 65 520.
//! let mut samples = (0..2000_u32).map(|k| 32_768 + (k % 7) as u16);
//!
//! let flash = MemoryFlash::new(); // of the board: its own flash, or one beside it
//! let mut port = Port;
//! let mut device = Device::new(flash, "my board");
//! device.set_clock(30.0); // how well the timer keeps its millisecond, in ppm
//! loop {
//!     serial::receive(&mut port, &mut device);
//!     serial::send(&mut port, &mut device);
//!     // A board goes on for good, and counts what its ring of samples has lost: `device.lost(count)`.
//!     let Some(counts) = samples.next() else { break };
//!     device.sample(counts);
//!     device.work();
//!     // All is well: here the watchdog is fed.
//! }
//! assert_eq!(device.samples(), 2000);
//! ```
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod conversions;
pub mod crash;
pub mod decimated;
pub mod device;
mod envelope;
pub mod estimator;
mod flash;
pub mod input;
pub mod journal;
pub mod learning;
pub mod line;
pub mod linearity;
pub mod lock;
pub mod log;
pub mod measuring;
pub mod memory;
pub mod queue;
pub mod records;
pub mod reference;
pub mod refine;
pub mod refining;
pub mod release;
pub mod residual;
pub mod ring;
pub mod sampler;
pub mod sensor;
pub mod sensors;
pub mod serial;
pub mod signal;
pub mod slots;
pub mod stream;
pub mod sums;
pub mod swings;
pub mod wear;

/// The network of last resort, when no slot holds a valid one.
pub const BUILT_IN: &[u8] = include_bytes!("../networks/built-in.yrn");
