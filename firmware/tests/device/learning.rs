//! What a device learns of its network's error on a rig: the virtual rig's releases, network-only results
//! against what was planted, beside those of a device that is told no rig and so learns nothing.

use crate::desk::Desk;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::blob;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{
    rig_id, Condition, Forgotten, Learnt, Measured, Phase, ReleaseResult, Reply, Request,
};

const RELEASES: u64 = 8;

/// The network of the device, its weights a little off, as one that was trained too short is: it errs by a
/// thousandth in natural frequency and a hundredth in damping, smoothly in both. Its training is taken to
/// have found that.
fn hasty() -> Vec<u8> {
    let (_, mut payload) = blob::decode(BUILT_IN).expect("the compiled-in network");
    let mut random = ChaCha8Rng::seed_from_u64(41);
    for weight in &mut payload.network.weights {
        *weight *= 1.0 + random.random_range(-0.0004..0.0004);
    }
    payload.network.bias_rms = [0.02, 0.0005];
    for golden in &mut payload.golden {
        let inputs: Vec<f32> = golden.inputs.iter().map(|bits| f32::from_bits(*bits)).collect();
        *golden = blob::golden(&payload.network, &inputs);
    }
    payload.from_counts = Some(blob::from_counts(&payload.network));
    let mut bytes = vec![0; blob::LONGEST];
    let length = blob::encode(&payload, 1, &mut bytes).expect("a blob");
    bytes.truncate(length);
    bytes
}

fn with_network(network: &[u8]) -> Desk {
    taking(Desk::new(MemoryFlash::new()), network)
}

/// A device that takes this network.
fn taking(mut desk: Desk, network: &[u8]) -> Desk {
    if network != BUILT_IN {
        desk.write(network);
        assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
        assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
    }
    desk
}

fn rigs(count: usize) -> Vec<Modal> {
    let mut random = ChaCha8Rng::seed_from_u64(63);
    let mut draw = || Modal {
        natural_frequency_rad_s: 4.0 * f64::powf(5.0, random.random()),
        damping_ratio: 0.006 * f64::powf(6.0, random.random()),
    };
    (0..count).map(|_| draw()).collect()
}

fn condition() -> Request {
    of_spring("K3")
}

fn of_spring(spring: &str) -> Request {
    Request::Condition(Condition {
        rig: rig_id(spring, "mid"),
        wind: Wind { density_kg_m3: 1.2, speed_m_s: 0.0 },
        model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
        inertia_kg_m2: 0.0,
    })
}

fn release(desk: &mut Desk, truth: &Modal, seed: u64) -> ReleaseResult {
    let end = End::Below { amplitude_deg: 0.7, at_most_s: 300.0 };
    let start = Start { amplitude_deg: 12.0 + (seed % 5) as f64, hold_s: 2.0, end };
    let sensor = Sensor { noise_deg: 0.03, ..Sensor::default() };
    let samples = Samples::new(Motion::new(truth), &start, &sensor, seed);
    desk.play(samples.filter_map(|sample| sample.counts));
    desk.end();
    *desk.releases.last().expect("a result")
}

