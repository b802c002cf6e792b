//! What host and device must agree on, bit for bit.
#![no_std]
#![forbid(unsafe_code)]

pub mod potentiometer;
