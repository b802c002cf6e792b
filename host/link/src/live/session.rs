//! A device of this machine followed: it waits for each thing that happens.

use super::item::Item;
use crate::bench::Bench;
use crate::client::{waited, Port, Waited};
use std::time::Duration;
use yawrig_base::error::Result;
use yawrig_protocol::client::Client as Protocol;
pub use yawrig_protocol::live::session::Follow;
use yawrig_protocol::live::session::{Board, Session as Followed};
use yawrig_shared::wire::{Condition, Status};

impl Board for Bench {
    type Line = Port;

    fn client(&mut self) -> &mut Protocol<Port> {
        &mut self.client
    }

    fn port(&mut self) -> String {
        self.shared_path().to_owned()
    }

    fn may_come_back(&self) -> bool {
        self.is_pluggable()
    }

    async fn reopen(&mut self) -> Result<Option<String>> {
        self.open_again()
    }
}

/// A device that is followed.
pub type Session = Waited<Followed<Bench>>;

impl Session {
    /// Follows a device from now on.
    ///
    /// # Errors
    /// Exit 7 where it does not answer, 4 where it is gone.
    pub fn new(bench: Bench, follow: Follow) -> Result<Self> {
        waited(Followed::new(bench, follow)).map(Self)
    }

    /// Says what the coming releases are made under; after a reset the device is told again. What it answers
    /// about itself then: a release that is going on was begun before.
    ///
    /// # Errors
    /// Exit 2 for a condition that cannot be, naming the quantity; those of the line.
    pub fn set_condition(&mut self, condition: Condition) -> Result<Status> {
        waited(self.0.set_condition(condition))
    }

    /// What happened next, waiting for it at most so long.
    ///
    /// # Errors
    /// Exit 4 where the device is gone and cannot come back, 130 where the user wants to stop.
    pub fn next(&mut self, patience: Duration) -> Result<Option<Item>> {
        waited(self.0.next(patience))
    }
}
