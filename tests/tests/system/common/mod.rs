//! Planted releases: the truth integrated by Runge-Kutta, the noise from fixed seeds.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// A release from rest at `from_deg`, sampled at `rate_hz` until its envelope is down to `to_deg`.
pub fn release(
    wn: f64,
    zeta: f64,
    rate_hz: f64,
    from_deg: f64,
    to_deg: f64,
) -> (Vec<f64>, Vec<f64>) {
    let duration_s = (from_deg / to_deg).ln() / (zeta * wn);
    swing(wn, zeta, rate_hz, from_deg, duration_s)
}

/// b'' = -2 zeta wn b' - wn^2 b from (`from_deg`, 0) by fourth-order Runge-Kutta, four steps a sample or
/// more.
pub fn swing(
    wn: f64,
    zeta: f64,
    rate_hz: f64,
    from_deg: f64,
    duration_s: f64,
) -> (Vec<f64>, Vec<f64>) {
    let step = 1.0 / rate_hz;
    let substeps = (4.0_f64).max((step * wn / 0.005).ceil()) as usize;
    let h = step / substeps as f64;
    let slope = |x: [f64; 2]| [x[1], -2.0 * zeta * wn * x[1] - wn * wn * x[0]];
    let shifted = |x: [f64; 2], k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
    let mut x = [from_deg, 0.0];
    let (mut time, mut yaw) = (Vec::new(), Vec::new());
    for n in 0..(duration_s * rate_hz) as usize {
        time.push(n as f64 * step);
        yaw.push(x[0]);
        for _ in 0..substeps {
            let a = slope(x);
            let b = slope(shifted(x, a, 0.5 * h));
            let c = slope(shifted(x, b, 0.5 * h));
            let d = slope(shifted(x, c, h));
            for i in 0..2 {
                x[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
        }
    }
    (time, yaw)
}

/// Adds noise of standard deviation `rms` and lag-one correlation `correlation` (0: white).
pub fn with_noise(yaw: &[f64], rms: f64, correlation: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let fresh = (1.0 - correlation * correlation).sqrt();
    let mut state: f64 = normal.sample(&mut random);
    yaw.iter()
        .map(|y| {
            let noisy = y + rms * state;
            state = correlation * state + fresh * normal.sample(&mut random);
            noisy
        })
        .collect()
}

/// Impulse response of the thesis's (4.1) with its middle term put right, wn^2 / (s^2 + 2 zeta wn s + wn^2),
/// until its envelope is down to `to`. In closed form.
pub fn impulse_response(wn: f64, zeta: f64, rate_hz: f64, to: f64) -> (Vec<f64>, Vec<f64>) {
    let wd = wn * (1.0 - zeta * zeta).sqrt();
    let peak = wn * wn / wd;
    let samples = ((peak / to).ln() / (zeta * wn) * rate_hz) as usize;
    let time: Vec<f64> = (0..samples).map(|k| k as f64 / rate_hz).collect();
    let yaw = time.iter().map(|t| peak * (-zeta * wn * t).exp() * (wd * t).sin()).collect();
    (time, yaw)
}
