//! Who may write: a device that is locked with an ed25519 public key takes only networks whose writing its private key
//! has signed for.
//!
//! A board says whether its device can be locked at all ([`Flash::LOCKABLE`]). Unlocked as it comes. Anyone may lock an
//! unlocked device; unlocking needs the private key. What stands in a slot was checked before it was committed and is
//! not checked again at the start: who can write the flash past the device can erase its lock, too, and networks from
//! before the lock stay.
//!
//! Every signature is of a challenge: a number that the flash keeps and that only rises, and a nonce that counts the
//! challenges since the start. The first challenge after a start raises the number, so no pair ever comes twice, and
//! what was recorded on the line opens and writes nothing a second time. It is not of this device: devices that share
//! a key should not share a line that strangers listen to.
//!
//! The lock is the newest record of a log in two sectors. A record counts where its checksum, which is written last, is
//! right. Where one sector is full the other is erased and goes on, so the newest record is never in a sector that is
//! being erased: whenever the power goes the device is as before or as wanted, and no number comes again.
//!
//! ```text
//! record: 0 number   4 LOCK or OPEN   8 public key   40 unused   44 CRC-32 of bytes 0..44
//! ```

use crate::flash::{erase, program, Flash, Sector, ERASED, SLOT_BYTES};
use ed25519_compact::{PublicKey, Signature as Ed25519};
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{network_message, unlock_message, update_message, Refusal, Signature};

const RECORD: usize = 48;
const CHECKED: usize = RECORD - 4;
const LOCKED: u32 = u32::from_le_bytes(*b"LOCK");
const OPEN: u32 = u32::from_le_bytes(*b"OPEN");
const LOG: [Sector; 2] = [Sector::Lock, Sector::OtherLock];

/// A lock that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lock {
    /// Of all records this device has had.
    pub number: u32,
    pub key: [u8; 32],
}

/// What a signature is of beside its subject: the lock's number and a nonce.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Challenge {
    pub number: u32,
    pub nonce: u32,
}

/// A record that counts.
#[derive(Clone, Copy, Debug)]
struct Record {
    sector: Sector,
    number: u32,
    state: u32,
    key: [u8; 32],
}

fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes)
}

fn whole(sector: Sector, record: &[u8]) -> Option<Record> {
    if record[CHECKED..] == [ERASED; 4] {
        // As most are.
        return None;
    }
    let state = word(record, 4);
    let is_whole = crc32(&record[..CHECKED]) == word(record, CHECKED);
    (is_whole && (state == LOCKED || state == OPEN)).then_some(())?;
    Some(Record { sector, number: word(record, 0), state, key: record[8..40].try_into().ok()? })
}

fn newest<F: Flash>(flash: &F) -> Option<Record> {
    let of = |sector: Sector| {
        flash.read(sector).chunks_exact(RECORD).filter_map(move |record| whole(sector, record))
    };
    LOG.into_iter().flat_map(of).max_by_key(|record| record.number)
}

/// The lock of this flash, if it has one.
pub fn read<F: Flash>(flash: &F) -> Option<Lock> {
    if !F::LOCKABLE {
        return None;
    }
    let Record { number, state, key, .. } = newest(flash)?;
    (state == LOCKED).then_some(Lock { number, key })
}

/// Writes the record after `last`; its number.
fn append<F: Flash>(
    flash: &mut F,
    last: Option<&Record>,
    state: u32,
    key: &[u8; 32],
) -> Result<u32, Refusal> {
    let number = last.map_or(0, |last| last.number).checked_add(1).ok_or(Refusal::FlashWrite)?;
    let mut sector = last.map_or(LOG[0], |last| last.sector);
    let used = |record: &[u8]| record.iter().any(|&byte| byte != ERASED);
    let mut records = flash.read(sector).chunks_exact(RECORD);
    let mut at = records.rposition(used).map_or(0, |last| RECORD * (last + 1));
    if at + RECORD > SLOT_BYTES {
        // Nothing there is newer than what stands in the full one.
        sector = if sector == LOG[0] { LOG[1] } else { LOG[0] };
        erase(flash, sector)?;
        at = 0;
    }
    let mut record = [ERASED; RECORD];
    record[..4].copy_from_slice(&number.to_le_bytes());
    record[4..8].copy_from_slice(&state.to_le_bytes());
    record[8..40].copy_from_slice(key);
    let crc = crc32(&record[..CHECKED]);
    record[CHECKED..].copy_from_slice(&crc.to_le_bytes());
    for (index, word) in record.chunks_exact(4).enumerate() {
        program(flash, sector, at + 4 * index, [word[0], word[1], word[2], word[3]])?;
    }
    Ok(number)
}

