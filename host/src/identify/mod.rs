//! Natural frequency and damping ratio of recorded free decays.

pub mod damped_sinusoid;
pub mod least_squares;
pub mod pencil;
pub mod samples;
pub mod spectrum;
pub mod uncertainty;
