//! The command line as a user sees it: the built program, its exit codes, messages and JSON.

mod demo;
mod devices;
mod files;
mod interrupts;
mod lock;
mod model;
mod networks;
mod ports;
mod qemu;
mod records;
mod shells;
mod study;
mod train;
mod usage;
