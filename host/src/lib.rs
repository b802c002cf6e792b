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

mod batch;
pub mod campaign;
pub mod cli;
mod demo;
mod doctor;
mod drawn;
mod export;
mod law;
pub mod model;
mod plan;
mod plot;
mod report;
pub mod study;
mod workbench;
