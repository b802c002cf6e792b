//! Effects at strengths in units of the least that a likelihood-ratio test which knew the effect could
//! detect.
//!
//! That unit: the strength at which chi^2 of the plain model, fitted again, less chi^2 of the model with the
//! effect is expected to be what chance exceeds once in a thousand. Such a test names the effect in half of
//! the records.

use crate::hidden::laws::{draw, Law};
use crate::hidden::{scaled, simulate, Plan, Planted, Setup};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::fit_plain;
use yawrig_core::fit::free_decay::FreeDecay;

/// Chi^2 of so many numbers that chance exceeds once in a thousand.
const CHANCE: [f64; 4] = [10.83, 13.82, 16.27, 18.47];
/// Residual over noise of the plain model at which the size of the misfit is measured.
const MEASURED_AT: f64 = 4.0;

/// The one effect of `plan` on its rig, under a sensor whose noise is white, at each of `strengths`.
pub fn ladder(plan: &Plan, strengths: &[f64]) -> Vec<Planted> {
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    loop {
        let mut setup = Setup::draw(&mut rng);
        setup.lag_one = 0.0;
        let law =
            Law::Known(plan.effects[0].clone(), draw(plan.effects[0].clone(), &setup, &mut rng));
        let noise_seed = rng.random_range(0..u64::MAX);
        let Some(mut law) = scaled(&setup, law, MEASURED_AT, noise_seed) else { continue };
        let planted = simulate(&setup, std::slice::from_ref(&law), noise_seed);
        let Ok(decay) = FreeDecay::from_record(&planted.record) else { continue };
        let Some(least) = least(&setup, &law, &planted, &decay, noise_seed) else { continue };
        law.weaken(least);
        let at = |strength: &f64| {
            let mut law = law.clone();
            law.weaken(*strength);
            simulate(&setup, &[law], noise_seed)
        };
        return strengths.iter().map(at).collect();
    }
}

/// The unit, as a share of what `law` moves.
fn least(
    setup: &Setup,
    law: &Law,
    planted: &Planted,
    decay: &FreeDecay,
    noise_seed: u64,
) -> Option<f64> {
    let (effect, numbers) = law.known().expect("an effect of the library");
    let expected = CHANCE[numbers.len() - 1] - numbers.len() as f64;
    if effect == Effect::Buffeting {
        return random(setup, law, noise_seed, expected);
    }
    let plain = fit_plain(decay, false, decay.yaw_rad.len());
    let chi_squared = plain.count as f64 * ((plain.rms_rad() / planted.noise_rad).powi(2) - 1.0);
    Some((expected / chi_squared).sqrt())
}

/// Share of what the random forcing of `law` moves at which twice the log likelihood with it is so much
/// larger than without, the plain model fitted to that record.
fn random(setup: &Setup, law: &Law, noise_seed: u64, expected: f64) -> Option<f64> {
    let (mut low, mut high) = (1e-3_f64.ln(), 0.0);
    for _ in 0..9 {
        let middle: f64 = 0.5 * (low + high);
        let mut law = law.clone();
        law.weaken(middle.exp());
        let planted = simulate(setup, std::slice::from_ref(&law), noise_seed);
        let decay = FreeDecay::from_record(&planted.record).ok()?;
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        let without = plain.sum_of_squares / planted.noise_rad.powi(2);
        let left: Vec<f64> = plain.residuals.iter().map(|r| r / planted.noise_rad).collect();
        let ratio = law.intensity() / planted.noise_rad.powi(2);
        let with = minus_twice_log_likelihood(setup, decay.grid.step_s, ratio, &left);
        if without - with > expected {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(high.exp())
}

/// Of readings `y` with white noise of variance one, the response to random forcing of this intensity from
/// rest: by a Kalman filter, small steps between the readings.
fn minus_twice_log_likelihood(setup: &Setup, step_s: f64, intensity: f64, y: &[f64]) -> f64 {
    const PARTS: usize = 8;
    let h = step_s / PARTS as f64;
    let f = nalgebra::Matrix2::new(
        1.0,
        h,
        -setup.wn.powi(2) * h,
        1.0 - 2.0 * setup.zeta * setup.wn * h - (setup.wn * h).powi(2),
    );
    let forcing = nalgebra::Matrix2::new(0.0, 0.0, 0.0, intensity * h);
    let mut x = nalgebra::Vector2::zeros();
    let mut p = nalgebra::Matrix2::zeros();
    let mut out = 0.0;
    for y in y {
        let variance: f64 = p[(0, 0)] + 1.0;
        let innovation = y - x[0];
        out += innovation * innovation / variance + variance.ln();
        let gain = p.column(0) / variance;
        x += gain * innovation;
        p -= gain * p.row(0);
        for _ in 0..PARTS {
            x = f * x;
            p = f * p * f.transpose() + forcing;
        }
    }
    out
}
