//! What the device does.
#![no_std]
#![forbid(unsafe_code)]
