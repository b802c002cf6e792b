//! The command line as a user sees it: the built program, its exit codes, messages and JSON.

mod demo;
mod devices;
mod doctor;
mod files;
mod formats;
mod interrupts;
mod lock;
mod model;
mod monitor;
mod networks;
mod ports;
mod qemu;
mod records;
mod report;
mod riddle;
mod shells;
mod study;
mod terminals;
mod train;
mod usage;
