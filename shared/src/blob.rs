//! A network as bytes: what `train` writes, the wire carries and a slot keeps.
//!
//! ```text
//! 0  magic "YRN1"      4  format version u16   6  envelope length u16 (24)
//! 8  payload length    12 generation           16 payload CRC-32   20 CRC-32 of bytes 0..20
//! 24 payload: postcard of [`Payload`]; one without `from_counts` may end before it
//! ```
//! Format 3 has before the payload what else than natural frequency and damping ratio the network says:
//! [`Number`]s and their names. A network that says those two alone is of format 2.
//!
//! Numbers are little-endian. The envelope never changes, so a device can always tell a blob it
//! is too old for from a broken one.

use crate::checksum::{crc32, crc32_of_pieces};
use crate::features::{features, Inputs, MAX_INPUTS};
use crate::history::{History, Moment};
use crate::network::{Network, NetworkError, Number, MAX_OUTPUTS};
use crate::numbers::MAX_NUMBERS;
use crate::source::{in_memory, Bytes, Source};
use crate::window::Window;
use heapless::{String, Vec};
use postcard::Deserializer;
use postcard_schema::Schema;
use serde::ser::{SerializeTuple, Serializer};
use serde::{Deserialize, Serialize};

pub const MAGIC: [u8; 4] = *b"YRN1";
/// 2: the number of inputs is the network's own, layers may be linear, the model it was trained on is named.
pub const FORMAT: u16 = 2;
/// 3: the network says numbers of effects, too.
pub const FORMAT_WITH_NUMBERS: u16 = 3;
pub const ENVELOPE: usize = 24;
/// Longest blob: weights of 4 KiB, golden vectors and the rest.
pub const LONGEST: usize = 8192;
/// Fewest and most golden vectors.
pub const GOLDEN: core::ops::RangeInclusive<usize> = 2..=4;

/// One input vector and the bits the network must make of it on any machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Golden {
    /// Scaled inputs, as bits of `f32`.
    pub inputs: Vec<u32, MAX_INPUTS>,
    pub outputs: OutputBits,
}

/// All that a network says of a window, as bits of `f32`: natural frequency (rad/s), damping ratio, numbers
/// of effects.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputBits(pub Vec<u32, MAX_OUTPUTS>);

/// One after the other: how many there are the network says.
impl Serialize for OutputBits {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut all = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|bits| all.serialize_element(bits))?;
        all.end()
    }
}

/// Identifiers of effects, apart by spaces; empty: the second-order response alone.
pub type EffectIds = String<96>;

/// How a network came about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program that trained it.
    pub trainer: String<16>,
    pub seed: u64,
    pub samples: u32,
    pub epochs: u32,
    /// Noise in the training windows, rms as a share of the peak: lowest and highest.
    pub noise: [f32; 2],
    /// Effects of the model it was trained on.
    pub effects: EffectIds,
}

/// What the envelope is about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Payload {
    pub network: Network,
    pub provenance: Provenance,
    pub golden: Vec<Golden, 4>,
    /// Bits that the network must make of [`from_counts`]' window, by the features and the logarithm before
    /// it, too.
    pub from_counts: Option<OutputBits>,
}

/// Why a blob was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BlobError {
    /// Shorter than its envelope says, or than an envelope, or not to be read to its end.
    Truncated,
    /// Does not begin with the magic.
    NotABlob,
    /// Written in another format.
    Format {
        theirs: u16,
    },
    /// Longer than a slot.
    TooLong,
    EnvelopeCorrupt,
    PayloadCorrupt,
    /// The checksum is right but the contents do not decode.
    Malformed,
    Network(NetworkError),
    /// Fewer than two golden vectors, or not of the topology's inputs.
    GoldenMissing,
    /// This machine's arithmetic does not reproduce this golden vector; one behind the last: its features do
    /// not come out of counts.
    GoldenDiffers {
        vector: u8,
    },
    /// No room in the given buffer.
    NoRoom,
}

/// What the envelope says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Envelope {
    pub format: u16,
    pub payload_length: usize,
    pub generation: u32,
    pub payload_crc: u32,
}

impl Envelope {
    /// Reads and checks the first 24 bytes.
    pub fn read(bytes: &[u8]) -> Result<Self, BlobError> {
        let Some(head) = bytes.first_chunk::<ENVELOPE>() else { return Err(BlobError::Truncated) };
        if head[..4] != MAGIC {
            return Err(BlobError::NotABlob);
        }
        if crc32(&head[..20]) != word(head, 20) {
            return Err(BlobError::EnvelopeCorrupt);
        }
        let format = u16::from_le_bytes([head[4], head[5]]);
        if !(FORMAT..=FORMAT_WITH_NUMBERS).contains(&format) {
            return Err(BlobError::Format { theirs: format });
        }
        let payload_length = word(head, 8) as usize;
        if payload_length > LONGEST - ENVELOPE {
            return Err(BlobError::TooLong);
        }
        let (generation, payload_crc) = (word(head, 12), word(head, 16));
        Ok(Self { format, payload_length, generation, payload_crc })
    }

