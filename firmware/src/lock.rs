//! Who may write: a device that is locked with an ed25519 public key takes only networks whose writing its private key
//! has signed for.
//!
//! A board says whether its device can be locked at all ([`crate::device::Device::without_lock`]). Unlocked as it comes. Anyone may lock an
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
//! record: 0 number   4 LOCK or OPEN   8 public key   40 unused   44 CRC-32 of bytes 0..44   48 up to whole write units
//! ```

use crate::flash::{
    erase, is_erased, program, read as read_flash, unit, Sector, ERASED, SLOT_BYTES,
};
use core::ops::Range;
use ed25519_compact::{PublicKey, Signature as Ed25519};
use embedded_storage::nor_flash::NorFlash;
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

/// Bytes from one record to the next.
const fn pitch<F: NorFlash>() -> usize {
    RECORD.next_multiple_of(unit::<F>())
}

/// Where the records of a sector begin.
fn places<F: NorFlash>() -> impl DoubleEndedIterator<Item = usize> {
    (0..SLOT_BYTES / pitch::<F>()).map(|index| index * pitch::<F>())
}

fn whole<F: NorFlash>(flash: &mut F, sector: Sector, at: usize) -> Option<Record> {
    if is_erased(flash, sector, at + CHECKED, 4) {
        // As most are.
        return None;
    }
    let mut record = [ERASED; RECORD];
    read_flash(flash, sector, at, &mut record).then_some(())?;
    let word = |at: usize| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|byte| record[at + byte]);
        u32::from_le_bytes([a, b, c, d])
    };
    let state = word(4);
    let is_whole = crc32(&record[..CHECKED]) == word(CHECKED);
    (is_whole && (state == LOCKED || state == OPEN)).then_some(())?;
    Some(Record { sector, number: word(0), state, key: record[8..40].try_into().ok()? })
}

fn newest<F: NorFlash>(flash: &mut F) -> Option<Record> {
    let all = LOG.into_iter().flat_map(|sector| places::<F>().map(move |at| (sector, at)));
    all.filter_map(|(sector, at)| whole(flash, sector, at)).max_by_key(|record| record.number)
}

/// The lock of this flash, if it has one.
pub fn read<F: NorFlash>(flash: &mut F) -> Option<Lock> {
    let Record { number, state, key, .. } = newest(flash)?;
    (state == LOCKED).then_some(Lock { number, key })
}

/// Writes the record after `last`; its number.
fn append<F: NorFlash>(
    flash: &mut F,
    last: Option<&Record>,
    state: u32,
    key: &[u8; 32],
) -> Result<u32, Refusal> {
    let number = last.map_or(0, |last| last.number).checked_add(1).ok_or(Refusal::FlashWrite)?;
    let mut sector = last.map_or(LOG[0], |last| last.sector);
    let mut used = |at: &usize| !is_erased(flash, sector, *at, RECORD);
    let mut at = places::<F>().rev().find(&mut used).map_or(0, |last| last + pitch::<F>());
    if at + pitch::<F>() > SLOT_BYTES {
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
    program(flash, sector, at, &record)?;
    Ok(number)
}

/// Locks an unlocked device.
///
/// # Errors
/// [`Refusal::LockedAlready`], [`Refusal::NotAKey`], or the flash's.
pub fn lock<F: NorFlash>(flash: &mut F, key: &[u8; 32]) -> Result<(), Refusal> {
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
pub fn renew<F: NorFlash>(flash: &mut F) -> Result<u32, Refusal> {
    let Lock { key, .. } = read(flash).ok_or(Refusal::NotLocked)?;
    let last = newest(flash);
    append(flash, last.as_ref(), LOCKED, &key)
}

/// Opens a locked device, if its key has signed the [`unlock_message`] of this challenge.
///
/// # Errors
/// [`Refusal::NotLocked`], [`Refusal::WrongSignature`], or the flash's.
pub fn unlock<F: NorFlash>(
    flash: &mut F,
    challenge: Challenge,
    signature: &Signature,
) -> Result<(), Refusal> {
    let lock = of_challenge(flash, challenge)?;
    let message = unlock_message(challenge.number, challenge.nonce);
    check(&lock.key, &message, signature, &mut |_| true)?;
    let last = newest(flash);
    append(flash, last.as_ref(), OPEN, &lock.key).map(drop)
}

/// Whether the key of a locked device has signed the [`update_message`] of this challenge.
///
/// # Errors
/// [`Refusal::NotLocked`], [`Refusal::WrongSignature`].
pub fn check_update<F: NorFlash>(
    flash: &mut F,
    challenge: Challenge,
    length: u32,
    signature: &Signature,
) -> Result<(), Refusal> {
    let lock = of_challenge(flash, challenge)?;
    let Challenge { number, nonce } = challenge;
    check(&lock.key, &update_message(number, nonce, length), signature, &mut |_| true)
}

/// Whether this device may take the network at these places of a slot: unlocked any, locked one that was begun upon
/// this challenge and that its key has signed with it.
///
/// # Errors
/// [`Refusal::Unsigned`] or [`Refusal::WrongSignature`] on a locked device.
pub fn check_network<F: NorFlash>(
    flash: &mut F,
    slot: Sector,
    places: Range<usize>,
    challenge: Option<Challenge>,
    signature: Option<&Signature>,
) -> Result<(), Refusal> {
    if read(flash).is_none() {
        return Ok(());
    }
    let challenge = challenge.ok_or(Refusal::Unsigned)?;
    let lock = of_challenge(flash, challenge)?;
    let signature = signature.ok_or(Refusal::Unsigned)?;
    let message = network_message(challenge.number, challenge.nonce);
    check(&lock.key, &message, signature, &mut |absorb| {
        let mut room = [ERASED; 64];
        places.clone().step_by(room.len()).all(|at| {
            let piece = &mut room[..(places.end - at).min(64)];
            let good = read_flash(flash, slot, at, piece);
            absorb(piece);
            good
        })
    })
}

/// The lock that gave this challenge.
fn of_challenge<F: NorFlash>(flash: &mut F, challenge: Challenge) -> Result<Lock, Refusal> {
    let lock = read(flash).ok_or(Refusal::NotLocked)?;
    if lock.number != challenge.number {
        return Err(Refusal::WrongSignature);
    }
    Ok(lock)
}

type Absorb<'a> = dyn FnMut(&[u8]) + 'a;

/// Checks a signature of a message and what `rest` absorbs behind it, which is false where it cannot.
#[inline(never)]
fn check(
    key: &[u8; 32],
    message: &[u8],
    signature: &Signature,
    rest: &mut dyn FnMut(&mut Absorb) -> bool,
) -> Result<(), Refusal> {
    let mut checked = || {
        let signature = Ed25519::from_slice(signature).ok()?;
        let mut state = PublicKey::from_slice(key).ok()?.verify_incremental(&signature).ok()?;
        state.absorb(message);
        rest(&mut |part| state.absorb(part)).then_some(())?;
        state.verify().ok()
    };
    checked().ok_or(Refusal::WrongSignature)
}
