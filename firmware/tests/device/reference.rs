//! What a wind-on release is held against: the wind-off one of its own spring and axis, or nothing.

use crate::desk::{Desk, Swing};
use yawrig_firmware::memory::{Memory, BYTES};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::derivatives::{Model, Wind, YawDerivatives};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{
    rig_id, Condition, ConditionFault, Derivatives, Flags, Refusal, Reply, Request,
};

const MODEL: Model = Model { length_m: 0.625, frontal_area_m2: 0.036 };
const OFF: f64 = 0.0;
const ON: f64 = 10.0;

fn condition(spring: &str, speed_m_s: f64) -> Condition {
    Condition {
        rig: rig_id(spring, "mid"),
        wind: Wind { density_kg_m3: 1.2, speed_m_s },
        model: MODEL,
        inertia_kg_m2: 0.101,
    }
}

/// Any two springs and what the wind makes of them.
const SOFT: [(f64, f64); 2] = [(7.8, 0.02), (7.4, 0.03)];
const STIFF: [(f64, f64); 2] = [(10.0, 0.02), (9.7, 0.028)];

fn swing((wn, zeta): (f64, f64)) -> Swing {
    Swing::new(wn, zeta)
}

impl Desk {
    fn announce(&mut self, condition: Condition) {
        assert_eq!(self.ask(&Request::Condition(condition)), Reply::Done);
    }

    /// A release to its end; its derivatives, the network's and the refined ones.
    fn release(&mut self, condition: Condition, swing: Swing) -> [Option<Derivatives>; 2] {
        self.announce(condition);
        let (releases, refined) = (self.releases.len(), self.refined.len());
        self.play(swing.counts(releases as u32 + 1));
        self.end();
        assert_eq!(self.releases.len(), releases + 1);
        let refined = self.refined.get(refined).and_then(|refined| refined.derivatives);
        [self.releases[releases].derivatives, refined]
    }

    fn flags(&self) -> Flags {
        self.releases.last().expect("a release").flags
    }
}

fn planted(on: (f64, f64), off: (f64, f64)) -> YawDerivatives {
    let modal =
        |(natural_frequency_rad_s, damping_ratio)| Modal { natural_frequency_rad_s, damping_ratio };
    let wind = Wind { density_kg_m3: 1.2, speed_m_s: ON };
    YawDerivatives::from_releases(&modal(on), &modal(off), 0.101, &wind, &MODEL)
}

/// Within four of their own standard uncertainties, and by the refined ones to a per mille or three.
#[test]
fn derivatives_are_those_of_their_own_spring_and_say_against_what() {
    let mut desk = Desk::new(MemoryFlash::new());
    for (number, (spring, [off, on])) in [("K1", SOFT), ("K4", STIFF)].into_iter().enumerate() {
        desk.release(condition(spring, OFF), swing(off));
        let [network, refined] = desk.release(condition(spring, ON), swing(on));
        let truth = planted(on, off);
        for found in [network, refined] {
            let found = found.expect("derivatives");
            assert_eq!(found.reference_release, 2 * number as u32);
            for (found, truth) in [(found.cn_beta, truth.cn_beta), (found.cn_r, truth.cn_r)] {
                let miss = f64::from(found.value) - truth;
                // The network's own error is systematic: a hundredth of the derivative.
                let allowed = 4.0 * f64::from(found.u) + 0.01 * truth.abs();
                assert!(miss.abs() < allowed && found.u > 0.0, "{spring}: {found:?} {truth}");
            }
        }
        let refined = refined.expect("derivatives");
        let miss = f64::from(refined.cn_beta.value) - truth.cn_beta;
        assert!(miss.abs() < 4.0 * f64::from(refined.cn_beta.u), "{refined:?} {truth:?}");
    }
}

