//! Two places for a network in flash, of which one is always whole.
//!
//! An update erases the idle slot, writes the blob, reads it back and verifies everything; the
//! network then runs on trial, from memory. Only once the host has confirmed it is the commit word
//! programmed. Until that word stands the slot does not count, so whenever the power goes, or no
//! confirmation comes, the old network is there. The newest valid slot runs. Generations go round (RFC 1982), so there
//! is one after the last.
//!
//! ```text
//! slot: 0 commit word   4 length of the blob   8 blob
//! ```

use crate::flash::{erase, program};
pub use crate::flash::{Flash, FlashFault, MemoryFlash, Sector, ERASED, SLOT_BYTES};
use crate::lock::{self, Challenge};
use yawrig_shared::blob::{self, BlobError, Envelope, Provenance};
use yawrig_shared::network::Network;
use yawrig_shared::wire::{Refusal, Signature, SlotState};

const COMMITTED: u32 = u32::from_le_bytes(*b"LIVE");
const BLOB_AT: usize = 8;
/// One of the two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    First,
    Second,
}

impl Slot {
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];

    pub fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

impl From<Slot> for Sector {
    fn from(slot: Slot) -> Self {
        match slot {
            Slot::First => Self::First,
            Slot::Second => Self::Second,
        }
    }
}

/// A running update.
#[derive(Clone, Copy, Debug)]
struct Update {
    slot: Slot,
    length: usize,
    written: usize,
    /// Found good: its network may be committed.
    verified: bool,
}

/// The network store.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    update: Option<Update>,
    /// Slots whose networks have passed every check.
    sound: [bool; 2],
}

impl<F: Flash> Store<F> {
    pub const fn new(flash: F) -> Self {
        Self { flash, update: None, sound: [false; 2] }
    }

    /// The flash itself.
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// The same to write the lock to.
    pub fn flash_mut(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Gives the flash back, as after a power cut.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The newest valid network, read into `network`, and where it stands. Both slots are looked at to the last golden
    /// vector, by which [`Store::state`] goes.
    pub fn newest(&mut self, network: &mut Network) -> Option<(Slot, Envelope, Provenance)> {
        let generation = |slot: Slot| committed(self.flash.read(slot.into())).map(|e| e.generation);
        let last = match (generation(Slot::First), generation(Slot::Second)) {
            (Some(first), Some(second)) if is_newer(second, first) => Slot::Second,
            (None, Some(_)) => Slot::Second,
            _ => Slot::First,
        };
        // The newest is read last: it stays in `network`.
        let other = self.decode(last.other(), network);
        let newest = self.decode(last, network);
        // Where it does not pass, the other one once more.
        newest.or_else(|| other.and_then(|_| self.decode(last.other(), network)))
    }

    fn decode(
        &mut self,
        slot: Slot,
        network: &mut Network,
    ) -> Option<(Slot, Envelope, Provenance)> {
        let bytes = self.flash.read(slot.into());
        let decoded =
            committed(bytes).and_then(|_| blob::decode_into(&bytes[BLOB_AT..], network).ok());
        self.sound[slot as usize] = decoded.is_some();
        decoded.map(|(envelope, provenance)| (slot, envelope, provenance))
    }

    /// What a slot holds; valid is what has passed every check ([`Store::newest`]) and is still as it was.
    pub fn state(&self, slot: Slot) -> SlotState {
        let bytes = self.flash.read(slot.into());
        if bytes.iter().all(|&byte| byte == ERASED) {
            return SlotState::Empty;
        }
        match committed(bytes) {
            Some(Envelope { generation, payload_crc: id, .. })
                if self.sound[slot as usize] && blob::intact(&bytes[BLOB_AT..]).is_ok() =>
            {
                SlotState::Valid { generation, id }
            }
            _ => SlotState::Invalid,
        }
    }

    /// Erases the slot that does not run and makes ready for `length` bytes.
    pub fn begin(&mut self, length: u32, running: Option<Slot>) -> Result<(), Refusal> {
        let length = length as usize;
        self.update = None;
        if length < blob::ENVELOPE {
            return Err(Refusal::Blob(BlobError::Truncated));
        }
        if length > blob::LONGEST {
            return Err(Refusal::Blob(BlobError::TooLong));
        }
        let slot = running.map_or(Slot::First, Slot::other);
        self.sound[slot as usize] = false;
        erase(&mut self.flash, slot.into())?;
        self.update = Some(Update { slot, length, written: 0, verified: false });
        Ok(())
    }

    /// Writes the next bytes. All chunks but the last are a multiple of four bytes long.
    pub fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let mut update = self.running_update()?;
        let last = update.written + bytes.len() == update.length;
        let in_order = offset as usize == update.written
            && update.written + bytes.len() <= update.length
            && (bytes.len().is_multiple_of(4) || last);
        if !in_order {
            return Err(Refusal::FlashOrder { expected_offset: update.written as u32 });
        }
        for (i, four) in bytes.chunks(4).enumerate() {
            let mut word = [ERASED; 4];
            word[..four.len()].copy_from_slice(four);
            self.program(update.slot, BLOB_AT + update.written + 4 * i, word)?;
        }
        update.written += bytes.len();
        self.update = Some(update);
        Ok(())
    }

