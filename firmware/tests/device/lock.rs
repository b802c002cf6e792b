//! A device that is locked with a public key: what it takes, what it refuses, and how it is opened again.

use crate::desk::Desk;
use ed25519_compact::{KeyPair, Seed};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::wire::{
    network_message, unlock_message, update_message, Refusal, Reply, Request, Signature, SlotState,
};

fn refused(refusal: Refusal) -> Reply {
    Reply::Refused(refusal)
}

fn pair(seed: u8) -> KeyPair {
    KeyPair::from_seed(Seed::new([seed; 32]))
}

fn sign(pair: &KeyPair, message: &[u8]) -> Signature {
    Signature::from_slice(&*pair.sk.sign(message, None)).expect("64 bytes")
}

fn network(generation: u32) -> Vec<u8> {
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, generation).expect("a blob");
    bytes
}

/// What signs an update: the challenge it is of and the bytes it is for.
struct Signer<'a> {
    permit: &'a KeyPair,
    network: &'a KeyPair,
    /// In place of those that are written.
    other_bytes: Option<&'a [u8]>,
    other_length: Option<u32>,
}

impl<'a> Signer<'a> {
    fn new(pair: &'a KeyPair) -> Self {
        Self { permit: pair, network: pair, other_bytes: None, other_length: None }
    }
}

impl Desk {
    fn locked(pair: &KeyPair) -> Self {
        let mut desk = Self::new(MemoryFlash::new());
        assert_eq!(desk.ask(&Request::Lock { key: *pair.pk }), Reply::Done);
        desk
    }

    fn commit(&mut self, bytes: &[u8]) {
        self.write(bytes);
        assert_eq!(self.ask(&Request::FlashTrial), Reply::Done);
        assert_eq!(self.ask(&Request::FlashCommit), Reply::Done);
    }

    /// An update to its trial, and every request of it; the first refusal, or what the device says to the
    /// trial.
    fn update(&mut self, bytes: &[u8], signer: Option<&Signer>) -> (Reply, Vec<Request>) {
        let length = bytes.len() as u32;
        let mut requests = Vec::new();
        let mut signature = None;
        if let Some(signer) = signer {
            let (number, nonce) = self.challenge();
            let signed = signer.other_length.unwrap_or(length);
            let permit = sign(signer.permit, &update_message(number, nonce, signed));
            requests.push(Request::FlashPermit { length, signature: permit });
            let of = signer.other_bytes.unwrap_or(bytes);
            let message = [&network_message(number, nonce)[..], of].concat();
            signature = Some(sign(signer.network, &message));
        }
        requests.push(Request::FlashBegin { length });
        for (index, chunk) in bytes.chunks(256).enumerate() {
            let bytes = chunk.iter().copied().collect();
            requests.push(Request::FlashChunk { offset: 256 * index as u32, bytes });
        }
        requests.extend(signature.map(|signature| Request::FlashSignature { signature }));
        requests.push(Request::FlashTrial);
        (self.ask_all(&requests), requests)
    }

    /// What the device says to the last of them, or to the first that it refuses.
    fn ask_all(&mut self, requests: &[Request]) -> Reply {
        let mut last = Reply::Done;
        for request in requests {
            last = self.ask(request);
            if last != Reply::Done {
                break;
            }
        }
        last
    }

