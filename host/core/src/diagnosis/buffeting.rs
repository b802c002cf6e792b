//! Random forcing recognised: the likelihood of a Kalman filter with process noise against one without.
//!
//! State (b, r) of the plain model, driven by a white random moment of intensity q; means of its angle are
//! read with white noise. The likelihood is that of the innovations, the noise's variance that of the floor:
//! R. H. Jones, Technometrics 22 (1980). A deterministic effect that is missing also raises q; it is
//! recognised by forcing, frequency or damping that are not the same in every quarter of the record, by
//! innovations that are not white, know the state, or stand out.

use crate::bic;
use crate::diagnosis::likelihood::is_explained;
use crate::fit::fitting::{Fitted, Modal};
use crate::fit::free_decay::FreeDecay;
use crate::fit::structure::{WN, ZERO, ZETA};
use crate::motion::oscillator::Grid;
use crate::motion::random::Step;
use crate::quantity::Quantity;
use crate::spectrum::power;
use crate::statistics::of_chi_squared;

/// A free decay under random forcing.
#[derive(Clone, Debug)]
pub(crate) struct Buffeted {
    /// As all uncertainties of it from the curvature of the likelihood.
    pub(crate) modal: Modal,
    /// rad2/s3.
    pub(crate) intensity: Quantity,
    /// Intensity over the variance of the noise of one of the swing's means.
    pub(crate) ratio: f64,
    /// Minus twice the log likelihood, on the scale of n ln(residual sum of squares / n).
    pub(crate) deviance: f64,
    /// Rms of the innovations over their expected one at the noise floor: 1 if explained.
    pub(crate) over_noise: f64,
    /// Lag-one correlation of the innovations outside the range from zero to that of the noise.
    pub(crate) correlation_off: f64,
    /// What intensity, frequency and damping of each quarter's own would gain in deviance, in standard
    /// deviations.
    pub(crate) unsteadiness: f64,
    /// Largest innovation, in standard deviations.
    pub(crate) largest: f64,
    /// Strongest line in the innovations' spectrum, over its mean; ln(n/2) by chance.
    pub(crate) line: f64,
    /// Dependence of the innovations, or of their size, on the state, in standard deviations.
    pub(crate) state_dependence: f64,
}

/// Parts of a record that must agree.
const QUARTERS: usize = 4;
/// First steps in the logarithm of the intensity, the frequency and the damping ratio.
const FREE: [f64; 3] = [1.0, 1e-3, 3e-3];

struct Run {
    /// Minus twice the log likelihood but for a constant.
    deviance: f64,
    noise_variance: f64,
    innovations: Vec<f64>,
    /// The state predicted for each innovation.
    states: Vec<[f64; 2]>,
}

/// Filters `yaw` with the model, its noise of variance `known` or that which is likeliest; `ratio` is q over
/// the noise's variance.
fn filter(
    grid: &Grid,
    yaw: &[f64],
    [wn, zeta, ratio]: [f64; 3],
    known: Option<f64>,
) -> Option<Run> {
    let step = Step::new(grid.step_s, wn, zeta, ratio, grid.mean_width_s > 0.0)?;
    // Unknown at first: the first means fix it, and are left out of the likelihood.
    let (mut x, mut p) = ([yaw[0], 0.0], [1e6, 0.0, 1e6 * wn * wn]);
    let (mut sum, mut logs, mut n) = (0.0, 0.0, 0.0);
    // Of variances, none below one: a logarithm each would take as long as all the rest.
    let mut product: f64 = 1.0;
    let mut innovations = Vec::with_capacity(yaw.len());
    let mut states = Vec::with_capacity(yaw.len());
    for (k, &y) in yaw.iter().enumerate() {
        let (variance, gain, next) = step.filtered(p);
        let expected = step.expected(x);
        let innovation = y - expected;
        if k >= 4 {
            sum += innovation * innovation / variance;
            product *= variance;
            if product > 1e200 {
                logs += product.ln();
                product = 1.0;
            }
            n += 1.0;
            innovations.push(innovation / variance.sqrt());
            states.push([expected, x[1]]);
        }
        x = step.next(x, gain, innovation);
        p = next;
    }
    logs += product.ln();
    let noise_variance = sum / n;
    let level = known.unwrap_or(noise_variance);
    let deviance = n * level.ln() + sum / level - n + logs;
    deviance.is_finite().then_some(Run { deviance, noise_variance, innovations, states })
}

