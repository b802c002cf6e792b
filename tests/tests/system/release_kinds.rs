//! Where the free decay begins after what a rig is done to: planted by another integrator than the fit's.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;
use yawrig_core::identify::{identify, Begin, Identification, Method, Settings};
use yawrig_core::record::Record;
use yawrig_rig::runge_kutta;

/// Natural frequency of all rigs: a cycle is a second.
const WN: f64 = TAU;
const RATE_HZ: f64 = 40.0;
/// Of each kind.
const RECORDS: u64 = 8;

/// What acts until the release: a moment over the inertia at a time, or a hand at an angle.
enum Acts {
    Moment(f64),
    Hand(f64),
}

/// A rig let go at `start` rad that swings freely but for what acts on it, in rad at `RATE_HZ`. Runge and Kutta's
/// fourth order, a hundred steps a cycle.
fn swing(zeta: f64, start: f64, cycles: f64, acts: impl Fn(f64) -> Acts) -> Vec<f64> {
    let (step, mut state) = (0.01, [start, 0.0]);
    let slope = |[x, v]: [f64; 2], t: f64| match acts(t) {
        Acts::Moment(m) => [v, m - 2.0 * zeta * WN * v - WN * WN * x],
        Acts::Hand(_) => [0.0, 0.0],
    };
    let mut motion = Vec::new();
    for k in 0..(cycles / step) as usize {
        let t = k as f64 * step;
        if let Acts::Hand(at) = acts(t) {
            state = [at, 0.0];
        }
        motion.push(state[0]);
        state = runge_kutta(state, step, |after, state| slope(state, t + after));
    }
    let at = |k: usize| {
        let place = k as f64 / RATE_HZ / step;
        let (k, share) = (place as usize, place.fract());
        motion[k] + share * (motion[k + 1] - motion[k])
    };
    (0..((motion.len() - 2) as f64 * step * RATE_HZ) as usize).map(at).collect()
}

/// In deg, with noise, rounded as a converter does.
fn found(yaw_rad: &[f64], random: &mut ChaCha8Rng) -> Option<Identification> {
    let noise = Normal::new(0.0, 0.03).expect("a width");
    let as_read = |y: &f64| ((y.to_degrees() + noise.sample(random)) / 0.02).round() * 0.02;
    let yaw_deg: Vec<f64> = yaw_rad.iter().map(as_read).collect();
    let time_s = (0..yaw_deg.len()).map(|k| k as f64 / RATE_HZ).collect();
    let record = Record::new("release.csv", time_s, yaw_deg);
    identify(&record, &[Method::LeastSquares], &Settings::default()).ok()
}

/// Records of one kind whose release is found within a cycle and whose frequency is the rig's.
fn right(seed: u64, make: impl Fn(&mut ChaCha8Rng, f64) -> (Vec<f64>, f64)) -> u64 {
    let one = |k: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(100 * seed + k);
        let zeta = 10f64.powf(random.random_range(-2.5..-1.4));
        let (yaw_rad, released_s) = make(&mut random, zeta);
        let found = found(&yaw_rad, &mut random);
        found.is_some_and(|f| {
            let wn = f.estimates[0].natural_frequency_rad_s.value;
            (f.release_time_s - released_s).abs() < 1.0 && (wn / WN - 1.0).abs() < 0.05
        })
    };
    (0..RECORDS).map(|k| u64::from(one(k))).sum()
}

const FREE: Acts = Acts::Moment(0.0);

#[test]
fn a_drive_that_is_switched_off() {
    // At its own frequency and steady from the first sample on, as somebody who records later has it.
    let made = |random: &mut ChaCha8Rng, zeta: f64| {
        let off_s = random.random_range(6.0..20.0);
        let drive = |t: f64| match t < off_s {
            true => Acts::Moment(-2.0 * zeta * WN * WN * 0.2 * (WN * t).sin()),
            false => FREE,
        };
        (swing(zeta, 0.2, 50.0, drive), off_s)
    };
    assert_eq!(right(1, made), RECORDS);
}

