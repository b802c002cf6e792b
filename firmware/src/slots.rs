//! Two places for a network in flash, of which one is always whole.
//!
//! An update erases the idle slot, writes the blob, reads it back and verifies everything; the
//! network then runs on trial, from memory. Only once the host has confirmed it is the commit word
//! programmed. Until that word stands the slot does not count, so whenever the power goes, or no
//! confirmation comes, the old network is there. The newest valid slot runs. Generations go round (RFC 1982),
//! so there is one after the last.
//!
//! ```text
//! slot: 0 commit word   u length of the blob   2u blob       u: the write unit of the flash, at least four bytes
//! ```

use crate::flash::{erase, is_erased, program, read, unit};
pub use crate::flash::{MemoryFlash, Sector, ERASED, SLOT_BYTES};
use crate::lock::{self, Challenge};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::blob::{self, BlobError, Envelope, Provenance};
use yawrig_shared::network::Network;
use yawrig_shared::wire::{Refusal, Signature, SlotState};

const COMMITTED: [u8; 4] = *b"LIVE";
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

/// The network store of a device that can be [locked](crate::lock), or cannot: checking signatures takes 14
/// kB of code.
#[derive(Debug)]
pub struct Store<F, const LOCKABLE: bool = true> {
    flash: F,
    update: Option<Update>,
    /// Slots whose networks have passed every check.
    sound: [bool; 2],
    /// Slots that were erased, and not written to since.
    erased: [bool; 2],
}

impl<F: NorFlash> Store<F> {
    pub const fn new(flash: F) -> Self {
        Self::empty(flash)
    }
}

impl<F: NorFlash, const LOCKABLE: bool> Store<F, LOCKABLE> {
    pub(crate) const fn empty(flash: F) -> Self {
        Self { flash, update: None, sound: [false; 2], erased: [false; 2] }
    }

    /// The flash, to write the lock to.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Gives the flash back, as after a power cut.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The newest valid network, read into `network`, and where it stands. Both slots are looked at to the
    /// last golden vector, by which [`Store::state`] goes.
    pub fn newest(&mut self, network: &mut Network) -> Option<(Slot, Envelope, Provenance)> {
        let mut generation = |slot| committed(&mut self.flash, slot).map(|e| e.generation);
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
        let flash = &mut self.flash;
        let decoded = committed(flash, slot)
            .and_then(|_| blob::decode_into(&mut blob_of(flash, slot), network).ok());
        self.sound[slot as usize] = decoded.is_some();
        decoded.map(|(envelope, provenance)| (slot, envelope, provenance))
    }

    /// What a slot holds; valid is what has passed every check ([`Store::newest`]) and is still as it was.
    pub fn state(&mut self, slot: Slot) -> SlotState {
        let flash = &mut self.flash;
        if is_erased(flash, slot.into(), 0, SLOT_BYTES) {
            return SlotState::Empty;
        }
        match committed(flash, slot) {
            Some(Envelope { generation, payload_crc: id, .. })
                if self.sound[slot as usize] && blob::intact(&mut blob_of(flash, slot)).is_ok() =>
            {
                SlotState::Valid { generation, id }
            }
            _ => SlotState::Invalid,
        }
    }

    /// Whether what an update would be written to has to be erased first. What looks erased need not be: the
    /// power may have cut it.
    pub fn wants_erase(&self, running: Option<Slot>) -> bool {
        !self.erased[idle(running) as usize]
    }

    /// Erases the slot that does not run, unless nothing was written since, and makes ready for `length` bytes.
    pub fn begin(&mut self, length: u32, running: Option<Slot>) -> Result<(), Refusal> {
        let length = length as usize;
        self.update = None;
        if length < blob::ENVELOPE {
            return Err(Refusal::Blob(BlobError::Truncated));
        }
        if length > blob::LONGEST {
            return Err(Refusal::Blob(BlobError::TooLong));
        }
        let slot = idle(running);
        self.sound[slot as usize] = false;
        if self.wants_erase(running) {
            self.erase(slot)?;
        }
        self.update = Some(Update { slot, length, written: 0, verified: false });
        Ok(())
    }

    /// Leaves nothing in a slot.
    pub fn erase(&mut self, slot: Slot) -> Result<(), Refusal> {
        self.sound[slot as usize] = false;
        erase(&mut self.flash, slot.into())?;
        self.erased[slot as usize] = true;
        Ok(())
    }

    /// Writes the next bytes. All chunks but the last are whole write units.
    pub fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let mut update = self.running_update()?;
        let last = update.written + bytes.len() == update.length;
        let in_order = offset as usize == update.written
            && update.written + bytes.len() <= update.length
            && (bytes.len().is_multiple_of(unit::<F>()) || last);
        if !in_order {
            return Err(Refusal::FlashOrder { expected_offset: update.written as u32 });
        }
        self.erased[update.slot as usize] = false;
        self.program(update.slot, blob_at::<F>() + update.written, bytes)?;
        update.written += bytes.len();
        self.update = Some(update);
        Ok(())
    }

    /// Verifies what was written and reads it into `network`, which is not to be used where this fails.
    /// `newest` is the generation that runs.
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
        if LOCKABLE {
            let at = blob_at::<F>();
            let places = at..at + update.length;
            lock::check_network(&mut self.flash, update.slot.into(), places, challenge, signature)?;
        }
        let (envelope, provenance) =
            blob::decode_into(&mut blob_of(&mut self.flash, update.slot), network)
                .map_err(Refusal::Blob)?;
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
        self.program(update.slot, unit::<F>(), &(update.length as u32).to_le_bytes())?;
        self.program(update.slot, 0, &COMMITTED)?;
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

    fn program(&mut self, slot: Slot, offset: usize, bytes: &[u8]) -> Result<(), Refusal> {
        program(&mut self.flash, slot.into(), offset, bytes)
    }
}

/// The slot that an update goes to.
fn idle(running: Option<Slot>) -> Slot {
    running.map_or(Slot::First, Slot::other)
}

/// In numbers that go round.
pub fn is_newer(generation: u32, than: u32) -> bool {
    generation.wrapping_sub(than) as i32 > 0
}

/// Where in a slot the blob begins.
const fn blob_at<F: NorFlash>() -> usize {
    2 * unit::<F>()
}

/// The blob of a slot, from wherever it is read.
fn blob_of<F: NorFlash>(flash: &mut F, slot: Slot) -> impl FnMut(usize, &mut [u8]) -> bool + '_ {
    move |offset, room| read(flash, slot.into(), blob_at::<F>() + offset, room)
}

/// The envelope of a slot whose commit word stands.
fn committed<F: NorFlash>(flash: &mut F, slot: Slot) -> Option<Envelope> {
    let mut word = |offset: usize| {
        let mut word = [ERASED; 4];
        read(flash, slot.into(), offset, &mut word).then_some(word)
    };
    if word(0)? != COMMITTED {
        return None;
    }
    let length = u32::from_le_bytes(word(unit::<F>())?) as usize;
    let mut head = [ERASED; blob::ENVELOPE];
    let envelope = blob_of(flash, slot)(0, &mut head).then(|| Envelope::read(&head).ok())??;
    (length == envelope.blob_length()).then_some(envelope)
}