/// Cells of yaw angle on which innovations are averaged, for either direction of motion.
const CELLS: usize = 15;

/// How far the innovations' means over yaw angle and direction are from zero, in standard deviations: a
/// random moment does not know the state, a missing law does.
fn state_dependence(run: &Run) -> f64 {
    let largest = run.states.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x[0].abs()));
    let power = run.innovations.iter().map(|v| v * v).sum::<f64>();
    let variance = power / run.innovations.len() as f64;
    let mut cells = [(0.0, 0.0); 2 * CELLS];
    for (v, x) in run.innovations.iter().zip(&run.states) {
        let k = ((x[0] / largest + 1.0) * 0.5 * CELLS as f64) as usize;
        let cell = &mut cells[2 * k.min(CELLS - 1) + usize::from(x[1] > 0.0)];
        *cell = (cell.0 + 1.0, cell.1 + v);
    }
    let filled: Vec<f64> =
        cells.iter().filter(|c| c.0 >= 3.0).map(|c| c.1 * c.1 / c.0 / variance).collect();
    of_chi_squared(filled.iter().sum(), filled.len().max(1) as f64)
}

/// How far the innovations' squares go with the logarithm of the swing's energy, in standard deviations: a random
/// moment is as large when the model swings little.
fn size_dependence(run: &Run, wn: f64) -> f64 {
    let n = run.innovations.len() as f64;
    let variance = run.innovations.iter().map(|v| v * v).sum::<f64>() / n;
    let energy = |[b, r]: &[f64; 2]| (b * b + (r / wn).powi(2)).max(f64::MIN_POSITIVE).ln();
    let mean = run.states.iter().map(energy).sum::<f64>() / n;
    let both = run
        .innovations
        .iter()
        .zip(&run.states)
        .map(|(v, x)| (v * v / variance - 1.0, energy(x) - mean));
    let (with, spread) =
        both.fold((0.0, 0.0), |(with, spread), (v, e)| (with + v * e, spread + e * e));
    with / (2.0 * spread).sqrt()
}

/// Neighbouring means of the swing that the filter averages: it needs a dozen a cycle, and the longer a mean
/// the less its noise has to do with the next.
fn means_per_block(decay: &FreeDecay) -> usize {
    (decay.per_cycle() / 12.0).max(1.0) as usize
}

fn reduced(series: &[f64], means_per_block: usize) -> Vec<f64> {
    series
        .chunks_exact(means_per_block)
        .map(|c| c.iter().sum::<f64>() / means_per_block as f64)
        .collect()
}

/// What [`Buffeted::deviance`] is compared with: that of a definite model, all of whose residual is noise,
/// its numbers counted; and the count of residuals. The noise is what it leaves where it explains the record,
/// and else the floor.
pub(crate) fn definite_criterion(decay: &FreeDecay, model: &Fitted) -> (f64, f64) {
    let (sum, n) = left(decay, model);
    if is_explained(model, decay) {
        return (bic::of_squares(sum, n, model.parameters.len()), n);
    }
    let noise = decay.noise_of(means_per_block(decay)).0.powi(2);
    let deviance = n * noise.ln() + sum / noise - n;
    (bic::of_deviance(deviance, n, model.parameters.len()), n)
}

/// Sum of squares and count of the residuals that the filter would see.
fn left(decay: &FreeDecay, model: &Fitted) -> (f64, f64) {
    let left = reduced(&model.residuals, means_per_block(decay));
    (left.iter().map(|r| r * r).sum(), left.len() as f64)
}

