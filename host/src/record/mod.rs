//! Yaw angle over time as it comes from a file, at whatever rate and with whatever jitter.

mod csv_file;
pub mod format;
mod hdf5;
mod mat;
mod noise;
mod parquet_file;
mod resample;
mod table;
mod tdms;
mod timing;

pub use csv_file::{write_samples, ACCEPTED_COLUMNS};
pub use table::{Selection, Unit};
pub use timing::Timing;

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// One recorded release.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Where it was read from, for messages.
    pub file: PathBuf,
    /// Seconds, strictly increasing, any origin.
    pub time_s: Vec<f64>,
    /// Yaw angle in degrees as the potentiometer shows it, with its constant offset.
    pub yaw_deg: Vec<f64>,
}

impl Record {
    /// Reads `time_s` and `yaw_deg` (or `yaw_rad`, converted) from a file: CSV, MATLAB, HDF5, TDMS or
    /// Parquet, whatever it is called.
    ///
    /// # Errors
    /// Exit 3, naming file and line or sample: not readable, other columns, not a number, NaN or infinity, time not
    /// increasing, nothing or too little in it, a sampling rate outside 20 Hz to 10 kHz.
    pub fn read(file: &Path) -> Result<Self> {
        Self::read_selected(file, &Selection::default())
    }

    /// The same with the channels that `selection` names, where their own names do not say what they are.
    ///
    /// # Errors
    /// As [`Self::read`]; with the channels there are where it is not clear which are meant.
    pub fn read_selected(file: &Path, selection: &Selection) -> Result<Self> {
        let format = format::of(file)?;
        let record = if format == format::Format::Csv && *selection == Selection::default() {
            csv_file::read(file)?
        } else {
            table::record(file, &format::channels(file, format)?, selection)?
        };
        timing::check_rate(&record)?;
        Ok(record)
    }

    /// Writes the record in the format that the name's ending says: csv, parquet, h5, hdf5 or mat (7.3).
    ///
    /// # Errors
    /// Exit 2 for another ending, exit 3 where the file cannot be written.
    pub fn write_as(&self, file: &Path) -> Result<()> {
        format::write(self, file)
    }

    /// Writes `time_s,yaw_deg` with microdegrees and microseconds, whole or not at all.
    ///
    /// # Errors
    /// Exit 3 where the file cannot be written, 130 where the user stops it.
    pub fn write(&self, file: &Path) -> Result<()> {
        write_samples(file, self.time_s.iter().copied().zip(self.yaw_deg.iter().copied()))
    }

    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Sampling rate and jitter.
    ///
    /// # Panics
    /// With fewer than two samples; a record that was read has more.
    pub fn timing(&self) -> Timing {
        timing::measure(&self.time_s)
    }

    /// The same record at a uniform `rate_hz`, from its first sample to its last, by a cubic spline through
    /// every sample (not-a-knot ends).
    ///
    /// The error for a sinusoid of f Hz sampled at s Hz is about 2 (f / (s - f))^4 of its amplitude: 1.2e-2 for
    /// the rig's fastest mode (4.2 Hz) at 20 Hz, where straight lines are 0.2 out, and about 1e-6 at
    /// 160 Hz. A record faster than `rate_hz` is sampled at points, as the device's converter would.
    ///
    /// # Errors
    /// Exit 3 for fewer than four samples.
    pub fn resampled(&self, rate_hz: f64) -> Result<Self> {
        if self.len() < 4 {
            return Err(Error::data(format!(
                "{}: {} samples are too few to interpolate",
                self.file.display(),
                self.len()
            )));
        }
        let (time_s, yaw_deg) = resample::uniform(&self.time_s, &self.yaw_deg, rate_hz);
        Ok(Self { file: self.file.clone(), time_s, yaw_deg })
    }
}

#[cfg(test)]
mod tests;
