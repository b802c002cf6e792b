//! What a device learns of its network's error on a rig: the virtual rig's releases, network-only results against what was
//! planted, beside those of a device that is told no rig and so learns nothing.

mod desk;

use desk::Desk;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::blob;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{rig_id, Condition, Measured, ReleaseResult, Reply, Request};

const RELEASES: u64 = 8;

/// The network of the device, its weights a little off, as one that was trained too short is: it errs by a thousandth
/// in natural frequency and a hundredth in damping, smoothly in both. Its training is taken to have found that.
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
    let mut desk = Desk::new(MemoryFlash::new());
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
    Request::Condition(Condition {
        rig: rig_id("K3", "mid"),
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
    let Request::Condition(condition) = condition() else { unreachable!() };
    let other = Condition { rig: rig_id("K4", "mid"), ..condition };
    assert_eq!(taught.ask(&Request::Condition(other)), Reply::Done);
    // From the same moment on, or its blocks would be others.
    for _ in 0..RELEASES {
        release(&mut plain, &truth, 1);
    }
    let [one, none] = [&mut taught, &mut plain].map(|desk| {
        while desk.device.samples() % 4096 != 0 {
            desk.play([32_768]);
        }
        release(desk, &truth, 5)
    });
    let same = |a: Measured, b: Measured| (a.value - b.value).abs() < 0.02 * b.u;
    assert!(same(one.damping_ratio, none.damping_ratio), "{one:?} {none:?}");
    assert!(same(one.natural_frequency_rad_s, none.natural_frequency_rad_s), "{one:?} {none:?}");
}
