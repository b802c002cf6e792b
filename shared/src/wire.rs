//! What host and device say to each other.
//!
//! How they become frames stands in [`crate::frame`].

mod condition;
mod hello;
mod linearity;
mod log;
mod results;
mod samples;
mod signing;
mod status;

use crate::blob::BlobError;
pub use crate::flags::Flags;
pub use crate::frame::*;
pub use condition::{rig_id, Condition, ConditionFault, Settings, FULL_SCALE_COUNTS};
use heapless::Vec;
pub use hello::{Hello, HelloReply};
pub use linearity::{Absent, Linearity, LinearityPart, PART_KNOTS};
pub use log::{LogEntry, Logged, LOG_ENTRY};
use postcard_schema::Schema;
pub use results::{
    counting, Counting, Derivatives, Measured, Precise, Refined, ReleaseResult, WindowResult,
};
pub use samples::{Samples, STREAM_CHUNK};
use serde::{Deserialize, Serialize};
pub use signing::{network_message, unlock_message, update_message, Signature, NOBODYS_KEY};
pub use status::{
    is_safe, Cause, Crash, Forgotten, Learnt, NetworkStatus, Phase, Sensor, SensorKind, SlotState,
    Start, Status, CRASH_FILE,
};

/// Bytes of a blob in one chunk.
pub const CHUNK: usize = 256;
/// Samples within which a network on trial has to be confirmed: ten seconds.
pub const TRIAL_SAMPLES: u32 = 10_000;
/// Samples between two erases of a network's place, once many have come at once: ten minutes.
pub const SAMPLES_BETWEEN_ERASES: u32 = 600_000;
/// Events a device keeps for a host that missed them.
pub const KEPT_EVENTS: usize = 32;
/// Key of [`Samples`]: "SMPL".
pub const SAMPLES_KEY: u32 = u32::from_le_bytes(*b"SMPL");

/// Number of this set of messages, one more for each that is given to others: by it two programs tell which
/// is older.
pub const REVISION: u16 = 1;
/// Key of all messages together: equal keys, equal messages.
pub const MESSAGES_KEY: u32 = joined([Request::KEY, Reply::KEY, Event::KEY, SAMPLES_KEY]);

/// Numbers as one (FNV-1a, 32 bits).
pub const fn joined(keys: [u32; 4]) -> u32 {
    let mut hash = 0x811c_9dc5_u32;
    let mut at = 0;
    while at < 4 * keys.len() {
        hash = (hash ^ (keys[at / 4] >> (8 * (at % 4)) & 0xff)).wrapping_mul(0x0100_0193);
        at += 1;
    }
    hash
}

impl Message for Request {
    const NAME: &'static str = "yawrig/request";
}
impl Message for Reply {
    const NAME: &'static str = "yawrig/reply";
}
impl Message for Event {
    const NAME: &'static str = "yawrig/event";
}

/// What the host asks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(clippy::large_enum_variant)] // no heap to put the chunk on
pub enum Request {
    Status,
    /// Takes effect with the next release.
    Configure(Settings),
    /// What the coming releases are made under. Takes effect with the next release.
    Condition(Condition),
    /// Signs the [`update_message`] of the last challenge; a locked device wants it before the update begins.
    FlashPermit {
        length: u32,
        signature: Signature,
    },
    /// Announces a blob of this many bytes; the idle slot is erased.
    FlashBegin {
        length: u32,
    },
    FlashChunk {
        offset: u32,
        bytes: Vec<u8, CHUNK>,
    },
    /// Signs the [`network_message`] of the challenge of the permit and the blob that was begun; a locked
    /// device wants it before the trial.
    FlashSignature {
        signature: Signature,
    },
    /// Verifies what was written and runs it on trial. Not in mid-release.
    FlashTrial,
    /// Commits the network on trial. Without it the old one is back after [`TRIAL_SAMPLES`].
    FlashCommit,
    /// Ends the running release once this many samples have come: the record is over.
    EndRelease {
        after_samples: u32,
    },
    /// Takes only networks signed with this ed25519 public key from now on.
    Lock {
        key: [u8; 32],
    },
    /// Asks for the lock's number and a nonce, which never come again and are good for one answer.
    Challenge,
    /// Opens the lock: signs the [`unlock_message`] of the last challenge.
    Unlock {
        signature: Signature,
    },
    /// Asks again for an event that was lost on the line: one of the last [`KEPT_EVENTS`].
    Event {
        number: u16,
    },
    /// Sends the next so many samples as they come, as [`Samples`]; a larger number asked for before
    /// stands. So nobody need end it, and several programs may listen.
    Stream {
        samples: u32,
    },
    /// Names this run of the device, if it has no name yet: not zero. After a reset it has none again, by
    /// which hosts tell that it began anew.
    Session {
        number: u32,
    },
    /// Part of a table for converter and sensor, in the order of its knots; with the last one it holds, and
    /// is kept. One without knots erases what is kept. Not in mid-release, nor on a locked device.
    SetLinearity(LinearityPart),
    /// Asks for the table's part from this knot on.
    Linearity {
        at: u16,
    },
    /// Asks for the first entry of the device's log that has this number or a higher one.
    Log {
        from: u32,
    },
}

/// The device's answer to a [`Request`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(clippy::large_enum_variant)] // no heap to put the status on
pub enum Reply {
    Done,
    Status(Status),
    Event(Event),
    Challenge {
        number: u32,
        nonce: u32,
    },
    Linearity(LinearityPart),
    /// None: there is none of that number or a higher one.
    Log(Option<LogEntry>),
    Refused(Refusal),
}

/// Why a request was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// A setting out of its range.
    Settings,
    /// A quantity of the condition that cannot be.
    Condition(ConditionFault),
    /// A chunk without a begin, or not at the expected offset.
    FlashOrder {
        expected_offset: u32,
    },
    /// The blob is refused; the old network runs on.
    Blob(BlobError),
    /// Not newer than the network that runs.
    Stale {
        newest: u32,
    },
    /// The flash did not take what was written.
    FlashWrite,
    /// No network is on trial; it may have run out of time.
    NoTrial,
    /// Not while a release is going on, all of whose windows are to be one network's: ask again when it is
    /// over.
    Releasing,
    /// Locked, and the network came without a signature.
    Unsigned,
    /// Of another key, or of something else.
    WrongSignature,
    /// This device has no lock.
    CannotLock,
    LockedAlready,
    NotLocked,
    /// Not an ed25519 public key.
    NotAKey,
    /// The event is not kept any more, or has not been yet.
    NotKept {
        oldest: u16,
    },
    /// No table, or its parts did not come in order.
    Linearity,
    /// The flash of this board has no room for a log.
    NoLog,
    /// A network's place has been erased so often that its flash would wear: ask again after so many samples.
    TooOften {
        samples: u32,
    },
}

/// What the device says unasked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    Phase {
        phase: Phase,
        release: u32,
        at_sample: u32,
    },
    Window(WindowResult),
    Release(ReleaseResult),
    /// After the release's result, when it is ready.
    Refined(Refined),
}
