//! Who may write: a device that is locked with an ed25519 public key takes only networks whose writing its
//! private key has signed for.
//!
//! A board says whether its device can be locked at all ([`crate::device::Device::without_lock`]). Unlocked
//! as it comes. Anyone may lock an unlocked device; unlocking needs the private key. What stands in a slot
//! was checked before it was committed and is not checked again at the start: who can write the flash past
//! the device can erase its lock, too, and networks from before the lock stay.
//!
//! Every signature is of a challenge: a number that the flash keeps and that only rises, and a nonce that
//! counts the challenges since the start. The first challenge after a start raises the number, so no pair
//! ever comes twice, and what was recorded on the line opens and writes nothing a second time. It is not of
//! this device: devices that share a key should not share a line that strangers listen to.
//!
//! The lock is the newest of its [records](crate::records): whenever the power goes the device is as before
//! or as wanted, and no number comes again. It stands there twice. A copy that is lost is made good with the
//! next start ([`mend`]); where both are, or the flash cannot be read, the device is locked with
//! [`NOBODYS_KEY`].
//!
//! ```text
//! record: 0 number   4 LOCK or OPEN   8 public key   40 LOCK or OPEN   44 CRC-32 of bytes 0..44   48 up to whole write units
//! ```

use crate::flash::{read as read_flash, Sector, ERASED};
use crate::records::{append, newest, Record, Tag};
use core::ops::Range;
use ed25519_compact::{PublicKey, Signature as Ed25519};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::wire::{
    network_message, unlock_message, update_message, Refusal, Signature, NOBODYS_KEY,
};

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

/// The lock of this flash, if it has one; [`NOBODYS_KEY`] where it had one that cannot be read.
pub fn read<F: NorFlash>(flash: &mut F) -> Option<Lock> {
    let newest = newest(flash);
    if newest.lock_lost {
        return Some(Lock { number: 0, key: NOBODYS_KEY });
    }
    let record = newest.lock?;
    (record.tag == Tag::Locked).then_some(())?;
    Some(Lock { number: record.number, key: *record.body.first_chunk()? })
}

/// Writes the lock anew where one of its two copies is lost, or where there never was a second; whether it is
/// lost whole.
pub fn mend<F: NorFlash>(flash: &mut F) -> bool {
    let newest = newest(flash);
    if let Some(Record { tag, body, .. }) = newest.lock.filter(|_| !newest.lock_twice) {
        // Nothing is written where it is lost; else with the next start: one copy holds.
        let _ = append(flash, tag, &body[..32]);
    }
    newest.lock_lost
}

/// Locks an unlocked device.
///
/// # Errors
/// [`Refusal::LockedAlready`], [`Refusal::NotAKey`], or the flash's.
pub fn lock<F: NorFlash>(flash: &mut F, key: &[u8; 32]) -> Result<(), Refusal> {
    if read(flash).is_some() {
        return Err(Refusal::LockedAlready);
    }
    // Else nothing could ever open it.
    if PublicKey::from_slice(key).and_then(|key| key.validate()).is_err() {
        return Err(Refusal::NotAKey);
    }
    append(flash, Tag::Locked, key).map(drop)
}

/// Raises the number of a lock, so that it has never been in a challenge.
///
/// # Errors
/// [`Refusal::NotLocked`], [`Refusal::NotAKey`], or the flash's.
pub fn renew<F: NorFlash>(flash: &mut F) -> Result<u32, Refusal> {
    let Lock { key, .. } = somebodys(flash)?;
    append(flash, Tag::Locked, &key)
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
    append(flash, Tag::Open, &lock.key).map(drop)
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

/// Whether this device may take the network at these places of a slot: unlocked any, locked one that was
/// begun upon this challenge and that its key has signed with it.
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

/// The lock, if anybody has its key.
fn somebodys<F: NorFlash>(flash: &mut F) -> Result<Lock, Refusal> {
    let lock = read(flash).ok_or(Refusal::NotLocked)?;
    if lock.key == NOBODYS_KEY {
        return Err(Refusal::NotAKey);
    }
    Ok(lock)
}

/// The lock that gave this challenge.
fn of_challenge<F: NorFlash>(flash: &mut F, challenge: Challenge) -> Result<Lock, Refusal> {
    let lock = somebodys(flash)?;
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