    /// Length of envelope and payload together.
    pub fn blob_length(&self) -> usize {
        ENVELOPE + self.payload_length
    }

    fn write(&self) -> [u8; ENVELOPE] {
        let mut head = [0; ENVELOPE];
        head[..4].copy_from_slice(&MAGIC);
        head[4..6].copy_from_slice(&self.format.to_le_bytes());
        head[6..8].copy_from_slice(&(ENVELOPE as u16).to_le_bytes());
        head[8..12].copy_from_slice(&(self.payload_length as u32).to_le_bytes());
        head[12..16].copy_from_slice(&self.generation.to_le_bytes());
        head[16..20].copy_from_slice(&self.payload_crc.to_le_bytes());
        let crc = crc32(&head[..20]);
        head[20..24].copy_from_slice(&crc.to_le_bytes());
        head
    }
}

fn word(bytes: &[u8; ENVELOPE], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Writes a blob to `buffer`; returns its length.
pub fn encode(payload: &Payload, generation: u32, buffer: &mut [u8]) -> Result<usize, BlobError> {
    let room = buffer.get_mut(ENVELOPE..).ok_or(BlobError::NoRoom)?;
    let network = &payload.network;
    let (mut format, mut payload_length) = (FORMAT, 0);
    if !network.numbers.is_empty() {
        let first = postcard::to_slice(&(&network.numbers, &network.number_names), room);
        (format, payload_length) =
            (FORMAT_WITH_NUMBERS, first.map_err(|_| BlobError::NoRoom)?.len());
    }
    let rest = postcard::to_slice(payload, &mut room[payload_length..]);
    payload_length += rest.map_err(|_| BlobError::NoRoom)?.len();
    if payload_length > LONGEST - ENVELOPE {
        return Err(BlobError::TooLong);
    }
    let payload_crc = crc32(&room[..payload_length]);
    let envelope = Envelope { format, payload_length, generation, payload_crc };
    buffer[..ENVELOPE].copy_from_slice(&envelope.write());
    Ok(envelope.blob_length())
}

/// Gives a blob another generation, which decides what network of two a device runs.
pub fn set_generation(blob: &mut [u8], generation: u32) -> Result<(), BlobError> {
    let envelope = Envelope { generation, ..Envelope::read(blob)? };
    blob[..ENVELOPE].copy_from_slice(&envelope.write());
    Ok(())
}

/// Reads the envelope and checks that all behind it is as it was written.
pub fn intact(source: &mut Source) -> Result<Envelope, BlobError> {
    let mut head = [0; ENVELOPE];
    if !source(0, &mut head) {
        return Err(BlobError::Truncated);
    }
    let envelope = Envelope::read(&head)?;
    let crc = crc32_of_pieces(ENVELOPE..envelope.blob_length(), source);
    if crc.ok_or(BlobError::Truncated)? != envelope.payload_crc {
        return Err(BlobError::PayloadCorrupt);
    }
    Ok(envelope)
}

/// Reads a blob and checks everything there is to check, the golden vectors bit for bit.
pub fn decode(bytes: &[u8]) -> Result<(Envelope, Payload), BlobError> {
    let mut network = Network::empty();
    let mut golden = Vec::new();
    let (envelope, provenance, from_counts) =
        decode_all(&mut in_memory(bytes), &mut network, |inputs, outputs| {
            let inputs = inputs.iter().map(|x| x.to_bits()).collect();
            // Room is there: they have been counted.
            let _ = golden.push(Golden { inputs, outputs });
        })?;
    Ok((envelope, Payload { network, provenance, golden, from_counts }))
}

/// The same from anywhere into a network that is there already. Where it fails the network is not to be used.
pub fn decode_into(
    source: &mut Source,
    network: &mut Network,
) -> Result<(Envelope, Provenance), BlobError> {
    decode_all(source, network, |_, _| ()).map(|(envelope, provenance, _)| (envelope, provenance))
}

type Decoded = (Envelope, Provenance, Option<OutputBits>);

/// `golden` is given each golden vector.
fn decode_all(
    source: &mut Source,
    network: &mut Network,
    mut golden: impl FnMut(&Inputs, OutputBits),
) -> Result<Decoded, BlobError> {
    let envelope = intact(source)?;
    let mut payload =
        Deserializer::from_flavor(Bytes::new(source, ENVELOPE..envelope.blob_length()));
    network.numbers.clear();
    network.number_names.clear();
    if envelope.format == FORMAT_WITH_NUMBERS {
        network.numbers = next::<Vec<Number, MAX_NUMBERS>>(&mut payload)?;
        network.number_names = text(&mut payload)?;
        if network.numbers.is_empty() {
            return Err(BlobError::Malformed);
        }
    }
    network.read(&mut payload).map_err(|_| BlobError::Malformed)?;
    let trainer = text(&mut payload)?;
    let (seed, samples, epochs, noise) = next(&mut payload)?;
    let effects = text(&mut payload)?;
    let provenance = Provenance { trainer, seed, samples, epochs, noise, effects };
    let vectors: u32 = next(&mut payload)?;
    network.check().map_err(BlobError::Network)?;
    if !GOLDEN.contains(&(vectors as usize)) {
        return Err(BlobError::GoldenMissing);
    }
    // One at a time: a device has no room for more.
    for vector in 0..vectors {
        let count: u32 = next(&mut payload)?;
        if count as usize != network.inputs.count() {
            return Err(BlobError::GoldenMissing);
        }
        let inputs = (0..count).map(|_| next(&mut payload).map(f32::from_bits));
        let inputs: Inputs = inputs.collect::<Result<_, _>>()?;
        let expected = bits(&mut payload, network)?;
        if estimate_bits(network, &inputs) != expected {
            return Err(BlobError::GoldenDiffers { vector: vector as u8 });
        }
        golden(&inputs, expected);
    }
    let rest = payload.finalize().map_err(|_| BlobError::Malformed)?;
    // Trained before there was one, or an option: whether there is one, then it.
    let is_given = !rest.is_empty();
    let mut rest = Deserializer::from_flavor(rest);
    let is_given = is_given && next(&mut rest)?;
    let expected = is_given.then(|| bits(&mut rest, network)).transpose()?;
    if expected.as_ref().is_some_and(|expected| from_counts(network) != *expected) {
        return Err(BlobError::GoldenDiffers { vector: vectors as u8 });
    }
    Ok((envelope, provenance, expected))
}

fn next<'a, T: Deserialize<'a>>(payload: &mut Deserializer<'a, Bytes<'a>>) -> Result<T, BlobError> {
    T::deserialize(payload).map_err(|_| BlobError::Malformed)
}

fn text<'a, const N: usize>(
    payload: &mut Deserializer<'a, Bytes<'a>>,
) -> Result<String<N>, BlobError> {
    let bytes: Vec<u8, N> = next(payload)?;
    String::from_utf8(bytes).map_err(|_| BlobError::Malformed)
}

