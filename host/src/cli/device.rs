//! `yawrig device`: a device's firmware, protocol, network and slots.

use super::common::{network_id, print_json, print_line, DeviceArg, SCHEMA_VERSION};
use crate::error::Result;
use crate::follow::{device_json, topology};
use crate::link::client::Identity;
use clap::Args;
use serde_json::{json, Value};
use yawrig_shared::wire::{SlotState, Status};

#[derive(Args, Debug)]
pub struct Device {
    #[command(flatten)]
    device: DeviceArg,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Device) -> Result<()> {
    let mut bench = arguments.device.open()?;
    let status = bench.client.status()?;
    let identity = &bench.client.identity;
    if arguments.json {
        return print_json(&to_json(identity, &status));
    }
    print_line(&to_text(identity, &status))
}

fn to_json(identity: &Identity, status: &Status) -> Value {
    let slots: Vec<Value> = status
        .slots
        .iter()
        .map(|slot| match slot {
            SlotState::Empty => json!({"state": "empty", "generation": null, "id": null}),
            SlotState::Invalid => json!({"state": "invalid", "generation": null, "id": null}),
            SlotState::Valid { generation, id } => {
                json!({"state": "valid", "generation": generation, "id": network_id(*id)})
            }
        })
        .collect();
    let mut object = device_json(identity, status);
    object["schema_version"] = json!(SCHEMA_VERSION);
    object["slots"] = json!(slots);
    object["running_slot"] = json!(status.network.slot);
    object["on_trial"] = json!(status.network.on_trial);
    object["samples"] = json!(status.samples);
    object["lost_samples"] = json!(status.lost_samples);
    object["lost_events"] = json!(status.lost_events);
    object
}

fn to_text(identity: &Identity, status: &Status) -> String {
    let network = &status.network;
    let from = match network.slot {
        Some(slot) if network.on_trial => {
            format!("slot {slot}, generation {}, on trial", network.generation)
        }
        Some(slot) => format!("slot {slot}, generation {}", network.generation),
        None => "compiled in".to_owned(),
    };
    let mut lines = vec![
        format!("firmware  {} on {}", identity.firmware, identity.board),
        format!("protocol  {}", identity.protocol),
        format!("network   {} {} ({from})", network_id(network.id), topology(status)),
    ];
    if !network.effects.is_empty() {
        let effects = network.effects.replace(' ', ", ");
        lines.push(format!("model     second-order with {effects}"));
    }
    for (index, slot) in status.slots.iter().enumerate() {
        let state = match slot {
            SlotState::Empty => "empty".to_owned(),
            SlotState::Invalid => "not committed or damaged".to_owned(),
            SlotState::Valid { generation, id } => {
                format!("network {}, generation {generation}", network_id(*id))
            }
        };
        lines.push(format!("slot {index}    {state}"));
    }
    let settings = &status.settings;
    lines.push(format!("analyses  {} deg down to {} deg", settings.from_deg, settings.to_deg));
    lines.push(format!("samples   {} taken, {} lost", status.samples, status.lost_samples));
    lines.join("\n")
}