/// Relative, natural frequency and damping ratio.
fn errors(result: &ReleaseResult, truth: &Modal) -> [f64; 2] {
    let ReleaseResult { natural_frequency_rad_s: wn, damping_ratio: zeta, .. } = result;
    [
        (f64::from(wn.value) / truth.natural_frequency_rad_s - 1.0).abs(),
        (f64::from(zeta.value) / truth.damping_ratio - 1.0).abs(),
    ]
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A device that was told its rig, after so many releases of it, and one that learns nothing.
fn taught(network: &[u8], truth: &Modal, seed: u64) -> [Desk; 2] {
    let mut desks = [with_network(network), with_network(network)];
    assert_eq!(desks[0].ask(&condition()), Reply::Done);
    for k in 0..RELEASES {
        release(&mut desks[0], truth, 100 * seed + k);
    }
    desks
}

#[test]
fn after_eight_releases_the_network_s_error_on_the_rig_is_less_than_half() {
    let network = hasty();
    let mut found = [[vec![], vec![]], [vec![], vec![]]];
    let rigs = rigs(16);
    for (seed, truth) in rigs.iter().enumerate() {
        // The same release to both.
        for (desk, found) in taught(&network, truth, seed as u64).iter_mut().zip(&mut found) {
            let result = release(desk, truth, 7000 + seed as u64);
            let errors = errors(&result, truth);
            (0..2).for_each(|output| found[output].push(errors[output]));
        }
    }
    let [after, before] = found.map(|found| found.map(median));
    println!(
        "median error of {} rigs: wn {:.2e} without, {:.2e} after {RELEASES} releases; zeta {:.2e}, {:.2e}",
        rigs.len(),
        before[0],
        after[0],
        before[1],
        after[1]
    );
    assert!(after[0] < 0.5 * before[0] && after[1] < 0.5 * before[1]);
}

/// Another spring without a word: slightly another, and one that is quite another.
fn changed(networks: &[&[u8]], count: usize) {
    let changes = [[1.0, 1.5], [1.03, 1.2], [1.3, 1.7], [0.6, 0.5]];
    for (network, [stiffer, damped]) in
        networks.iter().flat_map(|network| changes.map(|change| (*network, change)))
    {
        let mut squares = [[0.0; 2]; 2];
        let rigs = rigs(count);
        for (seed, truth) in rigs.iter().enumerate() {
            let changed = Modal {
                natural_frequency_rad_s: truth.natural_frequency_rad_s * stiffer,
                damping_ratio: truth.damping_ratio * damped,
            };
            for (desk, squares) in taught(network, truth, seed as u64).iter_mut().zip(&mut squares)
            {
                // The first, and the one after that has been learnt from.
                for k in 0..2 {
                    let result = release(desk, &changed, 9000 + 2 * seed as u64 + k);
                    let errors = errors(&result, &changed);
                    (0..2).for_each(|output| squares[output] += errors[output] * errors[output]);
                }
            }
        }
        let rms = squares.map(|s| s.map(|s| (s / (2 * rigs.len()) as f64).sqrt()));
        println!(
            "network {}, wn x {stiffer}, zeta x {damped}: rms with and without {rms:.6?}",
            network.len()
        );
        for output in 0..2 {
            // Noise that was learnt with the error is a little of either.
            assert!(rms[0][output] <= 1.05 * rms[1][output], "{stiffer} {damped}: {rms:?}");
        }
    }
}

#[test]
fn on_a_rig_that_changed_it_is_no_worse_than_one_that_has_learnt_nothing() {
    changed(&[&hasty()], 4);
}

#[test]
fn on_a_rig_that_changed_it_is_no_worse_with_a_good_network_either_at_full_size() {
    changed(&[BUILT_IN, &hasty()], 16);
}

#[test]
fn what_was_learnt_is_forgotten_with_the_rig_and_with_the_network() {
    let truth = Modal { natural_frequency_rad_s: 9.0, damping_ratio: 0.02 };
    let [mut taught, mut plain] = taught(&hasty(), &truth, 1);
    assert_eq!(taught.ask(&of_spring("K4")), Reply::Done);
    // From the same moment on, or its blocks would be others.
    for _ in 0..RELEASES {
        release(&mut plain, &truth, 1);
    }
    let [one, none] = [&mut taught, &mut plain].map(|desk| {
        while !desk.device.samples().is_multiple_of(4096) {
            desk.play([32_768]);
        }
        release(desk, &truth, 5)
    });
    let same = |a: Measured, b: Measured| (a.value - b.value).abs() < 0.02 * b.u;
    assert!(same(one.damping_ratio, none.damping_ratio), "{one:?} {none:?}");
    assert!(same(one.natural_frequency_rad_s, none.natural_frequency_rad_s), "{one:?} {none:?}");
}

const TRUTH: Modal = Modal { natural_frequency_rad_s: 9.0, damping_ratio: 0.02 };
const NOTHING: Learnt = Learnt { releases: 0, kept: true, forgotten: None };

/// The same release to each device, from the same moment on.
fn same_release(desks: &mut [&mut Desk]) -> Vec<ReleaseResult> {
    let given = |desk: &mut &mut Desk| {
        while !desk.device.samples().is_multiple_of(4096) {
            desk.play([32_768]);
        }
        release(desk, &TRUTH, 5)
    };
    desks.iter_mut().map(given).collect()
}

fn mean_bits(result: &ReleaseResult) -> [u32; 4] {
    let (wn, zeta) = (result.natural_frequency_rad_s, result.damping_ratio);
    [wn.value, wn.u, zeta.value, zeta.u].map(f32::to_bits)
}

#[test]
fn what_was_learnt_is_there_again_after_a_reset_once_its_rig_is_said() {
    let network = hasty();
    let [mut taught, plain] = taught(&network, &TRUTH, 2);
    let learnt = taught.status().learnt;
    assert_eq!(learnt, Learnt { releases: RELEASES as u16, kept: true, forgotten: None });
    let flash = taught.device.into_flash();
    let again = |flash: &MemoryFlash| Desk::new(flash.clone());
    let [mut told, mut untold, mut other] = [again(&flash), again(&flash), again(&flash)];
    let mut plain = plain.power_cut();
    assert_eq!(told.status().learnt, learnt);
    assert_eq!(told.ask(&condition()), Reply::Done);
    assert_eq!(other.ask(&of_spring("K4")), Reply::Done);
    assert_eq!(
        other.status().learnt,
        Learnt { kept: false, forgotten: Some(Forgotten::Rig), ..NOTHING }
    );
    let found = same_release(&mut [&mut told, &mut untold, &mut other, &mut plain]);
    let bits: Vec<_> = found.iter().map(mean_bits).collect();
    // Who says no rig, or another one, has what the network says.
    assert_eq!(bits[1], bits[3]);
    assert_eq!(bits[2], bits[3]);
    let [with, without] = [&found[0], &found[3]].map(|found| errors(found, &TRUTH));
    println!("after a reset: {with:?}; without what was learnt: {without:?}");
    assert!(with[0] < 0.5 * without[0] && with[1] < 0.5 * without[1]);
    // It goes on learning.
    assert_eq!(told.status().learnt.releases, RELEASES as u16 + 1);
    // The other rig's takes its place, and the first one's is not there any more.
    let was_another = Some(Forgotten::Rig);
    assert_eq!(other.status().learnt, Learnt { releases: 1, forgotten: was_another, kept: true });
    let mut other = other.power_cut();
    assert_eq!(other.ask(&condition()), Reply::Done);
    assert_eq!(other.status().learnt.forgotten, Some(Forgotten::Rig));
}

#[test]
fn a_rig_that_was_taken_off_before_anything_was_learnt_of_the_next_is_forgotten_in_the_flash_too() {
    let [mut taught, _] = taught(&hasty(), &TRUTH, 3);
    assert_eq!(taught.ask(&of_spring("K4")), Reply::Done);
    taught.play([32_768]);
    assert_eq!(taught.status().learnt, Learnt { forgotten: Some(Forgotten::Rig), ..NOTHING });
    let mut again = taught.power_cut();
    assert_eq!(again.ask(&condition()), Reply::Done);
    assert_eq!(again.status().learnt, NOTHING);
}

#[test]
fn another_network_does_not_take_it_and_one_that_was_only_tried_gives_it_back() {
    let [mut taught, _] = taught(&hasty(), &TRUTH, 4);
    let learnt = taught.status().learnt;
    let mut other = BUILT_IN.to_vec();
    blob::set_generation(&mut other, 2).expect("a blob");
    taught.write(&other);
    assert_eq!(taught.ask(&Request::FlashTrial), Reply::Done);
    taught.play([32_768; 10]);
    let nothing = Learnt { forgotten: Some(Forgotten::Network), ..NOTHING };
    // Tried out, and the one before runs again: of its own accord, or after the power was cut.
    assert_eq!(taught.status().learnt, Learnt { kept: false, ..nothing });
    let mut cut = Desk::new(taught.device.into_flash());
    assert_eq!(cut.status().learnt, learnt);
    cut.write(&other);
    assert_eq!(cut.ask(&Request::FlashTrial), Reply::Done);
    assert_eq!(cut.ask(&Request::FlashBegin { length: 1000 }), Reply::Done);
    assert_eq!(cut.status().learnt, learnt);
    // Committed: what was learnt is of no use any more, and is not kept.
    let mut committed = taking(cut, &other);
    committed.play([32_768]);
    assert_eq!(committed.status().learnt, nothing);
    assert_eq!(committed.power_cut().status().learnt, NOTHING);
}

#[test]
fn nothing_is_written_while_a_release_goes_on_and_once_a_release_at_most() {
    let network = hasty();
    let mut desk = with_network(&network);
    assert_eq!(desk.ask(&condition()), Reply::Done);
    let mut writes = 0;
    let mut kept = desk.device.flash().bytes().to_vec();
    for seed in 0..3 {
        let end = End::Below { amplitude_deg: 0.7, at_most_s: 300.0 };
        let start = Start { amplitude_deg: 12.0, hold_s: 2.0, end };
        let sensor = Sensor { noise_deg: 0.03, ..Sensor::default() };
        let samples = Samples::new(Motion::new(&TRUTH), &start, &sensor, seed);
        // What is refined of one release comes while the next one is held, or rings.
        for counts in samples.filter_map(|sample| sample.counts) {
            let before = desk.device.phase();
            desk.play([counts]);
            if desk.device.flash().bytes() != kept {
                assert!(!matches!(before, Phase::Released | Phase::Ringing), "{before:?}");
                kept = desk.device.flash().bytes().to_vec();
                writes += 1;
            }
        }
    }
    desk.end();
    let last = usize::from(desk.device.flash().bytes() != kept);
    assert_eq!((writes + last, desk.refined.len()), (3, 3));
}
