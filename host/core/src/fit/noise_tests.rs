use super::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn coloured(correlation: f64) -> Colour {
    Colour { white_variance: 0.0, coloured_variance: 0.05 * 0.05, correlation, u_share: 0.0 }
}

fn decay(noise: f64, correlation: f64, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut c = 0.0;
    (0..20_000)
        .map(|k| {
            let z: f64 = StandardNormal.sample(&mut rng);
            c = correlation * c + (1.0 - correlation * correlation).sqrt() * z;
            let t = k as f64 * 1e-3;
            let decay = 10.0 * (-0.05 * t).exp() * (7.0 * t).cos();
            decay + 0.05 * decay * decay / 10.0 + noise * c
        })
        .collect()
}

#[test]
fn no_noise_is_larger_than_the_residuals_that_hold_it() {
    let noise = coloured(0.8);
    let all = noise.mean_variance(17);
    assert_eq!(noise.at_most(2.0 * all, 17), noise);
    let cut = noise.at_most(0.25 * all, 17);
    assert!((cut.mean_variance(17) / all - 0.25).abs() < 1e-12);
    assert_eq!(cut.correlation, noise.correlation);
}

#[test]
fn coloured_noise_beside_a_swing_is_measured_and_white_noise_is_left_alone() {
    // The lowest frequencies, which the swing covers, weigh most in a mean: from the record its
    // variance is known to some 20 %, with residuals to some 10 %.
    let mut mean = 0.0;
    for (seed, correlation) in (1..30).map(|k| (k, [0.5, 0.8, 0.95][k as usize % 3])) {
        let truth = coloured(correlation);
        let y = decay(0.05, correlation, seed);
        let shown = Spectrum::of_record(&y, 7e-3);
        let found = shown.colour(17).expect("colour");
        let ratio = found.mean_variance(17) / truth.mean_variance(17);
        let off = (ratio.sqrt() - 1.0) / found.u_share.max(0.03);
        assert!(off.abs() < 4.0, "{correlation}: {ratio}");
        let noise: Vec<f64> = y.iter().zip(decay(0.0, 0.0, 0)).map(|(a, b)| a - b).collect();
        let means: Vec<f64> =
            noise.chunks_exact(17).map(|m| m.iter().sum::<f64>() / 17.0).collect();
        let sharper = shown.with_residuals(&means, 17.0 * 7e-3, 17);
        let sharper = sharper.some_colour(17).expect("colour");
        let ratio = sharper.mean_variance(17) / truth.mean_variance(17);
        assert!((0.65..1.35).contains(&ratio), "{correlation}: {ratio}");
        mean += ratio / 29.0;
    }
    assert!((mean - 1.0).abs() < 0.06, "{mean}");
    for seed in 10..20 {
        assert_eq!(Spectrum::of_record(&decay(0.05, 0.0, seed), 7e-3).colour(17), None);
    }
}
/// A few cycles, whose harmonics leave no room in the record's own spectrum.
#[test]
fn coloured_noise_in_short_residuals_is_believed_and_white_noise_is_not() {
    for seed in 0..20 {
        let noise = |correlation: f64| -> Vec<f64> {
            let swing = decay(0.0, 0.0, seed);
            let of = |(y, swing): (&f64, &f64)| y - swing;
            decay(0.05, correlation, seed).iter().zip(&swing).map(of).take(1400).collect()
        };
        let (correlation, turn) = (0.8, 0.1);
        let truth = coloured(correlation);
        let believed = |y: &[f64]| Spectrum::default().with_residuals(y, turn, 1).colour(1);
        let found = believed(&noise(correlation)).expect("colour");
        let ratio = (found.mean_variance(1) / truth.mean_variance(1)).sqrt();
        assert!((0.6..1.5).contains(&ratio), "{seed}: {ratio}");
        assert_eq!(believed(&noise(0.0)), None);
    }
}