#[test]
fn another_spring_whose_wind_off_release_is_spoilt_has_no_reference() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.release(condition("K1", OFF), swing(SOFT[0]));
    desk.release(condition("K4", OFF), Swing { seconds: 2.1, ..swing(STIFF[0]) });
    assert!(desk.flags().unusable());
    assert_eq!(desk.release(condition("K4", ON), swing(STIFF[1])), [None; 2]);
    assert!(desk.flags().has(Flags::NO_REFERENCE));
    assert!(desk.refined.last().expect("refined").flags.has(Flags::NO_REFERENCE));
}

/// Too little of it for a window: its record is enough for the refined one.
#[test]
fn a_wind_off_release_of_two_cycles_is_a_refined_reference() {
    let mut desk = Desk::new(MemoryFlash::new());
    let two_cycles_s = 2.0 + 2.0 * std::f64::consts::TAU / SOFT[0].0;
    desk.release(
        condition("K1", OFF),
        Swing { seconds: two_cycles_s, from_deg: 9.0, ..swing(SOFT[0]) },
    );
    assert!(desk.flags().unusable());
    let [network, refined] = desk.release(condition("K1", ON), swing(SOFT[1]));
    assert_eq!(network, None);
    let (found, truth) = (refined.expect("derivatives"), planted(SOFT[1], SOFT[0]));
    for (found, truth) in [(found.cn_beta, truth.cn_beta), (found.cn_r, truth.cn_r)] {
        assert!((f64::from(found.value) - truth).abs() < 4.0 * f64::from(found.u), "{found:?}");
    }
}

#[test]
fn another_spring_has_no_reference_until_it_has_its_own() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.release(condition("K1", OFF), swing(SOFT[0]));
    let both = [Some(0); 2];
    assert_eq!([desk.status().reference, desk.status().refined_reference], both);
    assert_eq!(desk.release(condition("K4", ON), swing(STIFF[1])), [None; 2]);
    assert_eq!([desk.status().reference, desk.status().refined_reference], [None; 2]);
    // Back again: the spring has been taken off in the meantime.
    assert_eq!(desk.release(condition("K1", ON), swing(SOFT[1])), [None; 2]);
    // Another model on the same spring is another rig.
    desk.release(condition("K1", OFF), swing(SOFT[0]));
    let longer = Model { length_m: 0.7, ..MODEL };
    let other = Condition { model: longer, ..condition("K1", ON) };
    assert_eq!(desk.release(other, swing(SOFT[1])), [None; 2]);
}

#[test]
fn a_reference_gives_way_to_a_wind_off_release_that_is_unusable_flagged_or_not_refined() {
    let good = swing(SOFT[0]);
    let short = Swing { seconds: 2.1, ..good }.counts(2);
    for spoilt in [short, touched(&good, 2)] {
        let mut desk = Desk::new(MemoryFlash::new());
        desk.release(condition("K1", OFF), good);
        desk.play(spoilt);
        desk.end();
        assert_eq!(desk.releases.len(), 2);
        assert!(desk.flags().unfit_as_reference());
        assert_eq!(desk.release(condition("K1", ON), swing(SOFT[1])), [None; 2]);
        // A good one again, and all is well.
        desk.release(condition("K1", OFF), good);
        let found = desk.release(condition("K1", ON), swing(SOFT[1]));
        assert!(found.iter().all(|d| d.expect("derivatives").reference_release == 3), "{found:?}");
    }
    // Never refined, for want of time: the refined one goes, the windows' stays its own.
    let mut desk = Desk::new(MemoryFlash::new());
    desk.release(condition("K1", OFF), good);
    desk.announce(condition("K1", OFF));
    for counts in good.counts(2).into_iter().chain(swing(SOFT[1]).counts(3)) {
        desk.device.sample(counts);
        desk.listen();
    }
    desk.end();
    assert_eq!(desk.status().reference, Some(2));
    assert_eq!(desk.status().refined_reference, Some(1));
}

/// A hand on the model in mid-decay: an eighth of the amplitude is gone at once.
fn touched(swing: &Swing, seed: u32) -> Vec<u16> {
    let mut counts = swing.counts(seed);
    for count in counts.iter_mut().skip(6000) {
        *count = (32_768.0 + 0.875 * (f64::from(*count) - 32_768.0)) as u16;
    }
    counts
}