#[test]
fn pushes_from_rest_over_some_cycles_and_a_knock_while_it_swings() {
    let pushed = |random: &mut ChaCha8Rng, zeta: f64| {
        let (from_s, long_s) = (random.random_range(1.0..8.0), random.random_range(0.5..3.0));
        let push = move |t: f64| match (from_s..from_s + long_s).contains(&t) {
            true => Acts::Moment(3.0 * (WN * (t - from_s)).cos()),
            false => FREE,
        };
        (swing(zeta, 0.0, 50.0, push), from_s + long_s)
    };
    assert_eq!(right(2, pushed), RECORDS);
    let knocked = |random: &mut ChaCha8Rng, zeta: f64| {
        let at_s = random.random_range(6.0..12.0);
        let knock = move |t: f64| match (at_s..at_s + 0.05).contains(&t) {
            true => Acts::Moment(60.0),
            false => FREE,
        };
        (swing(zeta, 0.1, 60.0, knock), at_s)
    };
    assert_eq!(right(3, knocked), RECORDS);
}

#[test]
fn a_hand_that_turns_it_slowly_and_lets_go_at_once() {
    let made = |random: &mut ChaCha8Rng, zeta: f64| {
        let (from_s, long_s) = (random.random_range(1.0..8.0), random.random_range(1.5..4.0));
        let hand = move |t: f64| match t < from_s + long_s {
            true => Acts::Hand(0.25 * ((t - from_s) / long_s).clamp(0.0, 1.0)),
            false => FREE,
        };
        (swing(zeta, 0.0, 50.0, hand), from_s + long_s)
    };
    assert_eq!(right(4, made), RECORDS);
}

/// Two modes that beat are let go once, and nobody drives them.
#[test]
fn beats_are_no_drive() {
    for k in 0..RECORDS {
        let mut random = ChaCha8Rng::seed_from_u64(500 + k);
        let zeta = 10f64.powf(random.random_range(-3.4..-1.8));
        let ratio: f64 = random.random_range(1.1..1.4);
        let part = random.random_range(0.3..0.9);
        let mode = |w: f64, t: f64| (-zeta * w * t).exp() * (w * t).cos();
        let yaw = |t: f64| 0.15 * (mode(WN, t) + part * mode(ratio * WN, t));
        let yaw_rad: Vec<f64> = (0..2000).map(|k| yaw(f64::from(k) / RATE_HZ)).collect();
        let found = found(&yaw_rad, &mut random).expect("an oscillation");
        assert!(found.release_time_s.abs() < 1.0, "{ratio} {part}: {}", found.release_time_s);
        assert_ne!(found.begins, Begin::Driven, "{ratio} {part}");
    }
}

/// What is found in so many samples of a mode, struck after two cycles, beside another of this size in rad, damping
/// ratio and frequency over the rig's.
fn struck(
    random: &mut ChaCha8Rng,
    count: i32,
    zeta: f64,
    [size, of_other, ratio]: [f64; 3],
) -> Identification {
    let mode = |z: f64, w: f64, t: f64| (-z * w * t).exp() * (w * t).sin();
    let yaw = |t: f64| 0.15 * mode(zeta, WN, t) + size * mode(of_other, ratio * WN, t);
    let yaw_rad: Vec<f64> = (-80..count).map(|k| yaw(f64::from(k.max(0)) / RATE_HZ)).collect();
    found(&yaw_rad, random).expect("an oscillation")
}

/// A hammer on a beam: what rings for a moment is larger than what lasts.
#[test]
fn a_knock_that_rings_higher_for_a_moment() {
    for k in 0..RECORDS {
        let mut random = ChaCha8Rng::seed_from_u64(600 + k);
        let zeta = 10f64.powf(random.random_range(-2.5..-1.6));
        let high = random.random_range(0.2..0.5);
        let found = struck(&mut random, 2000, zeta, [high, 0.15, 5.3]);
        let wn = found.estimates[0].natural_frequency_rad_s.value;
        assert!((wn / WN - 1.0).abs() < 0.02, "{high} {zeta}: {wn}");
        assert!((1.0..5.0).contains(&found.release_time_s), "{}", found.release_time_s);
    }
}

/// A fork: its handle swings slowly for some cycles, further than the mode that lasts.
#[test]
fn a_knock_that_rings_lower_for_a_while() {
    for k in 0..RECORDS {
        let mut random = ChaCha8Rng::seed_from_u64(700 + k);
        let zeta = 10f64.powf(random.random_range(-4.0..-3.0));
        let low = random.random_range(0.6..1.2);
        let ratio: f64 = random.random_range(0.15..0.4);
        let found = struck(&mut random, 8000, zeta, [low, 0.08, ratio]);
        let wn = found.estimates[0].natural_frequency_rad_s;
        assert!((wn.value / WN - 1.0).abs() < 1e-3, "{low} {ratio} {zeta}: {wn}");
        assert!(wn.u < 3e-3 * WN, "{low} {ratio} {zeta}: {wn}");
    }
}