    fn challenge(&mut self) -> (u32, u32) {
        match self.ask(&Request::Challenge) {
            Reply::Challenge { number, nonce } => (number, nonce),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn it_comes_unlocked_and_takes_networks_without_signature() {
    let mut desk = Desk::new(MemoryFlash::new());
    assert_eq!(desk.status().lock, None);
    desk.commit(&network(1));
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
    let unsigned = refused(Refusal::Unsigned);
    let wrong = refused(Refusal::WrongSignature);
    let tried = |desk: &mut Desk, signer: Signer| desk.update(&bytes, Some(&signer)).0;
    assert_eq!(desk.update(&bytes, None).0, unsigned);
    assert_eq!(tried(&mut desk, Signer::new(&other)), wrong);
    assert_eq!(tried(&mut desk, Signer { network: &other, ..Signer::new(&owner) }), wrong);
    let longer = Signer { other_length: Some(4096), ..Signer::new(&owner) };
    assert_eq!(tried(&mut desk, longer), wrong);
    // Of another generation, so of another blob; then a bit of the network, all its checksums right.
    let next = network(2);
    assert_eq!(tried(&mut desk, Signer { other_bytes: Some(&next), ..Signer::new(&owner) }), wrong);
    let (_, mut payload) = blob::decode(&bytes).expect("a blob");
    payload.provenance.seed ^= 1;
    let mut tampered = [0; blob::LONGEST];
    let length = blob::encode(&payload, 1, &mut tampered).expect("a blob");
    let signer = Signer { other_bytes: Some(&bytes), ..Signer::new(&owner) };
    assert_eq!(desk.update(&tampered[..length], Some(&signer)).0, wrong);
    // A bit of either signature, one cut short, none.
    for which in [0, 1] {
        for bit in (0..512).step_by(7) {
            let (number, nonce) = desk.challenge();
            let messages = [
                update_message(number, nonce, bytes.len() as u32).to_vec(),
                [&network_message(number, nonce)[..], &bytes].concat(),
            ];
            let mut signatures = messages.map(|message| sign(&owner, &message));
            match bit {
                0 => drop(signatures[which].pop()),
                7 => signatures[which].clear(),
                _ => signatures[which][bit / 8] ^= 1 << (bit % 8),
            }
            let [permit, signature] = signatures;
            let length = bytes.len() as u32;
            let permitted = desk.ask(&Request::FlashPermit { length, signature: permit });
            if which == 0 {
                assert_eq!(permitted, wrong, "bit {bit}");
                assert_eq!(desk.ask(&Request::FlashBegin { length }), unsigned);
            } else {
                assert_eq!(permitted, Reply::Done);
                desk.write(&bytes);
                assert_eq!(desk.ask(&Request::FlashSignature { signature }), Reply::Done);
                assert_eq!(desk.ask(&Request::FlashTrial), wrong, "bit {bit}");
            }
        }
    }
    assert_eq!(desk.status().network, before);
    assert_eq!(desk.ask(&Request::FlashCommit), refused(Refusal::NoTrial));

    assert_eq!(tried(&mut desk, Signer::new(&owner)), Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    let mut desk = desk.power_cut();
    assert_eq!((desk.status().network.generation, desk.status().lock), (1, Some(*owner.pk)));
    assert_eq!(desk.update(&network(2), None).0, unsigned);
}

/// The slot that does not run is the way back; whoever has no key does not get at it.
#[test]
fn locked_it_erases_nothing_for_who_has_no_key() {
    let owner = pair(1);
    let mut desk = Desk::new(MemoryFlash::new());
    desk.commit(&network(1));
    desk.commit(&network(2));
    assert_eq!(desk.ask(&Request::Lock { key: *owner.pk }), Reply::Done);
    let slots = desk.status().slots;
    assert!(slots.iter().all(|slot| matches!(slot, SlotState::Valid { .. })), "{slots:?}");
    let begin = Request::FlashBegin { length: 2000 };
    assert_eq!(desk.ask(&begin), refused(Refusal::Unsigned));
    // Nor with a permit of another length, nor a second time with the same one.
    let (number, nonce) = desk.challenge();
    let signature = sign(&owner, &update_message(number, nonce, 1000));
    let permit = Request::FlashPermit { length: 1000, signature };
    assert_eq!(desk.ask(&permit), Reply::Done);
    assert_eq!(desk.ask(&begin), refused(Refusal::Unsigned));
    assert_eq!(desk.ask(&permit), refused(Refusal::WrongSignature));
    assert_eq!(desk.ask(&Request::FlashBegin { length: 1000 }), refused(Refusal::Unsigned));
    assert_eq!(desk.status().slots, slots);
}

/// What was recorded on the line writes no older network, whenever it is sent again.
#[test]
fn an_update_that_was_recorded_is_good_once() {
    let owner = pair(1);
    let mut desk = Desk::locked(&owner);
    let (done, recorded) = desk.update(&network(1), Some(&Signer::new(&owner)));
    assert_eq!(done, Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    let wrong = refused(Refusal::WrongSignature);
    assert_eq!(desk.ask_all(&recorded), wrong);
    // After a reset, whose clock and counts begin anew, and upon a challenge.
    let mut desk = desk.power_cut();
    desk.challenge();
    assert_eq!(desk.ask_all(&recorded), wrong);
    // Begun with a permit of its own, the rest is of another challenge.
    let length = network(1).len() as u32;
    let (number, nonce) = desk.challenge();
    let signature = sign(&owner, &update_message(number, nonce, length));
    assert_eq!(desk.ask(&Request::FlashPermit { length, signature }), Reply::Done);
    assert_eq!(desk.ask_all(&recorded[1..]), wrong);
    assert_eq!(desk.status().network.generation, 1);
}

#[test]
fn no_challenge_comes_twice() {
    let owner = pair(1);
    let mut desk = Desk::locked(&owner);
    let mut seen = std::collections::HashSet::new();
    for _ in 0..5 {
        for _ in 0..3 {
            assert!(seen.insert(desk.challenge()));
        }
        let (number, nonce) = desk.challenge();
        assert!(seen.insert((number, nonce)));
        let signature = sign(&owner, &unlock_message(number, nonce));
        assert_eq!(desk.ask(&Request::Unlock { signature }), Reply::Done);
        assert_eq!(desk.ask(&Request::Lock { key: *owner.pk }), Reply::Done);
        assert!(seen.insert(desk.challenge()));
        // At the same sample, with the same requests.
        desk = desk.power_cut();
    }
}

#[test]
fn a_network_from_before_the_lock_stays() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.commit(&network(1));
    assert_eq!(desk.ask(&Request::Lock { key: *pair(1).pk }), Reply::Done);
    assert_eq!(desk.power_cut().status().network.generation, 1);
}

/// But not one that was on its way: it was not signed.
#[test]
fn an_update_that_was_begun_unlocked_ends_with_the_lock() {
    for on_trial in [false, true] {
        let mut desk = Desk::new(MemoryFlash::new());
        desk.write(&network(1));
        if on_trial {
            assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
        }
        assert_eq!(desk.ask(&Request::Lock { key: *pair(1).pk }), Reply::Done);
        assert_ne!(desk.ask(&Request::FlashTrial), Reply::Done);
        assert_eq!(desk.ask(&Request::FlashCommit), refused(Refusal::NoTrial));
        assert_eq!(desk.status().network.generation, 0);
        assert_eq!(desk.power_cut().status().network.generation, 0);
    }
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
    let challenge = |desk: &mut Desk| {
        let (number, nonce) = desk.challenge();
        unlock_message(number, nonce)
    };
    let message = challenge(&mut desk);
    assert_eq!(open(&mut desk, sign(&other, &message)), wrong);
    // That was the answer to this challenge.
    assert_eq!(open(&mut desk, sign(&owner, &message)), wrong);
    // A permit is none.
    let (number, nonce) = desk.challenge();
    assert_eq!(open(&mut desk, sign(&owner, &update_message(number, nonce, 2000))), wrong);
    assert_eq!(desk.status().lock, Some(*owner.pk));
    let message = challenge(&mut desk);
    let answer = sign(&owner, &message);
    assert_eq!(open(&mut desk, answer.clone()), Reply::Done);
    assert_eq!(desk.status().lock, None);
    let mut desk = desk.power_cut();
    assert_eq!(desk.status().lock, None);
    desk.commit(&network(1));
    // Locked anew, the old answer does not open it: the lock has another number.
    assert_eq!(desk.ask(&Request::Lock { key: *owner.pk }), Reply::Done);
    assert_ne!(challenge(&mut desk), message);
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
