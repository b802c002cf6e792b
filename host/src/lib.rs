//! Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#![forbid(unsafe_code)]

/// A line on stderr. `eprintln!` would panic where nobody reads it any more (`2>&1 | head`).
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

pub mod batch;
pub mod campaign;
pub mod cli;
pub mod demo;
pub mod doctor;
mod drawn;
pub mod model;
pub mod plot;
pub mod report;
pub mod study;
pub mod workbench;
