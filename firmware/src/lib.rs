//! What the device does: potentiometer counts in, natural frequency and damping ratio out.
//!
//! [`device::Device`] is all a board needs: give it samples at 1 kHz and bytes from the serial
//! line, take bytes for the line from it. It never blocks, allocates or asks for the time; its
//! clock is the count of samples.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod decimated;
pub mod device;
pub mod estimator;
mod flash;
pub mod line;
pub mod lock;
pub mod measuring;
pub mod reference;
pub mod refine;
pub mod refining;
pub mod release;
pub mod residual;
pub mod sampler;
pub mod serial;
pub mod signal;
pub mod slots;
pub mod stream;

/// The network of last resort, when no slot holds a valid one.
pub const BUILT_IN: &[u8] = include_bytes!("../networks/built-in.yrn");