/// What a wind-off release is worth says the uncertainty of its own refined estimate.
#[test]
fn noise_spikes_and_bridged_samples_void_no_refined_reference() {
    let (off, on) = (swing(SOFT[0]), swing(SOFT[1]));
    let noisy = Swing { noise_deg: 0.5, ..off };
    let truth = planted(SOFT[1], SOFT[0]);
    let mut beyond = 0;
    for seed in 0..20 {
        for (what, flag) in
            [("noise", Flags::NOISY), ("spike", Flags::SPIKES), ("lost", Flags::LOST_SAMPLES)]
        {
            let mut desk = Desk::new(MemoryFlash::new());
            desk.announce(condition("K1", OFF));
            let mut counts = if what == "noise" { noisy.counts(seed) } else { off.counts(seed) };
            let at = 4000 + 150 * seed as usize;
            if what == "spike" {
                counts[at] = 1000;
            }
            desk.play(counts[..at].iter().copied());
            if what == "lost" {
                desk.device.lost(1);
            }
            desk.play(counts[at + usize::from(what == "lost")..].iter().copied());
            desk.end();
            assert!(desk.flags().has(flag), "{what} {seed}");
            assert_eq!(desk.status().refined_reference, Some(0), "{what} {seed}");
            let [_, refined] = desk.release(condition("K1", ON), on);
            let found = refined.expect("derivatives");
            assert_eq!(found.reference_release, 0);
            for (found, truth) in [(found.cn_beta, truth.cn_beta), (found.cn_r, truth.cn_r)] {
                let miss = (f64::from(found.value) - truth) / f64::from(found.u);
                assert!(miss.abs() < 4.0, "{what} {seed}: {miss:+.1} u");
                beyond += usize::from(miss.abs() > 2.0);
            }
        }
    }
    // One in twenty of 120, and twice that at most.
    assert!(beyond <= 12, "{beyond} of 120 beyond two standard uncertainties");
}

/// The release that is going on ends under the condition it began with.
#[test]
fn a_condition_takes_effect_with_the_next_release() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.release(condition("K1", OFF), swing(SOFT[0]));
    desk.announce(condition("K1", ON));
    let counts = swing(SOFT[1]).counts(2);
    let (first, rest) = counts.split_at(6000);
    desk.play(first.iter().copied());
    desk.announce(condition("K4", OFF));
    assert_eq!(desk.status().reference, Some(0), "not before the release is over");
    desk.play(rest.iter().copied());
    desk.end();
    assert!(desk.releases[1].derivatives.is_some(), "{:?}", desk.releases);
    assert!(desk.refined[1].derivatives.is_some());
    // And now it does.
    desk.release(condition("K4", OFF), swing(STIFF[0]));
    assert!(desk.release(condition("K4", ON), swing(STIFF[1]))[0].is_some());
}

/// Each has errors of its own.
#[test]
fn another_network_s_wind_off_release_is_no_reference() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.release(condition("K1", OFF), swing(SOFT[0]));
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, 1).expect("a blob");
    desk.write(&bytes);
    assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    let [network, refined] = desk.release(condition("K1", ON), swing(SOFT[1]));
    assert!(network.is_none() && refined.is_some());
    assert!(desk.releases[1].flags.has(Flags::NO_REFERENCE));
    assert!(!desk.refined[1].flags.has(Flags::NO_REFERENCE));
    // The rig is as it was, and nobody has to say so again: with a wind-off release of the new network there
    // is one.
    desk.release(condition("K1", OFF), swing(SOFT[0]));
    assert_eq!([desk.status().reference, desk.status().refined_reference], [Some(2); 2]);
    let found = desk.release(condition("K1", ON), swing(SOFT[1]));
    assert!(found.iter().all(|d| d.expect("derivatives").reference_release == 2), "{found:?}");
}

