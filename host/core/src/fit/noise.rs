//! White and coloured noise of a sensor, separated in the record's own spectrum.
//!
//! Between the harmonics of the oscillation a record holds nothing but noise, and the response to random
//! forcing. The means of narrow bands there, lines left out, are fitted by a white level, a lag-one
//! (first-order autoregressive) spectrum and that response. The window is Kaiser's with side lobes 170 dB
//! down, below any swing over its noise.

use std::f64::consts::{LN_2, PI, TAU};

/// How a periodogram is taken.
pub(crate) struct Window {
    /// Shape of Kaiser's window.
    pub(super) kaiser: f64,
    /// Half the width of its main lobe, in bins.
    pub(super) lobe_bins: f64,
    /// Neighbouring bins that say the same through it.
    shared_bins: f64,
    /// How far the natural frequency may wander, as a share; about the frequency itself three times as far.
    wander: f64,
}

/// Side lobes 170 dB down, below any oscillation over its noise.
pub(super) const OF_RECORD: Window =
    Window { kaiser: 18.0, lobe_bins: 6.5, shared_bins: 2.4, wander: 0.05 };
/// For what a good model leaves.
pub(crate) const OF_RESIDUALS: Window =
    Window { kaiser: 6.0, lobe_bins: 2.2, shared_bins: 1.5, wander: 0.02 };
/// Bins in a band at least, and bands at most.
const LEAST_BINS: usize = 24;
const MOST_BANDS: usize = 60;
const FEWEST_BANDS: usize = 6;
/// Harmonics of the oscillation left out.
const HARMONICS: usize = 8;
/// Lag-one correlations between samples that are tried. Below it is as good as white; above it is a drift.
const CORRELATIONS: (f64, f64) = (0.15, 0.97);
const GRID: usize = 36;
/// Gain of the fit above which a part is believed: twice a log likelihood.
const PART_BELIEVED: f64 = 14.0;
/// Deviations beyond this many of their standard deviations count ever less.
const ROBUST: f64 = 3.0;

/// Noise of single samples: white, and correlated by `correlation` from one to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Colour {
    pub(crate) white_variance: f64,
    pub(crate) coloured_variance: f64,
    pub(crate) correlation: f64,
}

impl Colour {
    /// Variance of the mean of `block` neighbours.
    pub(crate) fn mean_variance(&self, block: usize) -> f64 {
        let b = block as f64;
        let pairs: f64 = (1..block).map(|k| (b - k as f64) * self.correlation.powi(k as i32)).sum();
        self.white_variance / b + self.coloured_variance * (b + 2.0 * pairs) / (b * b)
    }

    /// Covariance of neighbouring means of `block`; each further one falls by correlation^block.
    pub(crate) fn next_covariance(&self, block: usize) -> f64 {
        let (b, c) = (block as f64, self.correlation);
        self.coloured_variance * c * ((1.0 - c.powi(block as i32)) / (b * (1.0 - c))).powi(2)
    }
}

struct Band {
    /// rad/sample
    frequency: f64,
    level: f64,
    /// Inverse variance of its logarithm.
    weight: f64,
}

/// The coloured noise in `samples`, evenly spaced, `turn` the oscillation's phase from one to the next (rad);
/// none where white noise (and random forcing) accounts for the spectrum.
pub(crate) fn colour(samples: &[f64], turn: f64) -> Option<Colour> {
    believed(&bands(samples, turn, &OF_RECORD)?, turn, 1)
}

fn believed(bands: &[Band], turn: f64, block: usize) -> Option<Colour> {
    let (white, _) = fitted(bands, turn, block, None);
    let (coloured, colour) = coloured(bands, turn, block)?;
    (white - coloured > PART_BELIEVED).then_some(colour)
}

/// The same in the `residuals` of a model, means of `block` samples, where the record itself shows none: a
/// short one has no room between the harmonics.
pub(crate) fn believed_of_residuals(residuals: &[f64], turn: f64, block: usize) -> Option<Colour> {
    believed(&bands(residuals, turn, &OF_RESIDUALS)?, turn, block)
}

/// The same from the `residuals` of a good model, means of `block` samples; it shows the noise down to
/// frequencies that the oscillation hides in the record.
pub(crate) fn colour_of_residuals(residuals: &[f64], turn: f64, block: usize) -> Option<Colour> {
    let bands = bands(residuals, turn, &OF_RESIDUALS)?;
    Some(coloured(&bands, turn, block)?.1)
}

/// The correlation that fits best, with its misfit.
fn coloured(bands: &[Band], turn: f64, block: usize) -> Option<(f64, Colour)> {
    // Even in the logarithm of the correlation's time.
    let (from, to) = (-1.0 / CORRELATIONS.0.ln(), -1.0 / CORRELATIONS.1.ln());
    let (correlation, (cost, [white_variance, coloured_variance, _])) = (0..GRID)
        .map(|i| {
            let share = i as f64 / (GRID - 1) as f64;
            let correlation = (-1.0 / (from * (to / from).powf(share))).exp();
            (correlation, fitted(bands, turn, block, Some(correlation)))
        })
        .min_by(|a, b| a.1 .0.total_cmp(&b.1 .0))?;
    Some((cost, Colour { white_variance, coloured_variance, correlation }))
}