/// Difference of BIC in favour of random forcing beside `plain`, as of any other effect: what `plain` leaves
/// counts as noise.
pub(crate) fn gain_over(decay: &FreeDecay, plain: &Fitted, b: &Buffeted) -> f64 {
    let ((sum, n), numbers) = (left(decay, plain), plain.parameters.len());
    bic::of_squares(sum, n, numbers) - bic::of_deviance(b.deviance, n, numbers + 1)
}

/// The likeliest random forcing of a free decay, from the plain model's fit.
pub(crate) fn fit(decay: &FreeDecay, plain: &Fitted) -> Option<Buffeted> {
    let zero = if plain.structure.zero_unknown { plain.parameters[ZERO] } else { 0.0 };
    let yaw: Vec<f64> = decay.yaw_rad.iter().map(|y| y - zero).collect();
    fit_series(decay, &yaw, plain, None)
}

/// The likeliest random forcing behind what `model` leaves of a motion with the angles and rates `states`.
pub(crate) fn fit_residuals(
    decay: &FreeDecay,
    model: &Fitted,
    states: &[[f64; 2]],
) -> Option<Buffeted> {
    let left: Vec<f64> = model.residuals.iter().map(|r| -r).collect();
    fit_series(decay, &left, model, Some(states))
}

fn fit_series(
    decay: &FreeDecay,
    yaw: &[f64],
    model: &Fitted,
    states: Option<&[[f64; 2]]>,
) -> Option<Buffeted> {
    // The filter reads the angle. Of a rate or an acceleration the noise floor holds part of the forcing.
    // In fewer than two cycles a quarter the forcing, three numbers and a random moment, follows any law.
    let is_long = decay.yaw_rad.len() as f64 >= 2.0 * QUARTERS as f64 * decay.per_cycle();
    if !decay.measurand.shows_rest() || !is_long {
        return None;
    }
    let means_per_block = means_per_block(decay);
    let yaw = &reduced(yaw, means_per_block)[..];
    let step_s = decay.grid.step_s * means_per_block as f64;
    let mean_width_s = if means_per_block > 1 { step_s } else { decay.grid.mean_width_s };
    let grid = Grid { step_s, count: yaw.len(), mean_width_s, ..decay.grid };
    let (noise, expected) = decay.noise_of(means_per_block);
    let noise = noise.powi(2);
    let wn = model.parameters[WN];
    let size = (wn.powi(3) * decay.amplitude_rad.powi(2) / noise).ln();
    let at = |p: &[f64; 3], yaw: &[f64]| {
        filter(&grid, yaw, [wn * (1.0 + p[1]), p[2], p[0].exp()], Some(noise))
    };
    let value = |p: &[f64; 3]| at(p, yaw).map_or(f64::INFINITY, |run| run.deviance);
    let mut p = [size - 12.0, 0.0, model.parameters[ZETA]];
    for guess in [-18.0, -15.0, -9.0, -6.0] {
        let other = [size + guess, p[1], p[2]];
        if value(&other) < value(&p) {
            p = other;
        }
    }
    // What a model leaves moves as the model does.
    let steps = if states.is_some() { [1.0, 0.0, 0.0] } else { FREE };
    let p = descend(value, p, steps);
    let free = if states.is_some() { descend(value, p, FREE) } else { p };
    let mut run = at(&p, yaw)?;
    if let Some(states) = states {
        let states: Vec<[f64; 2]> =
            states.chunks_exact(means_per_block).map(|c| c[means_per_block / 2]).collect();
        run.states = states[states.len() - run.innovations.len()..].to_vec();
    }
    let unsteadiness: f64 = yaw
        .chunks(yaw.len().div_ceil(QUARTERS))
        .map(|part| {
            let value = |q: &[f64; 3]| at(q, part).map_or(f64::INFINITY, |run| run.deviance);
            value(&free) - value(&descend(value, free, FREE))
        })
        .sum();
    let lag: f64 = run.innovations.windows(2).map(|w| w[0] * w[1]).sum();
    let power: f64 = run.innovations.iter().map(|v| v * v).sum();
    let deviation = (power / run.innovations.len() as f64).sqrt();
    let largest = run.innovations.iter().fold(0.0, |m: f64, v| m.max(v.abs())) / deviation;
    // Of ln q, wn over that of the model, and zeta.
    let [u_ln_q, u_wn, u_zeta] = [0, 1, 2].map(|i| {
        let h = [0.05, 1e-5, 1e-5][i];
        let moved = |s: f64| {
            let mut q = p;
            q[i] += s * h;
            value(&q)
        };
        let curvature = (moved(1.0) - 2.0 * value(&p) + moved(-1.0)) / (h * h);
        (2.0 / curvature.max(f64::MIN_POSITIVE)).sqrt()
    });
    let intensity = p[0].exp() * noise;
    Some(Buffeted {
        modal: Modal {
            natural_frequency_rad_s: Quantity::new(wn * (1.0 + p[1]), u_wn * wn),
            damping_ratio: Quantity::new(p[2], u_zeta),
        },
        intensity: Quantity::new(intensity, intensity * u_ln_q),
        ratio: p[0].exp() / means_per_block as f64,
        deviance: run.deviance,
        over_noise: (run.noise_variance / noise).sqrt(),
        correlation_off: lag / power - (lag / power).clamp(0.0, expected.max(0.0)),
        unsteadiness: of_chi_squared(unsteadiness, (QUARTERS * FREE.len()) as f64),
        largest,
        line: strongest_line(&run.innovations),
        state_dependence: state_dependence(&run).max(size_dependence(&run, wn)),
    })
}

