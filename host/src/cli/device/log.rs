//! `yawrig device log`: what a device kept of its releases and faults while nobody listened.

use crate::cli::device_arg::DeviceArg;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yawrig_base::error::{Error, Result};
use yawrig_core::record::Record;
use yawrig_link::bench::Target;
use yawrig_link::log;
use yawrig_link::replay::{replay, Range};
use yawrig_shared::wire::Settings;
use yawrig_verbs::common::{print_json, print_line, SCHEMA_VERSION};

#[derive(Args, Debug)]
pub struct Log {
    /// Records to play into an emulated device first, to see what it keeps of them
    #[arg(value_name = "RECORD")]
    records: Vec<PathBuf>,
}

impl Log {
    pub fn run(&self, device: &DeviceArg, as_json: bool) -> Result<()> {
        if let (Target::Port(path), false) = (&device.device, self.records.is_empty()) {
            return Err(Error::usage(format!(
                "the device on {path} has a potentiometer of its own: nothing can be played into it"
            ))
            .help("leave the records out, or use --device emulated"));
        }
        let records: Vec<Record> =
            self.records.iter().map(|file| yawrig_records::read(file)).collect::<Result<_>>()?;
        let mut bench = device.open()?;
        let Settings { from_deg, to_deg, .. } = Settings::default();
        let range = Range { from_deg: from_deg.into(), to_deg: to_deg.into() };
        for record in &records {
            replay(&mut bench, record, range, &mut |_| Ok(()))?;
        }
        let log = log::read(&mut bench.client)?;
        if as_json {
            let mut object = log.json();
            object["schema_version"] = json!(SCHEMA_VERSION);
            return print_json(&object);
        }
        print_line(&log.text())
    }
}
