//! Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#![forbid(unsafe_code)]

/// A line on stderr, or to who listens instead.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => { $crate::said(format_args!($($text)*)) };
}

static LISTENER: std::sync::OnceLock<fn(String)> = std::sync::OnceLock::new();

/// Has `listener` told, from now on, what would stand on stderr; the first is kept.
pub fn listen(listener: fn(String)) {
    LISTENER.get_or_init(|| listener);
}

#[doc(hidden)]
pub fn said(text: std::fmt::Arguments) {
    use std::io::Write as _;
    match LISTENER.get() {
        Some(listener) => listener(text.to_string()),
        // `eprintln!` would panic where nobody reads it any more (`2>&1 | head`).
        None => drop(writeln!(std::io::stderr(), "{text}")),
    }
}

pub mod answer;
mod batch;
pub mod campaign;
pub mod cli;
pub mod course;
mod demo;
mod doctor;
mod drawn;
mod export;
mod law;
pub mod model;
mod plan;
mod plot;
mod progress;
mod report;
pub mod study;
mod units;
mod workbench;
