//! The whole: device, line, host, and the figures of the documentation.

mod advice;
mod arrows;
mod circle;
mod clock;
mod common;
mod conventional_table;
mod device_in_memory;
mod flags;
mod followed;
mod imports;
mod least_squares_figures;
mod line_faults;
mod linearity;
mod live;
mod overruns;
mod pictures;
mod power_cut_mutations;
mod qemu;
mod real_records;
mod refined_figures;
mod release_grows;
mod release_kinds;
mod release_scenarios;
mod report;
mod soak;
mod unplugged;
