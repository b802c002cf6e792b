//! What the device says of itself.

use super::condition::{Condition, Settings};
use super::linearity::Linearity;
use crate::blob::EffectIds;
use crate::network::NumberNames;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Bytes of a source file's path that a crash is told by: its end.
pub const CRASH_FILE: usize = 24;

/// Whether a device that began so many times in a row without being asked is in safe mode: it answers, measures
/// nothing, and has taken up nothing of what its flash keeps.
pub const fn is_safe(restarts: u8) -> bool {
    restarts >= 3
}

/// State of one slot of the network store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotState {
    Empty,
    /// Begun and not committed, or damaged.
    Invalid,
    Valid {
        generation: u32,
        id: u32,
    },
}

/// What the device is and runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    pub network: NetworkStatus,
    pub slots: [SlotState; 2],
    /// Public key it is locked with; [`NOBODYS_KEY`](super::NOBODYS_KEY) where that cannot be read any more.
    pub lock: Option<[u8; 32]>,
    /// What the coming releases are measured with; one that is going on may have been begun with others.
    pub settings: Settings,
    /// The clock's standard uncertainty, by the settings or the board.
    pub clock_u_ppm: f32,
    pub phase: Phase,
    /// Samples since it started, and how many were lost on the way.
    pub samples: u32,
    pub lost_samples: u32,
    /// Events that found no room on the line.
    pub lost_events: u32,
    /// Bytes from the host that came too fast.
    pub lost_bytes: u32,
    /// What [`Request::Session`](super::Request::Session) has named this run; zero: nothing yet.
    pub session: u32,
    /// A refined estimate is being worked on.
    pub refining: bool,
    /// Number of the next event: all before it were sent.
    pub next_event: u16,
    /// What the coming releases are made under; none since the device started, or none yet.
    pub condition: Option<Condition>,
    /// The wind-off release that the windows' results are held against, and the refined ones.
    pub reference: Option<u32>,
    pub refined_reference: Option<u32>,
    pub learnt: Learnt,
    pub linearity: Linearity,
    pub start: Start,
    /// Starts in a row that nobody asked for, none of which has run for a minute.
    pub restarts: u8,
    pub sensor: Sensor,
}

/// What refined estimates have shown of the network's error on a rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Learnt {
    /// Of so many releases; none: nothing is corrected.
    pub releases: u16,
    /// A reset leaves it.
    pub kept: bool,
    /// Why there is nothing of what was known before.
    pub forgotten: Option<Forgotten>,
}

/// What made nothing of what was learnt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Forgotten {
    /// Another rig was mounted.
    Rig,
    /// Another network runs.
    Network,
    /// A release showed that the rig is another than was said.
    Contradicted,
    /// The flash does not hold it as it was written.
    Damaged,
}

/// What the samples are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sensor {
    pub kind: SensorKind,
    /// Readings of the sensor in a second, of which the device makes a thousand.
    pub rate_hz: u16,
    /// How late a sample is, at most: by the sensor's own filter and by what readings become samples.
    /// Frequencies and damping do not depend on it.
    pub delay_us: u16,
}

/// Kinds of sensors of an angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorKind {
    Potentiometer,
    /// A magnetic encoder of ams OSRAM's.
    As5600,
    /// Two tracks whose edges are counted.
    Quadrature,
    /// An encoder that gives its angle as a number.
    Absolute,
}

/// How this run of the device began.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Start {
    pub cause: Cause,
    /// What ended the run before, where the firmware itself did.
    pub crash: Option<Crash>,
}

/// What began it, by the processor's own account.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cause {
    /// The board does not say.
    #[default]
    Unknown,
    /// Power came, or came back.
    Power,
    /// The reset button, or a debugger.
    Pin,
    /// The firmware hung.
    Watchdog,
    /// The firmware asked for it.
    Software,
}

/// Where the firmware gave up.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Crash {
    /// The end of the source file's path; empty: the processor refused an instruction.
    pub file: heapless::String<CRASH_FILE>,
    /// Line of the file, or the instruction's address.
    pub line: u32,
}

/// The network that runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NetworkStatus {
    /// CRC-32 of its payload.
    pub id: u32,
    pub generation: u32,
    pub topology: Vec<u8, 5>,
    /// Slot it came from; none: compiled in.
    pub slot: Option<u8>,
    /// Not confirmed yet: a power cut, or [`TRIAL_SAMPLES`](super::TRIAL_SAMPLES), bring the old one back.
    pub on_trial: bool,
    /// Effects of the model it was trained on.
    pub effects: EffectIds,
    /// Numbers of theirs that it says, as results have them.
    pub numbers: NumberNames,
}

/// Where in a release the device is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// Nothing to see yet, or moved by hand.
    Waiting,
    /// At rest, at any angle.
    Held,
    /// Let go, not turned back yet.
    Released,
    Ringing,
    Finished,
}
