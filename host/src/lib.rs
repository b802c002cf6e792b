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

pub mod amplitude_trend;
pub mod cli;
pub mod criticism;
pub mod demo;
pub mod derivatives;
pub mod doctor;
pub mod error;
pub mod files;
pub mod fit;
pub mod follow;
pub mod identify;
pub mod interrupt;
pub mod link;
pub mod live;
pub mod own_effect;
pub mod quantity;
pub mod record;
pub mod replay;
pub mod report;
pub mod rig;
pub mod study;
pub mod train;
pub mod workbench;
