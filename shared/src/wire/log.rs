//! What a device keeps of its results and its faults, for a host that was not there.

use super::condition::Condition;
use super::results::{Refined, ReleaseResult};
use super::status::Start;
use crate::frame::Message;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Bytes of an entry, at most.
pub const LOG_ENTRY: usize = 244;

/// An entry of the device's log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LogEntry {
    /// Of all that it has kept, from 1; those before the oldest have made room.
    pub number: u32,
    /// Number of the entry by which this run of the device began.
    pub run: u32,
    /// Samples, which are milliseconds, of that run, and how many of them were lost.
    pub at_sample: u32,
    pub lost_samples: u32,
    /// The network that ran; zero: none.
    pub network: u32,
    pub what: Logged,
}

/// What an entry says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(clippy::large_enum_variant)] // no heap to put it on
pub enum Logged {
    /// A run of the device: what began it, and what ended the one before.
    Start(Start),
    /// What the releases after it were made under; none since a start: nobody had said.
    Condition(Condition),
    Release(ReleaseResult),
    Refined(Refined),
}

/// In the flash, where it has its key beside it: what another firmware has written is taken for nothing else.
impl Message for LogEntry {
    const NAME: &'static str = "yawrig/log";
}
