//! A device that is locked with a public key: what it takes, what it refuses, and how it is opened again.

mod desk;

use desk::Desk;
use ed25519_compact::{KeyPair, Seed};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::wire::{unlock_message, Refusal, Reply, Request, Signature, SIGNED_NETWORK};

fn refused(refusal: Refusal) -> Reply {
    Reply::Refused(refusal)
}

fn pair(seed: u8) -> KeyPair {
    KeyPair::from_seed(Seed::new([seed; 32]))
}

fn sign(pair: &KeyPair, message: &[u8]) -> Signature {
    Signature::from_slice(&*pair.sk.sign(message, None)).expect("64 bytes")
}

fn sign_network(pair: &KeyPair, blob: &[u8]) -> Signature {
    sign(pair, &[SIGNED_NETWORK, blob].concat())
}

fn network(generation: u32) -> Vec<u8> {
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, generation).expect("a blob");
    bytes
}

impl Desk {
    fn locked(pair: &KeyPair) -> Self {
        let mut desk = Self::new(MemoryFlash::new());
        assert_eq!(desk.ask(&Request::Lock { key: *pair.pk }), Reply::Done);
        desk
    }

    /// Writes a network, to its trial; what the device says to that.
    fn try_signed(&mut self, bytes: &[u8], signature: Option<Signature>) -> Reply {
        self.write(bytes);
        if let Some(signature) = signature {
            assert_eq!(self.ask(&Request::FlashSignature { signature }), Reply::Done);
        }
        self.ask(&Request::FlashTrial)
    }

    fn challenge(&mut self) -> [u8; 23] {
        match self.ask(&Request::Challenge) {
            Reply::Challenge { number, nonce } => unlock_message(number, nonce),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn it_comes_unlocked_and_takes_networks_with_and_without_signature() {
    let mut desk = Desk::new(MemoryFlash::new());
    assert_eq!(desk.status().lock, None);
    assert_eq!(desk.try_signed(&network(1), None), Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    let signature = sign_network(&pair(1), &network(2));
    assert_eq!(desk.try_signed(&network(2), Some(signature)), Reply::Done);
    assert_eq!(desk.ask(&Request::Challenge), refused(Refusal::NotLocked));
    let signature = sign(&pair(1), &unlock_message(0, 0));
    assert_eq!(desk.ask(&Request::Unlock { signature }), refused(Refusal::WrongSignature));
}

#[test]
fn locked_it_takes_what_its_key_has_signed_and_nothing_else() {
    let (owner, other) = (pair(1), pair(2));
    let mut desk = Desk::locked(&owner);
    assert_eq!(desk.status().lock, Some(*owner.pk));
    let before = desk.status().network;
    let bytes = network(1);
    let right = sign_network(&owner, &bytes);
    let unsigned = refused(Refusal::Unsigned);
    let wrong = refused(Refusal::WrongSignature);
    assert_eq!(desk.try_signed(&bytes, None), unsigned);
    assert_eq!(desk.try_signed(&bytes, Some(sign_network(&other, &bytes))), wrong);
    // Of another generation, so of another blob; of the blob without what says that it is one.
    assert_eq!(desk.try_signed(&network(2), Some(right.clone())), wrong);
    assert_eq!(desk.try_signed(&bytes, Some(sign(&owner, &bytes))), wrong);
    assert_eq!(desk.try_signed(&bytes, Some(Signature::new())), wrong);
    let mut short = right.clone();
    short.pop();
    assert_eq!(desk.try_signed(&bytes, Some(short)), wrong);
    for bit in 0..512 {
        let mut tampered = right.clone();
        tampered[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(desk.try_signed(&bytes, Some(tampered)), wrong, "bit {bit}");
    }
    // A bit of the network, all its checksums right.
    let (_, mut payload) = blob::decode(&bytes).expect("a blob");
    payload.provenance.seed ^= 1;
    let mut tampered = [0; blob::LONGEST];
    let length = blob::encode(&payload, 1, &mut tampered).expect("a blob");
    assert_eq!(desk.try_signed(&tampered[..length], Some(right.clone())), wrong);
    // A signature is of one update: the next begins without.
    assert_eq!(desk.ask(&Request::FlashSignature { signature: right.clone() }), Reply::Done);
    assert_eq!(desk.try_signed(&bytes, None), unsigned);
    assert_eq!(desk.status().network, before);
    assert_eq!(desk.ask(&Request::FlashCommit), refused(Refusal::NoTrial));

    assert_eq!(desk.try_signed(&bytes, Some(right)), Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    let mut desk = desk.power_cut();
    assert_eq!((desk.status().network.generation, desk.status().lock), (1, Some(*owner.pk)));
    assert_eq!(desk.try_signed(&network(2), None), unsigned);
}

#[test]
fn a_network_from_before_the_lock_stays() {
    let mut desk = Desk::new(MemoryFlash::new());
    assert_eq!(desk.try_signed(&network(1), None), Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    assert_eq!(desk.ask(&Request::Lock { key: *pair(1).pk }), Reply::Done);
    assert_eq!(desk.power_cut().status().network.generation, 1);
}

#[test]
fn only_the_private_key_opens_it_and_only_this_once() {
    let (owner, other) = (pair(1), pair(2));
    let mut desk = Desk::locked(&owner);
    let wrong = refused(Refusal::WrongSignature);
    assert_eq!(desk.ask(&Request::Lock { key: *other.pk }), refused(Refusal::LockedAlready));
    let open = |desk: &mut Desk, signature| desk.ask(&Request::Unlock { signature });
    // Not asked for.
    assert_eq!(open(&mut desk, sign(&owner, &unlock_message(1, 0))), wrong);
    let challenge = desk.challenge();
    assert_eq!(open(&mut desk, sign(&other, &challenge)), wrong);
    // That was the answer to this challenge.
    assert_eq!(open(&mut desk, sign(&owner, &challenge)), wrong);
    // A network's signature is none.
    let challenge = desk.challenge();
    assert_eq!(open(&mut desk, sign_network(&owner, &challenge)), wrong);
    assert_eq!(desk.status().lock, Some(*owner.pk));
    let challenge = desk.challenge();
    let answer = sign(&owner, &challenge);
    assert_eq!(open(&mut desk, answer.clone()), Reply::Done);
    assert_eq!(desk.status().lock, None);
    let mut desk = desk.power_cut();
    assert_eq!(desk.status().lock, None);
    assert_eq!(desk.try_signed(&network(1), None), Reply::Done);
    // Locked anew, the old answer does not open it: the lock has another number.
    assert_eq!(desk.ask(&Request::Lock { key: *owner.pk }), Reply::Done);
    assert_ne!(desk.challenge(), challenge);
    assert_eq!(open(&mut desk, answer), wrong);
}

#[test]
fn what_is_no_key_locks_nothing() {
    let mut desk = Desk::new(MemoryFlash::new());
    // The neutral point, a point of small order, and no point at all.
    let mut neutral = [0; 32];
    neutral[0] = 1;
    for key in [neutral, [0; 32], [0xff; 32]] {
        assert_eq!(desk.ask(&Request::Lock { key }), refused(Refusal::NotAKey), "{key:?}");
    }
    assert_eq!(desk.status().lock, None);
}