/// Spectrum, at `frequency` rad/mean, of means of `block` samples with unit variance and the correlation `c`.
fn mean_spectrum(c: f64, block: usize, frequency: f64) -> f64 {
    let unit = Colour { white_variance: 0.0, coloured_variance: 1.0, correlation: c };
    let per_block = c.powi(block as i32);
    let next = unit.next_covariance(block);
    let (s, cos) = frequency.sin_cos();
    let below = (1.0 - per_block * cos).powi(2) + (per_block * s).powi(2);
    unit.mean_variance(block) + 2.0 * next * (cos - per_block) / below
}

/// Power of each bin through Kaiser's window, scaled so that white noise shows its variance.
pub(crate) fn periodogram(samples: &[f64], window: &Window) -> Vec<f64> {
    let n = samples.len();
    let middle = samples.iter().sum::<f64>() / n as f64;
    let mut power = 0.0;
    let mut input: Vec<f64> = samples
        .iter()
        .enumerate()
        .map(|(k, y)| {
            let x = 2.0 * (k as f64 + 0.5) / n as f64 - 1.0;
            let w = bessel(window.kaiser * (1.0 - x * x).sqrt());
            power += w * w;
            w * (y - middle)
        })
        .collect();
    let fft = realfft::RealFftPlanner::<f64>::new().plan_fft_forward(n);
    let mut spectrum = fft.make_output_vec();
    // Its only error is a buffer of another length.
    fft.process(&mut input, &mut spectrum).expect("buffers as made");
    spectrum.iter().map(|s| s.norm_sqr() / power).collect()
}

/// Levels of the periodogram, scaled so that white noise shows its variance.
fn bands(samples: &[f64], turn: f64, window: &Window) -> Option<Vec<Band>> {
    let n = samples.len();
    if n < 256 {
        return None;
    }
    let power = periodogram(samples, window);
    let bin = TAU / n as f64;
    let lobe = window.lobe_bins * bin;
    let clear = |w: f64| {
        w > lobe + window.wander * turn
            && (1..=HARMONICS).all(|k| {
                let wander = window.wander * turn * if k < 3 { 3.0 } else { k as f64 };
                (w - k as f64 * turn).abs() > lobe + wander
            })
    };
    let levels: Vec<(f64, f64)> =
        (1..n / 2).map(|k| (k as f64 * bin, power[k])).filter(|(w, _)| clear(*w)).collect();
    let first = levels.first()?.0;
    let ratio = (PI / first).powf(1.0 / MOST_BANDS as f64);
    let mut out = Vec::new();
    let mut from = 0;
    while from < levels.len() {
        let edge = levels[from].0 * ratio;
        let to = levels.partition_point(|(w, _)| *w < edge).max(from + LEAST_BINS);
        if to > levels.len() {
            break;
        }
        let part: Vec<f64> = levels[from..to].iter().map(|l| l.1).collect();
        let count = part.len();
        let level = clipped_mean(part);
        if level > 0.0 {
            let frequency = (levels[from].0 * levels[to - 1].0).sqrt();
            let weight = count as f64 / window.shared_bins;
            out.push(Band { frequency, level, weight });
        }
        from = to;
    }
    (out.len() >= FEWEST_BANDS).then_some(out)
}

/// Mean of exponentially distributed values, those beyond four times the mean left out: they belong to lines.
fn clipped_mean(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    let mut mean = *values.select_nth_unstable_by(middle, f64::total_cmp).1 / LN_2;
    // What an exponential distribution keeps below four times its mean averages less than its mean.
    let kept = 1.0 - 4.0 / (f64::exp(4.0) - 1.0);
    for _ in 0..4 {
        let (n, sum) = values
            .iter()
            .filter(|v| **v < 4.0 * mean)
            .fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
        mean = sum / f64::max(n, 1.0) / kept;
    }
    mean
}

/// Modified Bessel function of order zero, by its power series: `libm` has none.
pub(super) fn bessel(x: f64) -> f64 {
    let q = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..60 {
        term *= q / f64::from(k * k);
        sum += term;
        if term < 1e-12 * sum {
            break;
        }
    }
    sum
}

