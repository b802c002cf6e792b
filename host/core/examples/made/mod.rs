//! Releases as a rig would record them, for the examples: in place of these a program has records of its own.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use yawrig_core::effects::{Effect, Terms};
use yawrig_core::motion::simulate::{Grid, Motion};
use yawrig_core::record::Record;

/// 30 s at 200 Hz from `amplitude_deg` on, with 0.02 deg of noise; `effects` with their numbers.
pub fn release(
    name: &str,
    [natural_frequency_rad_s, damping_ratio]: [f64; 2],
    amplitude_deg: f64,
    effects: &[(Effect, &[f64])],
) -> Record {
    let motion = Motion {
        natural_frequency_rad_s,
        damping_ratio,
        yaw_rad: amplitude_deg.to_radians(),
        rate_rad_s: 0.0,
        terms: Terms::new(effects.iter().cloned()),
    };
    let grid = Grid { start_s: 0.0, step_s: 0.005, count: 6000, mean_width_s: 0.0 };
    let yaw_rad = motion.readings(&grid);
    let noise_deg = Normal::new(0.0, 0.02).expect("a standard deviation");
    let mut rng = ChaCha8Rng::seed_from_u64(name.bytes().map(u64::from).sum());
    let yaw_deg = yaw_rad.iter().map(|y| y.to_degrees() + noise_deg.sample(&mut rng)).collect();
    Record::new(name, (0..grid.count).map(|k| grid.time_s(k)).collect(), yaw_deg)
}