/// Locks an unlocked device.
///
/// # Errors
/// [`Refusal::CannotLock`], [`Refusal::LockedAlready`], [`Refusal::NotAKey`], or the flash's.
pub fn lock<F: Flash>(flash: &mut F, key: &[u8; 32]) -> Result<(), Refusal> {
    if !F::LOCKABLE {
        return Err(Refusal::CannotLock);
    }
    let last = newest(flash);
    if last.is_some_and(|last| last.state == LOCKED) {
        return Err(Refusal::LockedAlready);
    }
    // Else nothing could ever open it.
    if PublicKey::from_slice(key).and_then(|key| key.validate()).is_err() {
        return Err(Refusal::NotAKey);
    }
    append(flash, last.as_ref(), LOCKED, key).map(drop)
}

/// Raises the number of a lock, so that it has never been in a challenge.
///
/// # Errors
/// [`Refusal::NotLocked`], or the flash's.
pub fn renew<F: Flash>(flash: &mut F) -> Result<u32, Refusal> {
    let Lock { key, .. } = read(flash).ok_or(Refusal::NotLocked)?;
    append(flash, newest(flash).as_ref(), LOCKED, &key)
}

/// Opens a locked device, if its key has signed the [`unlock_message`] of this challenge.
///
/// # Errors
/// [`Refusal::NotLocked`], [`Refusal::WrongSignature`], or the flash's.
pub fn unlock<F: Flash>(
    flash: &mut F,
    challenge: Challenge,
    signature: &Signature,
) -> Result<(), Refusal> {
    let lock = of_challenge(flash, challenge)?;
    check(&lock.key, &[&unlock_message(challenge.number, challenge.nonce)], signature)?;
    append(flash, newest(flash).as_ref(), OPEN, &lock.key).map(drop)
}

/// Whether the key of a locked device has signed the [`update_message`] of this challenge.
///
/// # Errors
/// [`Refusal::NotLocked`], [`Refusal::WrongSignature`].
pub fn check_update(
    flash: &impl Flash,
    challenge: Challenge,
    length: u32,
    signature: &Signature,
) -> Result<(), Refusal> {
    let lock = of_challenge(flash, challenge)?;
    let Challenge { number, nonce } = challenge;
    check(&lock.key, &[&update_message(number, nonce, length)], signature)
}

/// Whether this device may take the network in `blob`: unlocked any, locked one that was begun upon this challenge
/// and that its key has signed with it.
///
/// # Errors
/// [`Refusal::Unsigned`] or [`Refusal::WrongSignature`] on a locked device.
pub fn check_network(
    flash: &impl Flash,
    blob: &[u8],
    challenge: Option<Challenge>,
    signature: Option<&Signature>,
) -> Result<(), Refusal> {
    if read(flash).is_none() {
        return Ok(());
    }
    let challenge = challenge.ok_or(Refusal::Unsigned)?;
    let lock = of_challenge(flash, challenge)?;
    let signature = signature.ok_or(Refusal::Unsigned)?;
    check(&lock.key, &[&network_message(challenge.number, challenge.nonce), blob], signature)
}

/// The lock that gave this challenge.
fn of_challenge(flash: &impl Flash, challenge: Challenge) -> Result<Lock, Refusal> {
    let lock = read(flash).ok_or(Refusal::NotLocked)?;
    if lock.number != challenge.number {
        return Err(Refusal::WrongSignature);
    }
    Ok(lock)
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
