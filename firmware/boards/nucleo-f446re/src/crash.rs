//! What ended the run before: noted in RAM that a reset leaves as it is, and the reset's cause.

use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{Cause, Crash, CRASH_FILE};

// RCC_CSR, RM0390, 6.3.21.
const CSR_BROWN_OUT: u32 = 1 << 25;
const CSR_PIN: u32 = 1 << 26;
const CSR_POWER: u32 = 1 << 27;
const CSR_SOFTWARE: u32 = 1 << 28;
const CSR_WATCHDOGS: u32 = 0b11 << 29;

/// Which of the causes it was; the pin is pulled by all the others, too.
pub fn cause(csr: u32) -> Cause {
    match csr {
        _ if csr & (CSR_POWER | CSR_BROWN_OUT) != 0 => Cause::Power,
        _ if csr & CSR_WATCHDOGS != 0 => Cause::Watchdog,
        _ if csr & CSR_SOFTWARE != 0 => Cause::Software,
        _ if csr & CSR_PIN != 0 => Cause::Pin,
        _ => Cause::Unknown,
    }
}

/// As it stands in RAM: line, length of the path, the path, CRC-32 of all that. After power has come it holds anything.
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