fn bits<'a>(
    payload: &mut Deserializer<'a, Bytes<'a>>,
    network: &Network,
) -> Result<OutputBits, BlobError> {
    (0..network.outputs()).map(|_| next(payload)).collect::<Result<_, _>>().map(OutputBits)
}

fn estimate_bits(network: &Network, inputs: &[f32]) -> OutputBits {
    let made = network.estimate_inputs(inputs);
    let outputs = [made.natural_frequency_rad_s, made.damping_ratio];
    OutputBits(outputs.iter().chain(made.numbers.iter()).map(|x| x.to_bits()).collect())
}

/// Samples of the window below: three cycles, and some before and after.
const WINDOW: usize = 1024;

/// What a network makes of one window of counts, the same on every machine: three cycles of 900 samples with
/// a damping ratio of 0.01 from 10 deg on, by a recurrence in whole numbers. All that stands between counts
/// and estimate takes part: block sums, bins that begin between samples, features, logarithm, scaling and
/// network.
#[inline(never)]
pub fn from_counts(network: &Network) -> OutputBits {
    // 2 exp(-0.01 x) cos x and exp(-0.02 x) for x = 6 pi / 900, times 2^30; 2000 exp(-0.01 x) sin x, times
    // 2^16.
    const TURN: [i64; 2] = [2_146_563_047, 1_073_292_150];
    const SECOND: i64 = 2_744_390;
    let mut history = History::<i16, WINDOW, { WINDOW / 8 }>::new(0, 0.005);
    let (mut before, mut now) = (0_i64, SECOND);
    for _ in 0..WINDOW {
        history.push((before >> 16) as i16);
        (before, now) = (now, (TURN[0] * now - TURN[1] * before) >> 30);
    }
    let window = Window {
        start: Moment { sample: 10, fraction: 0.375 },
        length: 903.25,
        midline_deg: 0.03125,
        rising: true,
        end: 914,
    };
    let features = features(network.features, &history, &window);
    estimate_bits(network, &network.inputs.apply(&features))
}

/// The golden vector of these scaled inputs.
pub fn golden(network: &Network, inputs: &[f32]) -> Golden {
    Golden {
        inputs: inputs.iter().map(|x| x.to_bits()).collect(),
        outputs: estimate_bits(network, inputs),
    }
}