/// Misfit, and levels of the white, the coloured and the forced part, none negative.
fn fitted(bands: &[Band], turn: f64, block: usize, correlation: Option<f64>) -> (f64, [f64; 3]) {
    let shapes: Vec<[f64; 3]> = bands
        .iter()
        .map(|b| {
            let w = b.frequency;
            let coloured = correlation.map_or(0.0, |c| mean_spectrum(c, block, w));
            let x = (w / turn).powi(2);
            [1.0 / block as f64, coloured, 1.0 / ((1.0 - x).powi(2) + 0.01 * x)]
        })
        .collect();
    let mut logs: Vec<f64> = bands.iter().map(|b| b.level.ln()).collect();
    let middle = crate::statistics::median(&mut logs).exp();
    let mut best = (f64::INFINITY, [0.0; 3]);
    for parts in [
        [true, false, false],
        [true, true, false],
        [true, false, true],
        [true, true, true],
        [false, true, false],
        [false, true, true],
    ] {
        if parts[1] && correlation.is_none() {
            continue;
        }
        let mut levels = [middle * block as f64, 0.0, 0.0];
        for _ in 0..15 {
            let Some(next) = reweighted(bands, &shapes, &levels, parts) else { break };
            levels = next;
        }
        let parameters = parts.iter().filter(|p| **p).count() as f64;
        let cost = misfit(bands, &shapes, &levels) + 3.0 * parameters;
        if cost < best.0 {
            best = (cost, levels);
        }
    }
    best
}

fn model(shape: &[f64; 3], levels: &[f64; 3]) -> f64 {
    (0..3).map(|i| shape[i] * levels[i]).sum::<f64>().max(f64::MIN_POSITIVE)
}

fn misfit(bands: &[Band], shapes: &[[f64; 3]], levels: &[f64; 3]) -> f64 {
    bands
        .iter()
        .zip(shapes)
        .map(|(b, s)| {
            let r2 = b.weight * (b.level / model(s, levels)).ln().powi(2);
            ROBUST * ROBUST * (1.0 + r2 / (ROBUST * ROBUST)).ln()
        })
        .sum()
}

/// One weighted least-squares step to levels of the `parts`; none where a level would be negative.
fn reweighted(
    bands: &[Band],
    shapes: &[[f64; 3]],
    levels: &[f64; 3],
    parts: [bool; 3],
) -> Option<[f64; 3]> {
    let mut a = nalgebra::Matrix3::<f64>::zeros();
    let mut y = nalgebra::Vector3::<f64>::zeros();
    for (b, s) in bands.iter().zip(shapes) {
        let m = model(s, levels);
        let r = (b.level / m).ln();
        let weight = b.weight / (1.0 + b.weight * r * r / (ROBUST * ROBUST)) / (m * m);
        // The logarithm's tangent at the present model.
        let target = m * (1.0 + r.clamp(-2.0, 2.0));
        for i in 0..3 {
            for j in 0..3 {
                a[(i, j)] += weight * s[i] * s[j];
            }
            y[i] += weight * s[i] * target;
        }
    }
    for i in 0..3 {
        if !parts[i] {
            for j in 0..3 {
                a[(i, j)] = 0.0;
                a[(j, i)] = 0.0;
            }
            a[(i, i)] = 1.0;
            y[i] = 0.0;
        }
    }
    let x = a.lu().solve(&y)?;
    let ok = (0..3).all(|i| x[i].is_finite() && (!parts[i] || x[i] > 0.0));
    ok.then(|| [x[0], x[1], x[2]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

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
    fn coloured_noise_beside_a_swing_is_measured_and_white_noise_is_left_alone() {
        // The lowest frequencies, which the swing covers, weigh most in a mean: from the record its variance
        // is known to some 15 %, from residuals to some 10 % (29 seeds: 0.66-1.27 and 0.75-1.21 of the
        // truth).
        let mut mean = 0.0;
        for (seed, correlation) in (1..30).map(|k| (k, [0.5, 0.8, 0.95][k as usize % 3])) {
            let truth = Colour { white_variance: 0.0, coloured_variance: 0.05 * 0.05, correlation };
            let y = decay(0.05, correlation, seed);
            let found = colour(&y, 7e-3).expect("colour");
            let ratio = found.mean_variance(17) / truth.mean_variance(17);
            assert!((0.5..1.5).contains(&ratio), "{correlation}: {ratio}");
            let noise: Vec<f64> = y.iter().zip(decay(0.0, 0.0, 0)).map(|(a, b)| a - b).collect();
            let means: Vec<f64> =
                noise.chunks_exact(17).map(|m| m.iter().sum::<f64>() / 17.0).collect();
            let sharper = colour_of_residuals(&means, 17.0 * 7e-3, 17).expect("colour");
            let ratio = sharper.mean_variance(17) / truth.mean_variance(17);
            assert!((0.65..1.35).contains(&ratio), "{correlation}: {ratio}");
            mean += ratio / 29.0;
        }
        assert!((mean - 1.0).abs() < 0.06, "{mean}");
        for seed in 10..20 {
            assert_eq!(colour(&decay(0.05, 0.0, seed), 7e-3), None);
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
            let truth = Colour { white_variance: 0.0, coloured_variance: 0.05 * 0.05, correlation };
            let found = believed_of_residuals(&noise(correlation), turn, 1).expect("colour");
            let ratio = (found.mean_variance(1) / truth.mean_variance(1)).sqrt();
            assert!((0.6..1.5).contains(&ratio), "{seed}: {ratio}");
            assert_eq!(believed_of_residuals(&noise(0.0), turn, 1), None);
        }
    }
}
