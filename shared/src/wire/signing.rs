//! What is signed for a locked device.

use heapless::Vec;

/// An ed25519 signature. One that has not 64 bytes is not valid.
pub type Signature = Vec<u8, 64>;

/// The public key that a device says it is locked with whose lock is lost: of no key pair, so it is opened by
/// nobody, and no device can be locked with it.
pub const NOBODYS_KEY: [u8; 32] = [0; 32];

/// What is signed: 16 bytes that say what for, so that a signature of one kind is none of another, then the
/// number and the nonce of a challenge, so that it is good once.
fn signed(kind: &[u8; 16], number: u32, nonce: u32) -> [u8; 24] {
    let mut message = [0; 24];
    message[..16].copy_from_slice(kind);
    message[16..20].copy_from_slice(&number.to_le_bytes());
    message[20..].copy_from_slice(&nonce.to_le_bytes());
    message
}

/// What is signed to open a lock.
pub fn unlock_message(number: u32, nonce: u32) -> [u8; 24] {
    signed(b"yawrig unlock 2.", number, nonce)
}

/// What is signed to begin an update of a locked device, which erases its idle slot.
pub fn update_message(number: u32, nonce: u32, length: u32) -> [u8; 28] {
    let mut message = [0; 28];
    message[..24].copy_from_slice(&signed(b"yawrig update 1.", number, nonce));
    message[24..].copy_from_slice(&length.to_le_bytes());
    message
}

/// What stands before the blob when a network is signed; of the challenge its update began with.
pub fn network_message(number: u32, nonce: u32) -> [u8; 24] {
    signed(b"yawrig network 2", number, nonce)
}
