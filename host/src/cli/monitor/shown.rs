//! What is shown of a session, live or stored.

use yawrig_base::error::Result;
use yawrig_link::live::item::Item;
use yawrig_shared::wire::Event;
use yawrig_verbs::common::{print_json_line, print_line};

pub(super) struct Shown {
    pub(super) jsonl: bool,
    /// Of the device's network.
    pub(super) effects: String,
    pub(super) releases: u32,
    /// The refined estimate of the last of them has come.
    pub(super) refined: bool,
}

impl Shown {
    /// Results on stdout; what befalls the line on stderr, but in JSON on stdout with them.
    pub(super) fn show(&mut self, item: &Item) -> Result<()> {
        if let Some(effects) = item.effects() {
            self.effects = effects;
        }
        match item {
            Item::Event { event: Event::Release(_), .. } => {
                self.releases += 1;
                self.refined = false;
            }
            Item::Event { event: Event::Refined(_), .. } => self.refined = true,
            _ => {}
        }
        match (item, item.to_text(&self.effects)) {
            (Item::Samples { .. }, _) => Ok(()),
            (_, text) if self.jsonl => {
                let is_result = matches!(item, Item::Event { .. } | Item::Derivatives { .. });
                if let (Some(text), false) = (text, is_result) {
                    crate::say!("{text}");
                }
                print_json_line(&item.to_json())
            }
            (
                Item::Event { .. } | Item::Condition { .. } | Item::Derivatives { .. },
                Some(text),
            ) => print_line(&text),
            (_, Some(text)) => {
                crate::say!("{text}");
                Ok(())
            }
            (_, None) => Ok(()),
        }
    }
}
