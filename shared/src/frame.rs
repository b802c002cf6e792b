//! Frames on the serial line.
//!
//! ```text
//! 00 | COBS( version u8 | key u32 | sequence u16 | postcard body | CRC-32 ) | 00
//! ```
//! Numbers are little-endian; the CRC covers all before it. A key is the hash of a message
//! type's name and shape, so one changed type cannot be taken for another. A request that is
//! sent again keeps its sequence number, and the device repeats its reply without acting twice.
//! Events have a sequence of their own. [`crate::wire::Hello`] has a key and an encoding that never change:
//! with it two programs of any age find out whether they can talk.

use crate::checksum::crc32;
use heapless::Vec;
use postcard_schema::key::Key;
use postcard_schema::Schema;
use serde::{de::DeserializeOwned, Serialize};

/// Key of [`Hello`](crate::wire::Hello) and [`HelloReply`](crate::wire::HelloReply): "HELO".
pub const HELLO_KEY: u32 = u32::from_le_bytes(*b"HELO");
/// First byte of every frame.
pub const VERSION: u8 = 1;
/// Longest frame before COBS: header, body and CRC.
pub const LONGEST_FRAME: usize = 416;
/// Longest frame on the line, both zeros included.
pub const LONGEST_ENCODED: usize = LONGEST_FRAME + LONGEST_FRAME / 254 + 3;
const HEADER: usize = 7;
const TRAILER: usize = 4;

/// A message type with its key.
pub trait Message: Schema + Serialize + DeserializeOwned {
    const KEY: u32 = {
        let hash = Key::for_path::<Self>(Self::NAME).to_bytes();
        u32::from_le_bytes([hash[0], hash[1], hash[2], hash[3]])
    };
    /// The name hashed with the shape.
    const NAME: &'static str;
}

/// Why bytes between two zeros are no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// Longer than any frame.
    TooLong,
    /// Not COBS, or too short.
    Malformed,
    Checksum,
    /// Of another version of this protocol, and not a hello, which all versions read.
    Version(u8),
    /// Right frame, wrong contents.
    Body,
}

/// A frame that has passed its checksum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    pub key: u32,
    pub sequence: u16,
    pub body: &'a [u8],
}

impl Frame<'_> {
    /// The body as a message; `None` where the key is another's.
    pub fn message<M: Message>(&self) -> Option<Result<M, FrameError>> {
        (self.key == M::KEY).then(|| postcard::from_bytes(self.body).map_err(|_| FrameError::Body))
    }
}

/// Bytes of one frame, ready for the line.
pub type Encoded = Vec<u8, LONGEST_ENCODED>;

/// A message as a frame.
pub fn encode<M: Message>(sequence: u16, message: &M) -> Result<Encoded, FrameError> {
    let mut body = [0; LONGEST_FRAME - HEADER - TRAILER];
    let body = postcard::to_slice(message, &mut body).map_err(|_| FrameError::TooLong)?;
    encode_raw(M::KEY, sequence, body)
}

/// A body of any kind as a frame.
pub fn encode_raw(key: u32, sequence: u16, body: &[u8]) -> Result<Encoded, FrameError> {
    let mut frame = Vec::<u8, LONGEST_FRAME>::new();
    let mut push = |bytes: &[u8]| frame.extend_from_slice(bytes).map_err(|_| FrameError::TooLong);
    push(&[VERSION])?;
    push(&key.to_le_bytes())?;
    push(&sequence.to_le_bytes())?;
    push(body)?;
    let crc = crc32(&frame);
    frame.extend_from_slice(&crc.to_le_bytes()).map_err(|_| FrameError::TooLong)?;
    let mut line = Encoded::new();
    // As long as the longest frame can become: COBS adds one byte in 254, and one.
    let _ = line.resize_default(LONGEST_ENCODED);
    let coded = cobs::try_encode(&frame, &mut line[1..LONGEST_ENCODED - 1])
        .map_err(|_| FrameError::TooLong)?;
    line.truncate(coded + 2);
    Ok(line)
}

/// Cuts a stream of bytes into frames. Garbage before the first zero, and between frames, is
/// reported and passed over.
#[derive(Clone, Debug)]
pub struct Decoder {
    buffer: [u8; LONGEST_ENCODED],
    length: usize,
    overflow: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    pub const fn new() -> Self {
        Self { buffer: [0; LONGEST_ENCODED], length: 0, overflow: false }
    }

    /// A byte was lost: the frame it was in is dropped.
    pub fn overrun(&mut self) {
        self.overflow = true;
    }

    /// Takes one byte; a frame or an error where it ends one.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<'_>, FrameError>> {
        if byte != 0 {
            match self.buffer.get_mut(self.length) {
                Some(place) => *place = byte,
                None => self.overflow = true,
            }
            self.length += 1;
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.overflow) {
            return Some(Err(FrameError::TooLong));
        }
        (length > 0).then(|| open(&mut self.buffer[..length]))
    }
}

/// What stands between two zeros, as a frame.
fn open(coded: &mut [u8]) -> Result<Frame<'_>, FrameError> {
    let length = cobs::decode_in_place(coded).map_err(|_| FrameError::Malformed)?;
    if length < HEADER + TRAILER {
        return Err(FrameError::Malformed);
    }
    let (content, trailer) = coded[..length].split_at(length - TRAILER);
    if crc32(content).to_le_bytes() != *trailer {
        return Err(FrameError::Checksum);
    }
    let key = u32::from_le_bytes([content[1], content[2], content[3], content[4]]);
    // Two programs of different versions must be able to tell each other so.
    if content[0] != VERSION && key != HELLO_KEY {
        return Err(FrameError::Version(content[0]));
    }
    Ok(Frame {
        key,
        sequence: u16::from_le_bytes([content[5], content[6]]),
        body: &content[HEADER..],
    })
}
