//! Training sets for fits: bin means of a decaying sinusoid over three cycles, in closed form.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

pub const BINS: usize = 40;
pub const CYCLES: f64 = 3.0;
/// rad/s
pub const WN: (f64, f64) = (2.5, 26.5);
pub const ZETA: (f64, f64) = (0.001, 0.1);

/// Features of `n` draws, row-major, and their (wn, zeta); unscaled.
pub struct Draws {
    pub features: Vec<f64>,
    pub truth: Vec<[f64; 2]>,
}

/// Mean of exp(-zeta wn t) sin(wd t) over [t0, t1].
fn bin_mean(wn: f64, zeta: f64, t0: f64, t1: f64) -> f64 {
    let (sigma, wd) = (zeta * wn, wn * (1.0 - zeta * zeta).sqrt());
    let integral =
        |t: f64| -(-sigma * t).exp() * (sigma * (wd * t).sin() + wd * (wd * t).cos()) / (wn * wn);
    (integral(t1) - integral(t0)) / (t1 - t0)
}

/// `noise`: standard deviation of a bin mean as a share of the response's peak.
pub fn draw(n: usize, noise: f64, seed: u64) -> Draws {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut features = Vec::with_capacity(n * (BINS + 1));
    let mut truth = Vec::with_capacity(n);
    for _ in 0..n {
        let wn = rng.random_range(WN.0..WN.1);
        let zeta = rng.random_range(ZETA.0..ZETA.1);
        let duration = CYCLES * 2.0 * PI / (wn * (1.0 - zeta * zeta).sqrt());
        let edge = |i: usize| duration * i as f64 / BINS as f64;
        let mut bins: Vec<f64> = (0..BINS)
            .map(|i| {
                let e: f64 = StandardNormal.sample(&mut rng);
                bin_mean(wn, zeta, edge(i), edge(i + 1)) + noise * e
            })
            .collect();
        let rms = (bins.iter().map(|b| b * b).sum::<f64>() / BINS as f64).sqrt();
        bins.iter_mut().for_each(|b| *b /= rms);
        features.extend(bins);
        features.push(1.0 / duration);
        truth.push([wn, zeta]);
    }
    Draws { features, truth }
}

/// The thesis's features of the same responses: point samples over the peak of each, duration to [-1, 1].
#[allow(dead_code)] // of the users of this module only the tests want it
pub fn thesis_inputs(draws: &Draws) -> Vec<f64> {
    let durations = (CYCLES * 2.0 * PI / WN.1, CYCLES * 2.0 * PI / WN.0);
    let response = |[wn, zeta]: &[f64; 2]| {
        let wd = wn * (1.0 - zeta * zeta).sqrt();
        let duration = CYCLES * 2.0 * PI / wd;
        let sample = |i: usize| {
            let t = duration * i as f64 / BINS as f64;
            (-zeta * wn * t).exp() * (wd * t).sin()
        };
        let samples: Vec<f64> = (0..BINS).map(sample).collect();
        let peak = samples.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let mut row: Vec<f64> = samples.iter().map(|v| v / peak).collect();
        row.push(unit(duration, durations));
        row
    };
    draws.truth.iter().flat_map(response).collect()
}

/// One scale for all bins, [-1, 1] for the reciprocal of the duration and for the targets.
pub struct Scaling {
    bins: f64,
    rate: (f64, f64),
}

fn unit(v: f64, (lo, hi): (f64, f64)) -> f64 {
    (2.0 * v - lo - hi) / (hi - lo)
}

impl Scaling {
    pub fn new(train: &Draws) -> Self {
        let rows = || train.features.chunks_exact(BINS + 1);
        let bins = rows().flat_map(|r| &r[..BINS]).fold(0.0, |m: f64, v| m.max(v.abs()));
        let rates = || rows().map(|r| r[BINS]);
        Self { bins, rate: (rates().fold(f64::MAX, f64::min), rates().fold(f64::MIN, f64::max)) }
    }
    pub fn inputs(&self, draws: &Draws) -> Vec<f64> {
        let row = |r: &[f64]| {
            let mut row: Vec<f64> = r[..BINS].iter().map(|b| b / self.bins).collect();
            row.push(unit(r[BINS], self.rate));
            row
        };
        draws.features.chunks_exact(BINS + 1).flat_map(row).collect()
    }
    pub fn targets(&self, draws: &Draws) -> Vec<f64> {
        draws.truth.iter().flat_map(|[wn, zeta]| [unit(*wn, WN), unit(*zeta, ZETA)]).collect()
    }
}

/// Half the range of each target: what a scaled error of 1 is worth, rad/s and 1.
fn half_ranges() -> [f64; 2] {
    [(WN.1 - WN.0) / 2.0, (ZETA.1 - ZETA.0) / 2.0]
}

/// Mean squared error of each output in physical units, (rad/s)^2 and 1; `predict` gives scaled outputs.
pub fn scaled_mse(targets: &[f64], predict: impl Fn(usize) -> Vec<f64>) -> [f64; 2] {
    let n = targets.len() / 2;
    let mut mse = [0.0; 2];
    for s in 0..n {
        let outputs = predict(s);
        for (o, half) in half_ranges().into_iter().enumerate() {
            mse[o] += (half * (outputs[o] - targets[2 * s + o])).powi(2) / n as f64;
        }
    }
    mse
}
