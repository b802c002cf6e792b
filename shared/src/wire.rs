//! What host and device say to each other.
//!
//! How they become frames stands in [`crate::frame`].

use crate::blob::{BlobError, EffectIds};
use crate::checksum::crc32_of;
use crate::derivatives::{Model, Wind};
pub use crate::flags::Flags;
pub use crate::frame::*;
use crate::network::NumberNames;
use crate::numbers::Numbers;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Bytes of a blob in one chunk.
pub const CHUNK: usize = 256;
/// Samples within which a network on trial has to be confirmed: ten seconds.
pub const TRIAL_SAMPLES: u32 = 10_000;
/// Events a device keeps for a host that missed them.
pub const KEPT_EVENTS: usize = 32;
/// Bytes of a source file's path that a crash is told by: its end.
pub const CRASH_FILE: usize = 24;
/// Samples in one message of the stream: 50 ms.
pub const STREAM_CHUNK: usize = 50;
/// Highest count of the boards' converters: the sum of sixteen readings of 12 bits.
pub const FULL_SCALE_COUNTS: u16 = 16 * 4095;
/// Key of [`Hello`] and [`HelloReply`]: "HELO".
pub const HELLO_KEY: u32 = u32::from_le_bytes(*b"HELO");
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

/// Who the device is. Never changes its encoding, which is fixed and not postcard's:
/// revision u16, key of all messages u32, then 24 bytes of text each for firmware and board, padded with
/// zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HelloReply {
    /// [`REVISION`] of the device's messages.
    pub protocol: u16,
    /// Its [`MESSAGES_KEY`].
    pub messages_key: u32,
    pub firmware: [u8; 24],
    pub board: [u8; 24],
}

/// The host's first question; its body is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hello;

impl HelloReply {
    pub const LENGTH: usize = 54;

    pub fn write(&self) -> [u8; Self::LENGTH] {
        let mut bytes = [0; Self::LENGTH];
        bytes[..2].copy_from_slice(&self.protocol.to_le_bytes());
        bytes[2..6].copy_from_slice(&self.messages_key.to_le_bytes());
        bytes[6..30].copy_from_slice(&self.firmware);
        bytes[30..].copy_from_slice(&self.board);
        bytes
    }

    pub fn read(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; Self::LENGTH] = bytes.try_into().ok()?;
        Some(Self {
            protocol: u16::from_le_bytes([bytes[0], bytes[1]]),
            messages_key: u32::from_le_bytes([bytes[2], bytes[3], bytes[4], bytes[5]]),
            firmware: bytes[6..30].try_into().ok()?,
            board: bytes[30..].try_into().ok()?,
        })
    }

    /// A text as the fixed field it is sent in; cut to 24 bytes.
    pub fn text(text: &str) -> [u8; 24] {
        let mut field = [0; 24];
        for (to, from) in field.iter_mut().zip(text.bytes()) {
            *to = from;
        }
        field
    }
}

/// An ed25519 signature. One that has not 64 bytes is not valid.
pub type Signature = Vec<u8, 64>;

/// What is signed: 16 bytes that say what for, so that a signature of one kind is none of another, then the
/// number and the nonce of a challenge, so that it is good once.
fn signed(kind: &[u8; 16], number: u32, nonce: u32) -> [u8; 24] {
    let mut message = [0; 24];
    message[..16].copy_from_slice(kind);
    message[16..20].copy_from_slice(&number.to_le_bytes());
    message[20..].copy_from_slice(&nonce.to_le_bytes());
    message
}

/// What is signed to open a lock.
pub fn unlock_message(number: u32, nonce: u32) -> [u8; 24] {
    signed(b"yawrig unlock 2.", number, nonce)
}

/// What is signed to begin an update of a locked device, which erases its idle slot.
pub fn update_message(number: u32, nonce: u32, length: u32) -> [u8; 28] {
    let mut message = [0; 28];
    message[..24].copy_from_slice(&signed(b"yawrig update 1.", number, nonce));
    message[24..].copy_from_slice(&length.to_le_bytes());
    message
}

