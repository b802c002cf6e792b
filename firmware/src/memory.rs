//! What a board keeps over a reset in RAM that the reset leaves as it is: the wind-off results that others
//! are held against, and the number of releases. Power that goes takes it away; what a rig did before that is
//! no reference for what it does after.

use crate::reference::Reference;
use serde::{Deserialize, Serialize};
use yawrig_shared::checksum::crc32;

/// Room for all of it.
pub const BYTES: usize = 256;
/// Behind length and checksum.
const BODY: usize = 6;

/// As it stands in RAM: length u16, CRC-32 of the body, the body. After power has come it holds anything.
#[derive(Clone, Copy, Debug)]
pub struct Memory(pub [u8; BYTES]);

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Kept {
    /// The network by which the windows' results were made.
    pub network: u32,
    pub releases: u32,
    pub reference: Reference,
    pub refined_reference: Reference,
}

impl Memory {
    /// One that says nothing: its checksum is wrong.
    pub const NONE: Self = Self([0; BYTES]);

    #[inline(never)]
    pub(crate) fn new(kept: &Kept) -> Self {
        let mut bytes = [0; BYTES];
        let Ok(body) = postcard::to_slice(kept, &mut bytes[BODY..]) else { return Self::NONE };
        let (length, crc) = (body.len() as u16, crc32(body));
        bytes[..2].copy_from_slice(&length.to_le_bytes());
        bytes[2..BODY].copy_from_slice(&crc.to_le_bytes());
        Self(bytes)
    }

    #[inline(never)]
    pub(crate) fn read(&self) -> Option<Kept> {
        let Self(bytes) = self;
        let length = usize::from(u16::from_le_bytes([bytes[0], bytes[1]]));
        let body = bytes[BODY..].get(..length).filter(|body| !body.is_empty())?;
        (bytes[2..BODY] == crc32(body).to_le_bytes()).then(|| postcard::from_bytes(body).ok())?
    }
}
