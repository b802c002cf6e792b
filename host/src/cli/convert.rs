//! `yawrig convert`: a record from one format to another.

use super::choices::YawUnit;
use super::common::{print_json, print_line, within, SCHEMA_VERSION};
use crate::campaign::simulated::refuse_existing;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_records::Selection;

/// Write a record in another format, or with other channels chosen: CSV, MATLAB, HDF5, TDMS (read
/// only), Parquet
#[derive(Args, Debug)]
pub struct Convert {
    /// The record; its format is found in it
    from: PathBuf,
    /// The file to write: .csv, .parquet, .h5, .hdf5 or .mat (7.3)
    to: PathBuf,
    /// Channel of the time, in seconds (default: time_s)
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
    /// Channel of the yaw angle (default: yaw_deg or yaw_rad)
    #[arg(long, value_name = "NAME")]
    yaw: Option<String>,
    /// What the yaw angle is in, where the file does not say it
    #[arg(long, value_enum)]
    unit: Option<YawUnit>,
    /// Samples a second, where there is no channel of the time
    #[arg(long, value_name = "HZ", conflicts_with = "time", allow_negative_numbers = true)]
    rate_hz: Option<f64>,
    /// Overwrite what is there
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl Convert {
    pub fn run(&self) -> Result<()> {
        if let Some(rate_hz) = self.rate_hz {
            within("--rate-hz", rate_hz, 20.0, 10_000.0)?;
        }
        let selection = Selection {
            time: self.time.clone(),
            yaw: self.yaw.clone(),
            unit: self.unit.map(Into::into),
            rate_hz: self.rate_hz,
        };
        let record = yawrig_records::read_selected(&self.from, &selection)?;
        let same = |a: &Path, b: &Path| {
            a.canonicalize().ok().is_some_and(|a| Some(a) == b.canonicalize().ok())
        };
        if same(&self.from, &self.to) {
            return Err(Error::usage(format!(
                "{} would be written over itself",
                self.to.display()
            ))
            .help("give the record another name"));
        }
        if !self.force {
            refuse_existing(&self.to)?;
        }
        yawrig_records::write_as(&record, &self.to)?;
        let timing = record.timing();
        if self.json {
            return print_json(&json!({
                "schema_version": SCHEMA_VERSION,
                "file": self.to,
                "samples": record.len(),
                "rate_hz": timing.rate_hz,
                "duration_s": timing.duration_s,
            }));
        }
        print_line(&format!(
            "{}: {} samples at {:.4} Hz, {:.3} s",
            self.to.display(),
            record.len(),
            timing.rate_hz,
            timing.duration_s
        ))
    }
}