/// Largest power in the spectrum over the mean one.
fn strongest_line(innovations: &[f64]) -> f64 {
    let power = &power(innovations.to_vec())[1..];
    let mean = power.iter().sum::<f64>() / power.len().max(1) as f64;
    power.iter().fold(0.0, |m: f64, p| m.max(*p)) / mean.max(f64::MIN_POSITIVE)
}

/// Pattern search along the coordinates: the likelihood is cheap and has one valley here.
fn descend(f: impl Fn(&[f64; 3]) -> f64, mut p: [f64; 3], mut step: [f64; 3]) -> [f64; 3] {
    let mut here = f(&p);
    for _ in 0..400 {
        let mut moved = false;
        for i in 0..3 {
            if step[i] == 0.0 {
                continue;
            }
            let mut gained = false;
            for sign in [1.0, -1.0] {
                let mut q = p;
                q[i] += sign * step[i];
                let there = f(&q);
                if there < here {
                    (p, here, gained) = (q, there, true);
                    break;
                }
            }
            step[i] *= if gained { 1.6 } else { 0.4 };
            moved |= gained;
        }
        if !moved && step[0] < 0.01 && step[1] < 1e-6 && step[2] < 1e-6 {
            break;
        }
    }
    p
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::forced::BEYOND_CHANCE;
    use crate::motion::random::Whitener;
    use nalgebra::{DMatrix, DVector, Matrix2};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// The joint density of all readings less that of the first four, from their covariance matrix.
    #[test]
    fn the_likelihood_is_that_of_the_readings_joint_normal_density() {
        let (wn, zeta, ratio, h) = (5.0, 0.03, 40.0, 0.05);
        let yaw: Vec<f64> = (0..14)
            .map(|k| 2.0 * (5.0 * h * f64::from(k)).cos() + 0.3 * f64::from(k * k % 5))
            .collect();
        let grid = Grid { start_s: 0.0, step_s: h, count: yaw.len(), mean_width_s: 0.0 };
        let run = filter(&grid, &yaw, [wn, zeta, ratio], None).unwrap();

        let Step { transition: f, added: q, .. } = Step::new(h, wn, zeta, ratio, false).unwrap();
        let f = Matrix2::new(f[0][0], f[0][1], f[1][0], f[1][1]);
        let q = Matrix2::new(q[0], q[1], q[1], q[2]);
        // Covariance of the states, step by step; of two readings, through the powers of F between them.
        let mut states: Vec<Matrix2<f64>> = Vec::new();
        let first = Matrix2::new(1e6, 0.0, 0.0, 1e6 * wn * wn);
        for _ in 0..yaw.len() {
            states.push(f * states.last().unwrap_or(&first) * f.transpose() + q);
        }
        let power = |n: usize| (0..n).fold(Matrix2::identity(), |p: Matrix2<f64>, _| f * p);
        let covariance = |n: usize| {
            DMatrix::from_fn(n, n, |i, j| {
                let (early, late) = (i.min(j), i.max(j));
                (power(late - early) * states[early])[(0, 0)] + f64::from(u8::from(i == j))
            })
        };
        let parts = |n: usize| {
            let expected = |k: usize| (power(k + 1) * nalgebra::Vector2::new(yaw[0], 0.0))[0];
            let e = DVector::from_fn(n, |k, _| yaw[k] - expected(k));
            let c = nalgebra::Cholesky::new(covariance(n)).unwrap();
            let logs = 2.0 * c.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
            (e.dot(&c.solve(&e)), logs)
        };
        let (all, first) = (parts(yaw.len()), parts(4));
        let n = (yaw.len() - 4) as f64;
        let variance = (all.0 - first.0) / n;
        let deviance = n * variance.ln() + all.1 - first.1;
        assert!((run.noise_variance / variance - 1.0).abs() < 1e-5);
        assert!((run.deviance - deviance).abs() < 1e-4, "{} {deviance}", run.deviance);
    }

    /// Innovations of a known start are those of the filter once it has forgotten its own.
    #[test]
    fn whitened_residuals_are_the_filters_innovations() {
        let (wn, zeta, ratio) = (5.0, 0.03, 4e3);
        let grid = Grid { start_s: 0.0, step_s: 0.05, count: 400, mean_width_s: 0.05 };
        let yaw: Vec<f64> = (0..400).map(|k| f64::from(k * k * 7 % 13) - 6.0).collect();
        let run = filter(&grid, &yaw, [wn, zeta, ratio], None).unwrap();
        let mut whitened = yaw.clone();
        Whitener::new(&grid, wn, zeta, ratio).unwrap().whiten(&mut whitened);
        for (a, b) in run.innovations.iter().rev().zip(whitened.iter().rev()).take(100) {
            assert!((a - b).abs() < 1e-6);
        }
    }

    /// Of 40 swings of 150 readings under a white moment the size's dependence scatters by one about zero; where
    /// the moment is in proportion to the swing, as what a model lacks is, it is 5.7 with a scatter of 1.0: beyond
    /// chance in all but some two.
    #[test]
    fn gusts_do_not_know_how_far_a_model_swings() {
        let (wn, zeta, h, fine) = (5.0, 0.02, 0.1, 400);
        let dependence = |seed: u64, goes_with_swing: f64| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let (mut b, mut r, dt) = (0.2, 0.0, h / f64::from(fine));
            let mut yaw = Vec::new();
            for k in 0..150 * fine {
                if k % fine == 0 {
                    yaw.push(b + 1e-5 * rng.sample::<f64, _>(StandardNormal));
                }
                let swing = 0.2 * (-zeta * wn * dt * f64::from(k)).exp();
                let size = 1e-2 * (swing / 0.05).powf(goes_with_swing);
                r += dt * (-wn * wn * b - 2.0 * zeta * wn * r)
                    + size * dt.sqrt() * rng.sample::<f64, _>(StandardNormal);
                b += dt * r;
            }
            let grid = Grid { start_s: 0.0, step_s: h, count: 150, mean_width_s: 0.0 };
            let run = filter(&grid, &yaw, [wn, zeta, 1e6], None).unwrap();
            size_dependence(&run, wn)
        };
        let all = |goes: f64| (0..40).map(|seed| dependence(seed, goes)).collect::<Vec<_>>();
        let gusts = all(0.0);
        let scatter = (gusts.iter().map(|z| z * z).sum::<f64>() / 40.0).sqrt();
        assert!((0.6..1.4).contains(&scatter), "{scatter}");
        assert!(gusts.iter().all(|z| *z < BEYOND_CHANCE), "{gusts:?}");
        let law = all(1.0);
        assert!(law.iter().filter(|z| **z > BEYOND_CHANCE).count() >= 35, "{law:?}");
    }
}
