//! What ended the run before, as a board notes it in RAM that a reset leaves as it is.

use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{Cause, Crash, Start, CRASH_FILE};

/// As it stands in RAM: line, length of the path, the path, starts in a row that nobody asked for, CRC-32 of all
/// that. After power has come it holds anything.
#[derive(Clone, Copy, Debug)]
pub struct Note(pub [u8; BYTES]);

const FILE_AT: usize = 5;
const RESTARTS_AT: usize = FILE_AT + CRASH_FILE;
const CRC_AT: usize = RESTARTS_AT + 1;
pub const BYTES: usize = CRC_AT + 4;
/// Length of the path where there was no crash.
const NO_CRASH: u8 = u8::MAX;

impl Note {
    /// One that says nothing: its checksum is wrong.
    pub const NONE: Self = Self([0; BYTES]);

    /// Takes up the note of the run before, now that the board has started by this cause: how this run began, how
    /// many starts in a row nobody has asked for, and the note that stands while it runs.
    pub fn begin(self, cause: Cause) -> (Start, u8, Self) {
        let restarts = match cause {
            Cause::Watchdog | Cause::Software => self.restarts().saturating_add(1),
            Cause::Unknown | Cause::Power | Cause::Pin => 0,
        };
        let mut running = [0; BYTES];
        (running[4], running[RESTARTS_AT]) = (NO_CRASH, restarts);
        (Start { cause, crash: self.crash() }, restarts, Self::sealed(running))
    }

    /// The note of the run that this one stands for, which ends here.
    pub fn crashed(self, file: &str, line: u32) -> Self {
        let end = &file.as_bytes()[file.len().saturating_sub(CRASH_FILE)..];
        let mut bytes = [0; BYTES];
        bytes[..4].copy_from_slice(&line.to_le_bytes());
        bytes[4] = end.len() as u8;
        bytes[FILE_AT..FILE_AT + end.len()].copy_from_slice(end);
        bytes[RESTARTS_AT] = self.restarts();
        Self::sealed(bytes)
    }

    fn sealed(mut bytes: [u8; BYTES]) -> Self {
        let crc = crc32(&bytes[..CRC_AT]);
        bytes[CRC_AT..].copy_from_slice(&crc.to_le_bytes());
        Self(bytes)
    }

    /// Whether it was written as a whole.
    fn is_whole(&self) -> bool {
        self.0[CRC_AT..] == crc32(&self.0[..CRC_AT]).to_le_bytes()
    }

    fn restarts(&self) -> u8 {
        if self.is_whole() {
            self.0[RESTARTS_AT]
        } else {
            0
        }
    }

    fn crash(&self) -> Option<Crash> {
        let Self(bytes) = self;
        if !self.is_whole() {
            return None;
        }
        let line = u32::from_le_bytes(bytes[..4].try_into().ok()?);
        let end = bytes[FILE_AT..RESTARTS_AT].get(..bytes[4].into())?;
        // A path that was cut may begin within a letter.
        let from = end.iter().position(|byte| *byte & 0xc0 != 0x80).unwrap_or(end.len());
        let file = core::str::from_utf8(&end[from..]).ok()?.try_into().ok()?;
        Some(Crash { file, line })
    }
}
