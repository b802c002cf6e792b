//! A network on trial: confirmed, not confirmed in time, cut off, or replaced.

mod desk;

use desk::Desk;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob::{self, BlobError};
use yawrig_shared::wire::{Decoder, Event, Refusal, Reply, Request, SlotState, TRIAL_SAMPLES};

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
        let mut found = Vec::new();
        for index in 0..12_000_u32 {
            let time = f64::from(index.saturating_sub(2000)) * 1e-3;
            let yaw_deg = 9.0 * (-0.01 * 8.0 * time).exp() * (8.0 * time).cos();
            self.device.sample((32_768.0 + yaw_deg / 0.005) as u16);
        }
        let mut decoder = Decoder::new();
        while let Some(byte) = self.device.transmit() {
            if let Some(Ok(frame)) = decoder.push(byte) {
                if let Some(Ok(Event::Window(window))) = frame.message::<Event>() {
                    found.push((window.natural_frequency_rad_s, window.damping_ratio));
                }
            }
        }
        assert!(!found.is_empty(), "windows");
        found
    }
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
