//! What every crate of the host that touches the outside shares.
#![forbid(unsafe_code)]

pub mod files;
