//! A network on trial: confirmed, not confirmed in time, cut off, or replaced.

use crate::desk::{Desk, Swing};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob::{self, BlobError};
use yawrig_shared::wire::{Refusal, Reply, Request, SlotState, TRIAL_SAMPLES};

impl Desk {
    /// Generation that runs, and whether on trial.
    fn runs(&mut self) -> (u32, bool) {
        let network = self.status().network;
        (network.generation, network.on_trial)
    }

    fn samples(&mut self, count: u32) {
        (0..count).for_each(|_| self.device.sample(32_768));
    }

    /// Writes the built-in network as this generation, up to its trial.
    fn try_out(&mut self, generation: u32) {
        let mut bytes = BUILT_IN.to_vec();
        blob::set_generation(&mut bytes, generation).expect("a blob");
        self.write(&bytes);
        assert_eq!(self.ask(&Request::FlashTrial), Reply::Done);
        assert_eq!(self.runs(), (generation, true));
    }

    /// What it makes of a release at 9 deg: natural frequency and damping ratio of each window.
    fn estimates(&mut self) -> Vec<(f32, f32)> {
        let before = self.windows.len();
        self.play(release());
        let found = self.windows[before..]
            .iter()
            .map(|window| (window.natural_frequency_rad_s, window.damping_ratio))
            .collect::<Vec<_>>();
        assert!(!found.is_empty(), "windows");
        found
    }
}

fn release() -> Vec<u16> {
    let swing = Swing { from_deg: 9.0, noise_deg: 0.0, seconds: 40.0, ..Swing::new(8.0, 0.01) };
    swing.counts(1)
}

/// A network that says something else, and passes every check.
fn another(generation: u32) -> Vec<u8> {
    let (_, mut payload) = blob::decode(BUILT_IN).expect("a blob");
    payload.network.outputs[0].offset += 0.5;
    for golden in &mut payload.golden {
        let inputs: Vec<f32> = golden.inputs.iter().map(|bits| f32::from_bits(*bits)).collect();
        *golden = blob::golden(&payload.network, &inputs);
    }
    payload.from_counts = Some(blob::from_counts(&payload.network));
    let mut bytes = vec![0; blob::LONGEST];
    let length = blob::encode(&payload, generation, &mut bytes).expect("a blob");
    bytes.truncate(length);
    bytes
}

const TOO_LATE: Reply = Reply::Refused(Refusal::NoTrial);

#[test]
fn a_network_that_is_confirmed_in_time_stays() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.try_out(1);
    desk.samples(TRIAL_SAMPLES);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    desk.samples(2 * TRIAL_SAMPLES);
    assert_eq!(desk.runs(), (1, false));
    assert_eq!(desk.power_cut().runs(), (1, false));
}

#[test]
fn one_that_is_not_makes_way_for_the_one_before() {
    let mut desk = Desk::new(MemoryFlash::new());
    // Back to the one compiled in.
    desk.try_out(1);
    desk.samples(TRIAL_SAMPLES + 1);
    assert_eq!(desk.runs(), (0, false));
    assert_eq!(desk.ask(&Request::FlashCommit), TOO_LATE);
    assert_eq!(desk.status().slots, [SlotState::Invalid, SlotState::Empty]);
    // Back to one in a slot, where lost samples count as time.
    desk.try_out(2);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    desk.try_out(3);
    desk.device.lost(TRIAL_SAMPLES + 1);
    assert_eq!(desk.runs(), (2, false));
    assert_eq!(desk.ask(&Request::FlashCommit), TOO_LATE);
    assert_eq!(desk.power_cut().runs(), (2, false));
}

#[test]
fn a_power_cut_ends_a_trial() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.try_out(1);
    let mut desk = desk.power_cut();
    assert_eq!(desk.runs(), (0, false));
    assert_eq!(desk.ask(&Request::FlashCommit), TOO_LATE);
}

#[test]
fn another_update_ends_a_trial_and_leaves_the_network_that_was_confirmed() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.try_out(1);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    desk.try_out(2);
    assert_eq!(desk.ask(&Request::FlashBegin { length: 1000 }), Reply::Done);
    assert_eq!(desk.runs(), (1, false));
    // It was not erased with the one on trial.
    assert_eq!(desk.power_cut().runs(), (1, false));
}

#[test]
fn a_network_that_is_refused_leaves_the_one_that_ran_at_work() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.try_out(1);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    let before = desk.status().network;
    // Whole, but the golden vectors come out otherwise: it has been read before that is known.
    let (_, mut payload) = blob::decode(BUILT_IN).expect("a blob");
    payload.network.weights[0] += 0.5;
    payload.golden[0] = blob::golden(&payload.network, &[0.25; 41]);
    let mut bytes = [0; blob::LONGEST];
    let length = blob::encode(&payload, 2, &mut bytes).expect("a blob");
    desk.write(&bytes[..length]);
    let differs = Refusal::Blob(BlobError::GoldenDiffers { vector: 1 });
    assert_eq!(desk.ask(&Request::FlashTrial), Reply::Refused(differs));
    assert_eq!(desk.status().network, before);
    assert_eq!(desk.estimates(), {
        let mut fresh = Desk::new(MemoryFlash::new());
        fresh.estimates()
    });
}

const RELEASING: Reply = Reply::Refused(Refusal::Releasing);

/// All windows of a release are one network's.
#[test]
fn a_network_is_not_taken_up_in_mid_release() {
    let alone = Desk::new(MemoryFlash::new()).estimates();
    let mut desk = Desk::new(MemoryFlash::new());
    let counts = release();
    let (first, rest) = counts.split_at(14_000);
    desk.play(first.iter().copied());
    assert!(desk.windows.len() > 2);
    desk.write(&another(1));
    assert_eq!(desk.ask(&Request::FlashTrial), RELEASING);
    assert_eq!(desk.runs(), (0, false));
    desk.play(rest.iter().copied());
    let made: Vec<_> =
        desk.windows.iter().map(|w| (w.natural_frequency_rad_s, w.damping_ratio)).collect();
    assert_eq!(made, alone);
    // What was written is still there.
    assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
    assert_eq!(desk.runs(), (1, true));
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
}

/// Nor is one given up in mid-release, be its time over or another update begun.
#[test]
fn a_network_on_trial_ends_the_release_it_has_begun() {
    let mut confirmed = Desk::new(MemoryFlash::new());
    confirmed.write(&another(1));
    assert_eq!(confirmed.ask(&Request::FlashTrial), Reply::Done);
    assert_eq!(confirmed.ask(&Request::FlashCommit), Reply::Done);
    let alone = confirmed.estimates();
    assert_ne!(alone, Desk::new(MemoryFlash::new()).estimates());

    let mut desk = Desk::new(MemoryFlash::new());
    desk.write(&another(1));
    assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
    let counts = release();
    assert!(counts.len() > 2 * TRIAL_SAMPLES as usize);
    let (first, rest) = counts.split_at(14_000);
    desk.play(first.iter().copied());
    assert_eq!(desk.ask(&Request::FlashCommit), TOO_LATE, "its time is over");
    assert_eq!(desk.ask(&Request::FlashBegin { length: 1000 }), RELEASING);
    assert_eq!(desk.runs(), (1, true), "and the release is not");
    desk.play(rest.iter().copied());
    let made: Vec<_> =
        desk.windows.iter().map(|w| (w.natural_frequency_rad_s, w.damping_ratio)).collect();
    assert_eq!(made, alone);
    assert_eq!(desk.runs(), (0, false));
    assert_eq!(desk.power_cut().runs(), (0, false));
}