/// What stands before the blob when a network is signed; of the challenge its update began with.
pub fn network_message(number: u32, nonce: u32) -> [u8; 24] {
    signed(b"yawrig network 2", number, nonce)
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
}

/// The device's answer to a [`Request`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(clippy::large_enum_variant)] // no heap to put the status on
pub enum Reply {
    Done,
    Status(Status),
    Event(Event),
    Challenge { number: u32, nonce: u32 },
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
}

/// How the device sees the potentiometer and what it analyses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    pub degrees_per_count: f32,
    /// Counts at zero degrees.
    pub zero_counts: u16,
    /// Highest count the converter gives.
    pub full_scale_counts: u16,
    /// Windows begin below this amplitude and end above the other.
    pub from_deg: f32,
    pub to_deg: f32,
    /// Relative standard uncertainty of the sampling clock, millionths; none: the board's own.
    pub clock_u_ppm: Option<f32>,
}

impl Default for Settings {
    /// The boards' converter with 0.005 deg a count, analysed from 10 to 1 deg.
    fn default() -> Self {
        Self {
            degrees_per_count: 0.005,
            zero_counts: 32768,
            full_scale_counts: FULL_SCALE_COUNTS,
            from_deg: 10.0,
            to_deg: 1.0,
            clock_u_ppm: None,
        }
    }
}

/// What a release is made under, so that the device can give derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Condition {
    /// Which spring and axis ([`rig_id`]): a wind-off release is a reference for those of the same rig and
    /// model alone.
    pub rig: u32,
    /// Wind off: its result becomes the reference of the releases after it.
    pub wind: Wind,
    pub model: Model,
    /// Moment of inertia about the yaw axis; zero: the device gives no derivatives.
    pub inertia_kg_m2: f64,
}

/// A number for a spring and an axis, by their names.
pub fn rig_id(spring: &str, axis: &str) -> u32 {
    crc32_of(&[spring.as_bytes(), &[0], axis.as_bytes()])
}

/// The quantity of a [`Condition`] that is no number, negative, or beyond what any tunnel and model have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ConditionFault {
    /// Outside 0.01 to 100 kg/m3.
    Density,
    /// Outside 0 to 340 m/s.
    WindSpeed,
    /// Outside 0.01 to 20 m.
    Length,
    /// Outside 1e-5 to 100 m2.
    FrontalArea,
    /// Neither zero nor 1e-8 to 1e5 kg m2.
    Inertia,
}

impl Condition {
    /// Whether it can be.
    ///
    /// # Errors
    /// The first quantity that cannot.
    pub fn check(&self) -> Result<(), ConditionFault> {
        let Self { wind, model, inertia_kg_m2, .. } = self;
        // None of these holds for what is no number.
        let faults = [
            ((0.01..=100.0).contains(&wind.density_kg_m3), ConditionFault::Density),
            ((0.0..=340.0).contains(&wind.speed_m_s), ConditionFault::WindSpeed),
            ((0.01..=20.0).contains(&model.length_m), ConditionFault::Length),
            ((1e-5..=100.0).contains(&model.frontal_area_m2), ConditionFault::FrontalArea),
            (
                *inertia_kg_m2 == 0.0 || (1e-8..=1e5).contains(inertia_kg_m2),
                ConditionFault::Inertia,
            ),
        ];
        faults.into_iter().find(|(can_be, _)| !can_be).map_or(Ok(()), |(_, fault)| Err(fault))
    }
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
    /// Public key it is locked with.
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
    /// What [`Request::Session`] has named this run; zero: nothing yet.
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
    pub start: Start,
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
    /// Not confirmed yet: a power cut, or [`TRIAL_SAMPLES`], bring the old one back.
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

/// Samples of the converter, sent unasked while a [`Request::Stream`] lasts: 2.6 kB/s at 1 kHz. They
/// are not kept: where one message is lost, the next one's number shows the gap.
///
/// On the line, little-endian: number of the first u32, degrees per count f32, zero counts u16,
/// then the counts, u16 each.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Device time of the first; those after it follow without a gap.
    pub first_sample: u32,
    /// How their counts become degrees.
    pub degrees_per_count: f32,
    pub zero_counts: u16,
    pub counts: Vec<u16, STREAM_CHUNK>,
}

