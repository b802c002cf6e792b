//! Who may write: a device that is locked with an ed25519 public key takes only networks signed with its private key.
//!
//! A board says whether its device can be locked at all ([`Flash::LOCKABLE`]). Unlocked as it comes. Anyone may lock an
//! unlocked device; unlocking needs the private key. What stands in a slot was checked before it was committed and is
//! not checked again at the start: who can write the flash past the device can erase its lock, too, and networks from
//! before the lock stay. A signature is of the network alone: an older network of the same key's is taken, too. The
//! answer that unlocks is of this lock's number and of a nonce, not of this device: devices that share a key should
//! not share a line that strangers listen to.
//!
//! The flash sector of the lock holds records one after the other; unlocking voids the last. A lock counts once its
//! first word stands, which is written last, so whenever the power goes the device is as before or as wanted.
//!
//! ```text
//! record: 0 state word   4 number of the lock   8 public key   40 CRC-32 of bytes 4..40   44 unused
//! ```

use crate::slots::{erase, program, Flash, Sector, ERASED, SLOT_BYTES};
use ed25519_compact::{PublicKey, Signature as Ed25519};
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{unlock_message, Refusal, Signature, SIGNED_NETWORK};

const RECORD: usize = 48;
const LOCKED: u32 = u32::from_le_bytes(*b"LOCK");
const VOID: u32 = 0;

/// A lock that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lock {
    at: usize,
    /// Of all this device has had.
    pub number: u32,
    pub key: [u8; 32],
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes)
}

fn records(sector: &[u8; SLOT_BYTES]) -> impl Iterator<Item = (usize, &[u8])> {
    sector.chunks_exact(RECORD).enumerate().map(|(index, record)| (index * RECORD, record))
}

fn is_whole(record: &[u8]) -> bool {
    crc32(&record[4..40]) == word(record, 40)
}

/// The lock of this flash, if it has one.
pub fn read<F: Flash>(flash: &F) -> Option<Lock> {
    if !F::LOCKABLE {
        return None;
    }
    let held = |(_, record): &(usize, &[u8])| word(record, 0) == LOCKED && is_whole(record);
    let (at, record) = records(flash.read(Sector::Lock)).filter(held).last()?;
    Some(Lock { at, number: word(record, 4), key: record[8..40].try_into().ok()? })
}

/// Locks an unlocked device.
///
/// # Errors
/// [`Refusal::CannotLock`], [`Refusal::LockedAlready`], [`Refusal::NotAKey`], or the flash's.
pub fn lock<F: Flash>(flash: &mut F, key: &[u8; 32]) -> Result<(), Refusal> {
    if !F::LOCKABLE {
        return Err(Refusal::CannotLock);
    }
    if read(flash).is_some() {
        return Err(Refusal::LockedAlready);
    }
    // Else nothing could ever open it.
    if PublicKey::from_slice(key).and_then(|key| key.validate()).is_err() {
        return Err(Refusal::NotAKey);
    }
    let sector = flash.read(Sector::Lock);
    let last = records(sector).filter(|(_, record)| is_whole(record)).map(|(_, r)| word(r, 4));
    let number = last.max().unwrap_or(0).wrapping_add(1);
    let used = |(_, record): &(usize, &[u8])| record.iter().any(|&byte| byte != ERASED);
    let mut at = records(sector).filter(used).last().map_or(0, |(at, _)| at + RECORD);
    if at + RECORD > SLOT_BYTES || sector[at..].iter().any(|&byte| byte != ERASED) {
        erase(flash, Sector::Lock)?;
        at = 0;
    }
    let mut record = [ERASED; RECORD];
    record[4..8].copy_from_slice(&number.to_le_bytes());
    record[8..40].copy_from_slice(key);
    let crc = crc32(&record[4..40]);
    record[40..44].copy_from_slice(&crc.to_le_bytes());
    for (index, word) in record.chunks_exact(4).enumerate().skip(1) {
        program(flash, Sector::Lock, at + 4 * index, [word[0], word[1], word[2], word[3]])?;
    }
    program(flash, Sector::Lock, at, LOCKED.to_le_bytes())
}

/// Opens a locked device, if the signature is of this lock's number and `nonce` by its key.
///
/// # Errors
/// [`Refusal::NotLocked`], [`Refusal::WrongSignature`], or the flash's.
pub fn unlock<F: Flash>(flash: &mut F, nonce: u32, signature: &Signature) -> Result<(), Refusal> {
    let Some(lock) = read(flash) else { return Err(Refusal::NotLocked) };
    check(&lock.key, &[&unlock_message(lock.number, nonce)], signature)?;
    program(flash, Sector::Lock, lock.at, VOID.to_le_bytes())
}

/// Whether this device may take the network in `blob`.
///
/// # Errors
/// [`Refusal::Unsigned`] or [`Refusal::WrongSignature`] on a locked device.
pub fn check_network(
    flash: &impl Flash,
    blob: &[u8],
    signature: Option<&Signature>,
) -> Result<(), Refusal> {
    match (read(flash), signature) {
        (None, _) => Ok(()),
        (Some(_), None) => Err(Refusal::Unsigned),
        (Some(lock), Some(signature)) => check(&lock.key, &[SIGNED_NETWORK, blob], signature),
    }
}

#[inline(never)]
fn check(key: &[u8; 32], message: &[&[u8]], signature: &Signature) -> Result<(), Refusal> {
    let checked = || {
        let signature = Ed25519::from_slice(signature)?;
        let mut state = PublicKey::from_slice(key)?.verify_incremental(&signature)?;
        message.iter().for_each(|part| state.absorb(part));
        state.verify()
    };
    checked().map_err(|_| Refusal::WrongSignature)
}
