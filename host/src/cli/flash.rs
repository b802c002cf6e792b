//! `yawrig flash`: write a network to a device.

use super::device_arg::DeviceArg;
use clap::Args;
use indicatif::ProgressBar;
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_link::bench::Target;
use yawrig_link::flash::{self, Progress};
use yawrig_link::key;
use yawrig_text::quoted;
use yawrig_verbs::common::{bar, network_id, print_json, print_line, SCHEMA_VERSION};

#[derive(Args, Debug)]
pub struct Flash {
    /// Network file made by `yawrig train`
    network: PathBuf,
    #[command(flatten)]
    device: DeviceArg,
    /// Private key (made by `yawrig keygen`) to sign the network with, for a locked device
    #[arg(long, value_name = "KEY")]
    sign: Option<PathBuf>,
    /// Print one JSON object
    #[arg(short, long)]
    json: bool,
}

/// Bytes written, as a bar.
pub struct Bar(ProgressBar);

impl Bar {
    pub fn new() -> Self {
        Self(bar(0, "flashing"))
    }
}

impl Progress for Bar {
    fn written(&mut self, bytes: usize, of: usize) {
        self.0.set_length(of as u64);
        self.0.set_position(bytes as u64);
        if bytes == of {
            self.0.finish_and_clear();
        }
    }

    fn waiting(&mut self) {
        crate::say!("a release is going on; the network is taken up when it is over");
    }
}

pub fn run(arguments: &Flash) -> Result<()> {
    let (blob, _) = flash::read(&arguments.network)?;
    let key = arguments.sign.as_deref().map(key::read).transpose()?;
    let mut bench = arguments.device.open()?;
    let mut bar = Bar::new();
    let generation = flash::write_signed(&mut bench.client, &blob, key.as_ref(), &mut bar)?;
    let id = network_id(bench.client.status()?.network.id);
    if arguments.json {
        return print_json(&serde_json::json!({
            "schema_version": SCHEMA_VERSION,
            "device": arguments.device.device.to_string(),
            "network": {"id": id, "generation": generation},
            "bytes": blob.len(),
            "verified": true,
        }));
    }
    print_line(&format!(
        "network {id} written and verified ({} bytes); the device runs it as generation {generation}",
        blob.len()
    ))?;
    if !matches!(arguments.device.device, Target::Port(_)) {
        crate::say!(
            "that device is {} and ends with this command; the next one starts anew with empty slots (to play a record \
             into a device with this network: yawrig replay --network {})",
            arguments.device.device,
            quoted(&arguments.network.to_string_lossy())
        );
    }
    Ok(())
}
