//! What the images for QEMU's mps2-an386 share.
#![no_std]

pub mod uart;
