//! Where a release begins that grows to a limit cycle, or decays to one: planted by another integrator than the fit's.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::{PI, TAU};
use yawrig_core::identify::{identify, Begin, Method, Settings};
use yawrig_core::record::Record;
use yawrig_rig::runge_kutta;

const RATE_HZ: f64 = 100.0;
const RECORDS: u64 = 64;

/// Held for a time, then let go with negative damping at rest that the square of the angle ends.
struct Release {
    natural_frequency_rad_s: f64,
    /// At rest, below zero.
    damping_ratio: f64,
    held_s: f64,
    held_deg: f64,
    /// Amplitude of the limit cycle over `held_deg`.
    limit_ratio: f64,
    noise_deg: f64,
    free_s: f64,
}

impl Release {
    /// Three in four grow to 1.05 to 3 times the amplitude they are let go at, the fourth decays to half of it.
    fn drawn(k: u64, random: &mut ChaCha8Rng) -> Self {
        let mut power = |from: f64, to: f64| 10f64.powf(random.random_range(from..to));
        let (size, noise_deg) = (power(-3.3, -1.7), power(-2.0, -0.7));
        let decays = k.is_multiple_of(4);
        Self {
            natural_frequency_rad_s: random.random_range(5.0..10.0),
            damping_ratio: -size,
            held_s: if k % 8 == 1 { 0.0 } else { random.random_range(0.0..3.0) },
            held_deg: random.random_range(5.0..14.0),
            limit_ratio: if decays { 0.5 } else { random.random_range(1.05..3.0) },
            noise_deg,
            free_s: random.random_range(20.0..60.0),
        }
    }

    /// Runge and Kutta's fourth order, five steps a sample; read to 0.02 deg.
    fn record(&self, random: &mut ChaCha8Rng) -> Record {
        let (wn, zeta) = (self.natural_frequency_rad_s, self.damping_ratio);
        let limit_rad = self.limit_ratio * self.held_deg * PI / 180.0;
        // Over a cycle of amplitude A the mean of b^2 r^2 is A^2/4 of that of r^2.
        let c = -8.0 * zeta * wn / limit_rad.powi(2);
        let slope = |[b, r]: [f64; 2]| [r, -wn * wn * b - (2.0 * zeta * wn + c * b * b) * r];
        let noise = Normal::new(0.0, self.noise_deg).expect("a width");
        let (held, free) = ((self.held_s * RATE_HZ) as usize, (self.free_s * RATE_HZ) as usize);
        let (mut state, h) = ([self.held_deg * PI / 180.0, 0.0], 0.2 / RATE_HZ);
        let mut yaw_deg = Vec::new();
        for k in 0..held + free {
            let read = state[0] * 180.0 / PI + noise.sample(random);
            yaw_deg.push((read / 0.02).round() * 0.02);
            for _ in 0..if k < held { 0 } else { 5 } {
                state = runge_kutta(state, h, |_, state| slope(state));
            }
        }
        let time_s = (0..yaw_deg.len()).map(|k| k as f64 / RATE_HZ).collect();
        Record::new("release.csv", time_s, yaw_deg)
    }
}

/// Found within a quarter of a cycle, and none of the hold is analysed.
#[test]
fn release_that_grows_out_of_a_hold_or_decays_to_a_limit_cycle() {
    let mut right = 0;
    for k in 0..RECORDS {
        let mut random = ChaCha8Rng::seed_from_u64(7000 + k);
        let release = Release::drawn(k, &mut random);
        let record = release.record(&mut random);
        let Ok(found) = identify(&record, &[Method::LeastSquares], &Settings::default()) else {
            println!("{k}: refused");
            continue;
        };
        let cycle_s = TAU / release.natural_frequency_rad_s;
        let held_s = (release.held_s * RATE_HZ).floor() / RATE_HZ;
        let off = (found.release_time_s - held_s) / cycle_s;
        let analysed_off = (found.window.from_s - held_s) / cycle_s;
        let is_seen = held_s < 0.5 * cycle_s || found.begins == Begin::Held;
        if off.abs() < 0.25 && analysed_off > -0.1 && is_seen {
            right += 1;
        } else {
            let Release { damping_ratio, limit_ratio, noise_deg, .. } = release;
            println!(
                "{k}: {off:.2} cycles, {:?}, {damping_ratio:.4} {limit_ratio:.2} {noise_deg:.3}",
                found.begins
            );
        }
    }
    println!("{right} of {RECORDS}");
    assert!(right as f64 >= 0.95 * RECORDS as f64, "{right} of {RECORDS}");
}