impl Samples {
    pub const MOST_BYTES: usize = 10 + 2 * STREAM_CHUNK;

    pub fn write(&self) -> Vec<u8, { Self::MOST_BYTES }> {
        let mut bytes = Vec::new();
        // There is room for all of it.
        let mut push = |value: &[u8]| drop(bytes.extend_from_slice(value));
        push(&self.first_sample.to_le_bytes());
        push(&self.degrees_per_count.to_le_bytes());
        push(&self.zero_counts.to_le_bytes());
        self.counts.iter().for_each(|counts| push(&counts.to_le_bytes()));
        bytes
    }

    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (&first_sample, bytes) = bytes.split_first_chunk()?;
        let (&degrees_per_count, bytes) = bytes.split_first_chunk()?;
        let (&zero_counts, bytes) = bytes.split_first_chunk()?;
        let even = bytes.len().is_multiple_of(2) && bytes.len() <= 2 * STREAM_CHUNK;
        even.then(|| Self {
            first_sample: u32::from_le_bytes(first_sample),
            degrees_per_count: f32::from_le_bytes(degrees_per_count),
            zero_counts: u16::from_le_bytes(zero_counts),
            counts: bytes
                .chunks_exact(2)
                .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
                .collect(),
        })
    }
}

/// The network's estimate from three cycles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WindowResult {
    pub release: u32,
    /// Number in the release, from 0.
    pub window: u16,
    pub start_sample: u32,
    /// First sample at or after the end of the third cycle.
    pub end_sample: u32,
    /// Samples the device had seen when it sent this, less one.
    pub sent_sample: u32,
    pub amplitude_deg: f32,
    /// Mid-line on the potentiometer's scale: the constant offset.
    pub midline_deg: f32,
    pub natural_frequency_rad_s: f32,
    pub damping_ratio: f32,
    pub numbers: Numbers<f32>,
    pub flags: Flags,
}

/// A value and its standard uncertainty (k = 1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Measured {
    pub value: f32,
    pub u: f32,
}

/// The same of a value that an `f32` does not hold to its uncertainty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Precise {
    pub value: f64,
    pub u: f32,
}

/// A damped oscillation with an offset, fitted to a release's whole record from the network's estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refined {
    pub release: u32,
    /// The record: where it begins, and how many samples.
    pub from_sample: u32,
    pub samples: u32,
    /// Standard uncertainties hold for noise of any colour, and with the clock's in that of the natural
    /// frequency. Meaningless with [`Flags::NOT_REFINED`].
    pub natural_frequency_rad_s: Precise,
    pub damping_ratio: Measured,
    /// Rms of the noise of single samples.
    pub noise_rms_deg: f32,
    /// Rms of the residual over that of the noise, on means of a fiftieth of a cycle.
    pub residual_over_noise: f32,
    pub derivatives: Option<Derivatives>,
    /// Those of the release, and [`Flags::MISFIT`] or [`Flags::NOT_REFINED`].
    pub flags: Flags,
}

/// A release's mean over its windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReleaseResult {
    pub release: u32,
    /// Where it was let go, or where the device first saw it move.
    pub release_sample: u32,
    pub finished_sample: u32,
    pub windows: u16,
    /// Weighted by the square of the amplitude; meaningless where `windows` is zero.
    pub natural_frequency_rad_s: Measured,
    pub damping_ratio: Measured,
    /// Weighted as the network says.
    pub numbers: Numbers<Measured>,
    pub derivatives: Option<Derivatives>,
    pub flags: Flags,
}

/// Yaw derivatives about this axis, per radian, with the standard uncertainties that natural frequencies,
/// damping ratios and the clock give them: those of density, speed, inertia and the model's measures come on
/// top.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Derivatives {
    pub cn_beta: Measured,
    pub cn_r: Measured,
    pub reduced_frequency: f32,
    /// The wind-off release they are held against.
    pub reference_release: u32,
}
