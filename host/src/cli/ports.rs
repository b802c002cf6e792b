//! `yawrig ports`: the serial ports of this machine.

use clap::Args;
use yawrig_base::error::Result;
use yawrig_link::port;
use yawrig_verbs::common::{print_json, print_line, SCHEMA_VERSION};

#[derive(Args, Debug)]
pub struct Ports {
    /// Print one JSON object
    #[arg(short, long)]
    json: bool,
}

pub fn run(arguments: &Ports) -> Result<()> {
    let ports = port::list()?;
    if arguments.json {
        return print_json(&serde_json::json!({
            "schema_version": SCHEMA_VERSION,
            "ports": ports,
        }));
    }
    if ports.is_empty() {
        crate::say!("no serial port found; is the board plugged in?");
    }
    for port in ports {
        print_line(&format!("{:16} {}", port.path, port.description))?;
    }
    Ok(())
}