#[test]
fn a_change_of_network_leaves_the_rig_mounted() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.announce(condition("K1", OFF));
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, 1).expect("a blob");
    desk.write(&bytes);
    assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    // Under the condition that holds, without another word of it.
    desk.play(swing(SOFT[0]).counts(1));
    desk.end();
    assert_eq!([desk.status().reference, desk.status().refined_reference], [Some(0); 2]);
}

#[test]
fn what_cannot_be_is_refused() {
    let mut desk = Desk::new(MemoryFlash::new());
    let good = condition("K1", ON);
    let wind =
        |density_kg_m3, speed_m_s| Condition { wind: Wind { density_kg_m3, speed_m_s }, ..good };
    let model = |length_m, frontal_area_m2| Condition {
        model: Model { length_m, frontal_area_m2 },
        ..good
    };
    let inertia = |inertia_kg_m2| Condition { inertia_kg_m2, ..good };
    let wrong = [
        (wind(f64::NAN, 10.0), ConditionFault::Density),
        (wind(0.0, 10.0), ConditionFault::Density),
        (wind(1200.0, 10.0), ConditionFault::Density),
        (wind(1.2, f64::NAN), ConditionFault::WindSpeed),
        (wind(1.2, -10.0), ConditionFault::WindSpeed),
        (wind(1.2, f64::INFINITY), ConditionFault::WindSpeed),
        (model(f64::NAN, 0.036), ConditionFault::Length),
        (model(625.0, 0.036), ConditionFault::Length),
        (model(0.625, -0.036), ConditionFault::FrontalArea),
        (model(0.625, 0.0), ConditionFault::FrontalArea),
        (inertia(-0.1), ConditionFault::Inertia),
        (inertia(f64::NAN), ConditionFault::Inertia),
        (inertia(1e9), ConditionFault::Inertia),
    ];
    desk.announce(good);
    for (condition, fault) in wrong {
        let refused = Reply::Refused(Refusal::Condition(fault));
        assert_eq!(desk.ask(&Request::Condition(condition)), refused, "{condition:?}");
        assert_eq!(desk.status().condition, Some(good));
    }
    desk.announce(inertia(0.0));
}

/// A reset that leaves RAM as it is: the board kept what the device gave it to keep.
#[test]
fn a_reset_leaves_the_reference_and_the_number_of_the_next_release() {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.release(condition("K1", OFF), swing(SOFT[0]));
    let memory = desk.device.memory().expect("it has changed");
    assert!(desk.device.memory().is_none(), "it has not since");

    let reset = |memory: &Memory| {
        let mut desk = Desk::new(MemoryFlash::new());
        desk.device.recall(memory);
        desk
    };
    let mut desk = reset(&memory);
    let [network, refined] = desk.release(condition("K1", ON), swing(SOFT[1]));
    let truth = planted(SOFT[1], SOFT[0]);
    for found in [network, refined].map(|found| found.expect("derivatives")) {
        assert_eq!(found.reference_release, 0);
        let miss = f64::from(found.cn_beta.value) - truth.cn_beta;
        let allowed = 4.0 * f64::from(found.cn_beta.u) + 0.01 * truth.cn_beta.abs();
        assert!(miss.abs() < allowed, "{found:?}");
    }
    assert_eq!(desk.releases[0].release, 1);

    // Another spring was mounted meanwhile, or power has gone: none.
    for mut desk in [reset(&memory), reset(&Memory([0xa5; BYTES])), reset(&Memory::NONE)] {
        assert_eq!(desk.release(condition("K4", ON), swing(STIFF[1])), [None; 2]);
        assert!(desk.flags().has(Flags::NO_REFERENCE));
    }
    // A bit that has changed is found.
    let mut damaged = memory;
    damaged.0[20] ^= 1;
    let mut desk = reset(&damaged);
    assert_eq!(desk.release(condition("K1", ON), swing(SOFT[1])), [None; 2]);
}
