//! What ended the run before, as a board notes it in RAM that a reset leaves as it is.

use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{Crash, CRASH_FILE};

/// As it stands in RAM: line, length of the path, the path, CRC-32 of all that. After power has come it holds
/// anything.
#[derive(Clone, Copy, Debug)]
pub struct Note(pub [u8; BYTES]);

const FILE_AT: usize = 5;
const CRC_AT: usize = FILE_AT + CRASH_FILE;
pub const BYTES: usize = CRC_AT + 4;

impl Note {
    /// One that says nothing: its checksum is wrong.
    pub const NONE: Self = Self([0; BYTES]);

    pub fn new(file: &str, line: u32) -> Self {
        let end = &file.as_bytes()[file.len().saturating_sub(CRASH_FILE)..];
        let mut bytes = [0; BYTES];
        bytes[..4].copy_from_slice(&line.to_le_bytes());
        bytes[4] = end.len() as u8;
        bytes[FILE_AT..FILE_AT + end.len()].copy_from_slice(end);
        let crc = crc32(&bytes[..CRC_AT]);
        bytes[CRC_AT..].copy_from_slice(&crc.to_le_bytes());
        Self(bytes)
    }

    /// What it says, if it was written as a whole.
    pub fn read(&self) -> Option<Crash> {
        let Self(bytes) = self;
        let line = u32::from_le_bytes(bytes[..4].try_into().ok()?);
        if bytes[CRC_AT..] != crc32(&bytes[..CRC_AT]).to_le_bytes() {
            return None;
        }
        let end = bytes[FILE_AT..CRC_AT].get(..bytes[4].into())?;
        // A path that was cut may begin within a letter.
        let from = end.iter().position(|byte| *byte & 0xc0 != 0x80).unwrap_or(end.len());
        let file = core::str::from_utf8(&end[from..]).ok()?.try_into().ok()?;
        Some(Crash { file, line })
    }
}
