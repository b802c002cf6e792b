//! `yawrig convert`: a record from one format to another.

use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_campaign::simulated::refuse_existing;
use yawrig_records::place::Times;
use yawrig_records::Selection;
use yawrig_verbs::common::{print_json, print_line, SCHEMA_VERSION};
use yawrig_verbs::releases::ReleaseArg;

/// Write a record in another format, or with other channels chosen: text, MATLAB, HDF5, TDMS (read
/// only), Parquet
#[derive(Args, Debug)]
pub struct Convert {
    /// The record; its format is found in it
    from: PathBuf,
    /// The file to write: .csv, .parquet, .h5, .hdf5 or .mat (7.3)
    to: PathBuf,
    /// Read all records of this one's folder so from now on (kept in its records.toml)
    #[arg(long)]
    keep: bool,
    #[command(flatten)]
    release: ReleaseArg,
    /// Overwrite what is there
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(short, long)]
    json: bool,
}

impl Convert {
    pub fn run(&self) -> Result<()> {
        let selection = self.release.selection()?;
        let from = self.release.of(std::slice::from_ref(&self.from))?;
        let many = from.len() > 1;
        for (index, from) in from.iter().enumerate() {
            let to = if many { numbered(&self.to, index + 1) } else { self.to.clone() };
            self.one(from, &to, &selection)?;
        }
        if self.keep {
            let Times { from_s, to_s } = self.release.times();
            let selection = Selection { from_s, to_s, ..selection };
            let kept = yawrig_records::keep(&self.from, &selection)?;
            crate::say!("{}: the other records beside it are read this way, too", kept.display());
        }
        Ok(())
    }

    fn one(&self, from: &Path, to: &Path, selection: &Selection) -> Result<()> {
        let record = yawrig_records::read_selected(from, selection)?;
        let same = |a: &Path, b: &Path| {
            a.canonicalize().ok().is_some_and(|a| Some(a) == b.canonicalize().ok())
        };
        if same(from, to) {
            return Err(Error::usage(format!("{} would be written over itself", to.display()))
                .help("give the record another name"));
        }
        if !self.force {
            refuse_existing(to)?;
        }
        yawrig_records::write_as(&record, to)?;
        let timing = record.timing();
        if self.json {
            return print_json(&json!({
                "schema_version": SCHEMA_VERSION,
                "file": to,
                "samples": record.len(),
                "rate_hz": timing.rate_hz,
                "duration_s": timing.duration_s,
            }));
        }
        print_line(&format!(
            "{}: {} samples at {:.4} Hz, {:.3} s",
            to.display(),
            record.len(),
            timing.rate_hz,
            timing.duration_s
        ))
    }
}

/// `out-2.csv` of `out.csv`.
fn numbered(to: &Path, number: usize) -> PathBuf {
    let stem = to.file_stem().unwrap_or_default().to_string_lossy();
    let ending = to.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    to.with_file_name(format!("{stem}-{number}{ending}"))
}
