//! `yawrig device`: a device's firmware, protocol, network and slots.

mod install;
mod linearity;
mod log;

use super::device_arg::DeviceArg;
use clap::{Args, Subcommand};
use serde_json::{json, Value};
use std::path::PathBuf;
use yawrig_base::error::{Error, Result};
use yawrig_link::about;
use yawrig_link::bench::Target;
use yawrig_link::client::Identity;
use yawrig_link::follow::{device_json, learnt_json, sensor_json, start_json};
use yawrig_link::key;
use yawrig_link::linearity as link;
use yawrig_shared::wire::{is_safe, SlotState, Status, NOBODYS_KEY};
use yawrig_verbs::common::{network_id, print_json, print_line, SCHEMA_VERSION};

#[derive(Args, Debug)]
pub struct Device {
    #[command(flatten)]
    device: DeviceArg,
    /// Print one JSON object
    #[arg(short, long, global = true)]
    json: bool,
    #[command(subcommand)]
    change: Option<Change>,
}

/// What may be changed of a device.
#[derive(Subcommand, Debug)]
enum Change {
    /// Write a board's firmware: the first, or another version's
    Install(install::Install),
    /// Make it take only networks signed with a key
    Lock {
        /// The private key's file (made by `yawrig keygen`), or the public key's 64 digits
        #[arg(long, value_name = "KEY")]
        key: String,
        /// Do it: without the private key it cannot be undone
        #[arg(long)]
        yes: bool,
    },
    /// Make it take any network again
    Unlock {
        /// The private key's file
        #[arg(long, value_name = "KEY")]
        key: PathBuf,
    },
    /// Correct what its converter and sensor err by: learn it from releases that were recorded through them,
    /// and write it to the device
    Linearity(linearity::Linearity),
    /// Read out what it kept of releases and faults while nobody listened, for weeks if need be
    Log(log::Log),
}

/// What to do, with its key read before the device is opened.
enum Act {
    Lock([u8; 32]),
    Unlock(ed25519_compact::KeyPair),
}

pub fn run(arguments: &Device) -> Result<()> {
    let act = match &arguments.change {
        None => None,
        Some(Change::Lock { key, yes }) => {
            let public = key::public(key)?;
            if !yes {
                return Err(Error::usage(
                    "a locked device takes only networks signed with this key, and nothing but its private key opens it",
                )
                .help("add --yes to lock it"));
            }
            Some(Act::Lock(public))
        }
        Some(Change::Unlock { key }) => Some(Act::Unlock(key::read(key)?)),
        Some(Change::Install(asked)) => return asked.run(arguments.json),
        Some(Change::Linearity(asked)) => return asked.run(&arguments.device, arguments.json),
        Some(Change::Log(asked)) => return asked.run(&arguments.device, arguments.json),
    };
    let mut bench = arguments.device.open()?;
    match act {
        None => {}
        Some(Act::Lock(public)) => key::lock(&mut bench.client, &public)?,
        Some(Act::Unlock(pair)) => key::unlock(&mut bench.client, &pair)?,
    }
    let status = bench.client.status()?;
    let identity = &bench.client.identity;
    if arguments.json {
        return print_json(&to_json(identity, &status));
    }
    if !matches!(arguments.device.device, Target::Port(_)) {
        crate::say!(
            "this {} device has just been started: nothing was written to it",
            arguments.device.device
        );
    }
    print_line(&about::text(identity, &status))
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
    object["lock"] = json!(status.lock.map(|key| key::hex(&key)));
    object["lock_lost"] = json!(status.lock == Some(NOBODYS_KEY));
    object["samples"] = json!(status.samples);
    object["lost_samples"] = json!(status.lost_samples);
    object["lost_events"] = json!(status.lost_events);
    object["lost_bytes"] = json!(status.lost_bytes);
    object["learnt"] = learnt_json(&status.learnt);
    object["linearity"] = link::json(&status.linearity, &status.settings);
    object["linearity_absent"] = json!(status.linearity.absent.map(link::absent_name));
    object["sensor"] = sensor_json(&status.sensor);
    object["start"] = start_json(&status.start);
    object["start"]["restarts"] = json!(status.restarts);
    object["start"]["safe_mode"] = json!(is_safe(status.restarts));
    object
}
