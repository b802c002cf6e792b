//! What host and device must agree on, bit for bit.
//!
//! One way through: record -> [`window`] -> [`features`] -> [`network`] -> modal estimate.
//! Plain `f32` arithmetic and `libm` give the same bits on x86 and on a Cortex-M4F, so training,
//! the device and the tests all call this code and compare bits.
#![no_std]
#![forbid(unsafe_code)]

// Its example is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

pub mod axis;
pub mod blob;
pub mod checksum;
mod crossing;
pub mod derivatives;
pub mod features;
pub mod flags;
mod forward;
pub mod frame;
pub mod history;
pub mod linearity;
pub mod misfit;
pub mod modal;
pub mod network;
pub mod numbers;
pub mod potentiometer;
pub mod source;
pub mod units;
pub mod window;
pub mod wire;
