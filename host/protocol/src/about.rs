//! What a device says of itself, in words.

use crate::client::Identity;
use crate::flash::{hex, LOST_HELP};
use crate::follow::{began_text, learnt_text, sensor_text, topology};
use crate::linearity;
use crate::numbers::{named, Named};
use yawrig_shared::wire::{is_safe, SlotState, Status, NOBODYS_KEY};

fn id(number: u32) -> String {
    format!("{number:08x}")
}

/// Its firmware, protocol, network and slots, lock, sensor and how it began, a line each.
pub fn text(identity: &Identity, status: &Status) -> String {
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
        format!("network   {} {} ({from})", id(network.id), topology(status)),
    ];
    if !network.effects.is_empty() {
        let effects = network.effects.replace(' ', ", ");
        lines.push(format!("model     second-order with {effects}"));
    }
    for Named { name, unit } in named(network) {
        lines.push(format!(
            "says      {name} in {unit}, beside natural frequency and damping ratio"
        ));
    }
    for (index, slot) in status.slots.iter().enumerate() {
        let state = match slot {
            SlotState::Empty => "empty".to_owned(),
            SlotState::Invalid if is_safe(status.restarts) => "not looked at".to_owned(),
            SlotState::Invalid => "not committed or damaged".to_owned(),
            SlotState::Valid { generation, id: number } => {
                format!("network {}, generation {generation}", id(*number))
            }
        };
        lines.push(format!("slot {index}    {state}"));
    }
    lines.push(match &status.lock {
        Some(NOBODYS_KEY) => {
            "lock      lost: it takes no network, and nobody's key opens it".to_owned()
        }
        Some(key) => format!("lock      only networks signed with {}", hex(key)),
        None => "lock      none: takes any network".to_owned(),
    });
    if status.lock == Some(NOBODYS_KEY) {
        lines.push(format!("          {}", LOST_HELP));
    }
    lines.push(format!("learnt    {}", learnt_text(&status.learnt)));
    lines.push(format!("sensor    {}", sensor_text(&status.sensor)));
    lines.push(format!("          {}", linearity::text(&status.linearity, &status.settings)));
    let settings = &status.settings;
    lines.push(format!("analyses  {} deg down to {} deg", settings.from_deg, settings.to_deg));
    lines.push(format!("samples   {} taken, {} lost", status.samples, status.lost_samples));
    lines.push(format!("started   {}", began_text(status)));
    lines.join("\n")
}
