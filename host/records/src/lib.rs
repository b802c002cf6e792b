//! Records as files: CSV, MATLAB, HDF5, TDMS and Parquet.
#![forbid(unsafe_code)]

mod csv_file;
pub mod format;
mod hdf5;
mod mat;
mod parquet_file;
mod table;
mod tdms;

pub use csv_file::{write_samples, ACCEPTED_COLUMNS};
pub use table::{Selection, Unit};

use std::path::Path;
use yawrig_base::error::Result;
use yawrig_core::record::Record;

/// Reads `time_s` and `yaw_deg` (or `yaw_rad`, converted) from a file: CSV, MATLAB, HDF5, TDMS or
/// Parquet, whatever it is called.
///
/// # Errors
/// Exit 3, naming file and line or sample: not readable, other columns, not a number, NaN or infinity, time not
/// increasing, nothing or too little in it, a sampling rate outside 20 Hz to 10 kHz.
pub fn read(file: &Path) -> Result<Record> {
    read_selected(file, &Selection::default())
}

/// The same with the channels that `selection` names, where their own names do not say what they are.
///
/// # Errors
/// As [`read`]; with the channels there are where it is not clear which are meant.
pub fn read_selected(file: &Path, selection: &Selection) -> Result<Record> {
    let format = format::of(file)?;
    let record = if format == format::Format::Csv && *selection == Selection::default() {
        csv_file::read(file)?
    } else {
        table::record(file, &format::channels(file, format)?, selection)?
    };
    record.check_rate()?;
    Ok(record)
}

/// Writes the record in the format that the name's ending says: csv, parquet, h5, hdf5 or mat (7.3).
///
/// # Errors
/// Exit 2 for another ending, exit 3 where the file cannot be written.
pub fn write_as(record: &Record, file: &Path) -> Result<()> {
    format::write(record, file)
}

/// Writes `time_s,yaw_deg` with microdegrees and microseconds, whole or not at all.
///
/// # Errors
/// Exit 3 where the file cannot be written, 130 where the user stops it.
pub fn write(record: &Record, file: &Path) -> Result<()> {
    write_samples(file, record.time_s.iter().copied().zip(record.yaw_deg.iter().copied()))
}

#[cfg(test)]
mod tests;
