//! A release by another integrator than the fit's.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use yawrig_core::record::Record;
use yawrig_rig::runge_kutta;

/// Of a rig with this state, its first number the yaw angle, rad, and the slope of that: held for 1 s, then let go.
/// Runge-Kutta steps of a tenth of a millisecond, 1 kHz, noise 0.05 deg, 0.005 deg a count.
pub fn let_go<const N: usize>(
    mut x: [f64; N],
    slope: impl Fn([f64; N]) -> [f64; N],
    seconds: f64,
    seed: u64,
) -> Record {
    const STEP_S: f64 = 1e-4;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut record = Record::new(format!("let-go-{seed}"), vec![], vec![]);
    for k in 0..(seconds / STEP_S) as usize {
        let t = k as f64 * STEP_S;
        if k % 10 == 0 {
            let noise: f64 = StandardNormal.sample(&mut random);
            record.time_s.push(t);
            record.yaw_deg.push(((x[0].to_degrees() + 0.05 * noise) / 0.005).round() * 0.005);
        }
        if t >= 1.0 {
            x = runge_kutta(x, STEP_S, |_, x| slope(x));
        }
    }
    record
}
