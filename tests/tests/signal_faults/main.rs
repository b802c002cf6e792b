//! What is wrong with a signal is said, or the answer is right all the same: a table of faults, each at
//! several severities, on several releases. It prints:
//! `cargo test --release -p yawrig-tests --test signal_faults -- --nocapture`.
//!
//! The motion is integrated and the sensor read by the virtual rig; the fault comes on top.

mod case;
mod cases;
mod faults;
mod line;
mod model;
mod sensor;
mod table;