    /// Verifies what was written and reads it into `network`, which is not to be used where this fails. `newest` is
    /// the generation that runs.
    pub fn verify(
        &mut self,
        newest: u32,
        network: &mut Network,
        challenge: Option<Challenge>,
        signature: Option<&Signature>,
    ) -> Result<(Slot, Envelope, Provenance), Refusal> {
        let update = self.running_update()?;
        if update.written != update.length {
            return Err(Refusal::FlashOrder { expected_offset: update.written as u32 });
        }
        self.update = None;
        let bytes = &self.flash.read(update.slot.into())[BLOB_AT..BLOB_AT + update.length];
        lock::check_network(&self.flash, bytes, challenge, signature)?;
        let (envelope, provenance) = blob::decode_into(bytes, network).map_err(Refusal::Blob)?;
        if envelope.blob_length() != update.length {
            return Err(Refusal::Blob(BlobError::Malformed));
        }
        if !is_newer(envelope.generation, newest) {
            return Err(Refusal::Stale { newest });
        }
        self.update = Some(Update { verified: true, ..update });
        Ok((update.slot, envelope, provenance))
    }

    /// Makes the network that was verified the one that runs from now on.
    pub fn commit(&mut self) -> Result<(), Refusal> {
        let Some(update) = self.update.take_if(|update| update.verified) else {
            return Err(Refusal::NoTrial);
        };
        self.program(update.slot, 4, (update.length as u32).to_le_bytes())?;
        self.program(update.slot, 0, COMMITTED.to_le_bytes())?;
        self.sound[update.slot as usize] = true;
        Ok(())
    }

    /// Forgets the update; what it wrote stays uncommitted.
    pub fn abandon(&mut self) {
        self.update = None;
    }

    fn running_update(&self) -> Result<Update, Refusal> {
        self.update
            .filter(|update| !update.verified)
            .ok_or(Refusal::FlashOrder { expected_offset: 0 })
    }

    fn program(&mut self, slot: Slot, offset: usize, word: [u8; 4]) -> Result<(), Refusal> {
        program(&mut self.flash, slot.into(), offset, word)
    }
}

/// In numbers that go round.
pub fn is_newer(generation: u32, than: u32) -> bool {
    generation.wrapping_sub(than) as i32 > 0
}

/// The envelope of a slot whose commit word stands.
fn committed(slot: &[u8; SLOT_BYTES]) -> Option<Envelope> {
    let word = |at: usize| u32::from_le_bytes([slot[at], slot[at + 1], slot[at + 2], slot[at + 3]]);
    if word(0) != COMMITTED {
        return None;
    }
    let envelope = Envelope::read(&slot[BLOB_AT..]).ok()?;
    (word(4) as usize == envelope.blob_length()).then_some(envelope)
}
