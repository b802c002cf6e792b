//! White and coloured noise of a sensor, separated in the spectra of a record and of what a model leaves of
//! it.
//!
//! Between the harmonics of the oscillation a record holds nothing but noise, and the response to random
//! forcing. The means of narrow bands there, lines left out, are fitted by a white level, a lag-one
//! (first-order autoregressive) spectrum and that response. The window is Kaiser's with side lobes 170 dB
//! down, below any swing over its noise.

use std::f64::consts::{LN_2, PI, TAU};

/// How a periodogram is taken.
pub(crate) struct Window {
    /// Shape of Kaiser's window.
    kaiser: f64,
    /// Half the width of its main lobe, in bins.
    pub(super) lobe_bins: f64,
    /// Neighbouring bins that say the same through it.
    shared_bins: f64,
    /// How far the natural frequency may wander, as a share; about the frequency itself three times as far.
    wander: f64,
}

impl Window {
    /// What each of `count` samples counts.
    pub(super) fn weights(&self, count: usize) -> impl Iterator<Item = f64> + '_ {
        (0..count).map(move |k| {
            let x = 2.0 * (k as f64 + 0.5) / count as f64 - 1.0;
            bessel(self.kaiser * (1.0 - x * x).sqrt())
        })
    }
}

/// Side lobes 170 dB down, below any oscillation over its noise.
pub(super) const OF_RECORD: Window =
    Window { kaiser: 18.0, lobe_bins: 6.5, shared_bins: 2.4, wander: 0.05 };
/// For what a good model leaves.
pub(crate) const OF_RESIDUALS: Window =
    Window { kaiser: 6.0, lobe_bins: 2.2, shared_bins: 1.5, wander: 0.02 };
/// Deviations beyond this many of their standard deviations count ever less: a moment with corners has lines
/// far beyond the harmonics that are left out.
const ROBUST: f64 = 1.5;

/// Noise of single samples: white, and correlated by `correlation` from one to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Colour {
    pub(crate) white_variance: f64,
    pub(crate) coloured_variance: f64,
    pub(crate) correlation: f64,
    /// Standard uncertainty of the noise of a mean, over it.
    pub(crate) u_share: f64,
}

impl Colour {
    /// Standard deviation of a sample.
    pub(super) fn sample_rad(&self) -> f64 {
        (self.white_variance + self.coloured_variance).sqrt()
    }

    /// Variance of the mean of `block` neighbours.
    pub(crate) fn mean_variance(&self, block: usize) -> f64 {
        let b = block as f64;
        let pairs: f64 = (1..block).map(|k| (b - k as f64) * self.correlation.powi(k as i32)).sum();
        self.white_variance / b + self.coloured_variance * (b + 2.0 * pairs) / (b * b)
    }

    /// The same made as small as `most`, the mean square of residuals (means of `block`) that hold it.
    pub(crate) fn at_most(self, most: f64, block: usize) -> Self {
        let share = (most / self.mean_variance(block)).min(1.0);
        let [white_variance, coloured_variance] =
            [self.white_variance, self.coloured_variance].map(|variance| share * variance);
        Self { white_variance, coloured_variance, ..self }
    }

    /// Covariance of neighbouring means of `block`; each further one falls by correlation^block.
    pub(crate) fn next_covariance(&self, block: usize) -> f64 {
        let (b, c) = (block as f64, self.correlation);
        self.coloured_variance * c * ((1.0 - c.powi(block as i32)) / (b * (1.0 - c))).powi(2)
    }
}

/// Mean of the spectrum over neighbouring frequencies.
#[derive(Clone, Debug)]
struct Band {
    /// Some of the frequencies, rad/mean: the spectrum may fall across a band.
    frequencies: Vec<f64>,
    /// The oscillation's, rad/mean.
    turn: f64,
    /// Samples in a mean.
    block: usize,
    level: f64,
    /// Inverse variance of its logarithm.
    weight: f64,
}

impl Band {
    /// Twice the log likelihood that it lacks where the level is `model`: of a mean of exponential values.
    fn deviance(&self, model: f64) -> f64 {
        let x = self.level / model;
        2.0 * self.weight * (x - 1.0 - x.ln())
    }

    /// Its level where a sample's white or coloured noise has unit variance, or a moment is random.
    fn shapes(&self, correlation: Option<f64>) -> [f64; 3] {
        let mean = |of: &dyn Fn(f64) -> f64| {
            self.frequencies.iter().map(|w| of(*w)).sum::<f64>() / self.frequencies.len() as f64
        };
        let coloured = |w: f64| correlation.map_or(0.0, |c| mean_spectrum(c, self.block, w));
        let forced = |w: f64| {
            let x = (w / self.turn).powi(2);
            1.0 / ((1.0 - x).powi(2) + 0.01 * x)
        };
        let block = self.block as f64;
        [1.0 / block, mean(&coloured), mean(&forced) / block]
    }
}

/// What a record holds between the harmonics of its oscillation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spectrum {
    bands: Vec<Band>,
}

impl Spectrum {
    /// Of `samples`, evenly spaced, `turn` the oscillation's phase from one to the next (rad).
    pub(crate) fn of_record(samples: &[f64], turn: f64) -> Self {
        Self { bands: bands(samples, turn, 1, &OF_RECORD) }
    }

    /// With the `residuals` of a good model, means of `block` samples, up to where they reach: they show the
    /// noise down to frequencies that the oscillation hides in the record. `turn` is from one to the next.
    pub(crate) fn with_residuals(&self, residuals: &[f64], turn: f64, block: usize) -> Self {
        let mut bands = bands(residuals, turn, block, &OF_RESIDUALS);
        let up_to = bands.last().map_or(0.0, |b| b.frequencies[b.frequencies.len() - 1] / b.turn);
        bands.extend(self.bands.iter().filter(|b| b.frequencies[0] / b.turn > up_to).cloned());
        Self { bands }
    }

    /// The coloured noise in it; none where white noise (and random forcing) accounts for it. Its uncertainty
    /// is that of means of `block` samples.
    pub(crate) fn colour(&self, block: usize) -> Option<Colour> {
        let (cost, colour) = self.likeliest(block)?;
        // Twice a log likelihood: white noise beside a swing reaches it in one of 1500 records.
        (fitted(&self.bands, None).0 - cost > 10.0).then_some(colour)
    }

    /// The same where it is known that there is some.
    pub(crate) fn some_colour(&self, block: usize) -> Option<Colour> {
        Some(self.likeliest(block)?.1)
    }

    /// The correlation that fits best, with its misfit.
    fn likeliest(&self, block: usize) -> Option<(f64, Colour)> {
        if self.bands.len() < 6 {
            return None;
        }
        // Even in the logarithm of the correlation's time. Below 0.15 it is as good as white; above 0.97 it
        // is a drift.
        let (from, to) = (-1.0 / f64::ln(0.15), -1.0 / f64::ln(0.97));
        let tried = (0..36u8).map(|i| {
            let share = f64::from(i) / 35.0;
            let correlation = (-1.0 / (from * (to / from).powf(share))).exp();
            let (cost, [white_variance, coloured_variance, _]) =
                fitted(&self.bands, Some(correlation));
            (cost, Colour { white_variance, coloured_variance, correlation, u_share: 0.0 })
        });
        let tried: Vec<(f64, Colour)> = tried.collect();
        let (least, mut colour) = *tried.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        // What the correlation leaves open, and what a level does whose shape is known.
        let open = tried.iter().fold((0.0, 0.0), |(sum, squares), (cost, other)| {
            let chance = (0.5 * (least - cost)).exp();
            let off = (other.mean_variance(block) / colour.mean_variance(block)).ln();
            (sum + chance, squares + chance * off * off)
        });
        let level = self.bands.iter().map(|b| b.weight).sum::<f64>().recip();
        colour.u_share = 0.5 * (open.1 / open.0 + level).sqrt();
        Some((least, colour))
    }
}

/// Spectrum, at `frequency` rad/mean, of means of `block` samples with unit variance and the correlation `c`.
fn mean_spectrum(c: f64, block: usize, frequency: f64) -> f64 {
    let unit = Colour { white_variance: 0.0, coloured_variance: 1.0, correlation: c, u_share: 0.0 };
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
    let weighted = |(y, w): (&f64, f64)| {
        power += w * w;
        w * (y - middle)
    };
    let windowed = samples.iter().zip(window.weights(n)).map(weighted).collect();
    crate::spectrum::power(windowed).into_iter().map(|p| p / power).collect()
}

/// Levels of the periodogram of means of `block` samples, scaled so that white noise shows its variance.
fn bands(samples: &[f64], turn: f64, block: usize, window: &Window) -> Vec<Band> {
    let n = samples.len();
    if n < 256 {
        return Vec::new();
    }
    let power = periodogram(samples, window);
    let bin = TAU / n as f64;
    let lobe = window.lobe_bins * bin;
    let clear = |w: f64| {
        w > lobe + window.wander * turn
            && (1..=8).all(|k| {
                let wander = window.wander * turn * if k < 3 { 3.0 } else { k as f64 };
                (w - k as f64 * turn).abs() > lobe + wander
            })
    };
    let levels: Vec<(f64, f64)> =
        (1..n / 2).map(|k| (k as f64 * bin, power[k])).filter(|(w, _)| clear(*w)).collect();
    let mut out = Vec::new();
    let Some((first, _)) = levels.first() else { return out };
    // Sixty bands at most, of 24 bins at least, whose model is evaluated at nine frequencies.
    let ratio = (PI / first).powf(1.0 / 60.0);
    let mut from = 0;
    while from < levels.len() {
        let edge = levels[from].0 * ratio;
        let to = levels.partition_point(|(w, _)| *w < edge).max(from + 24);
        if to > levels.len() {
            break;
        }
        let part: Vec<f64> = levels[from..to].iter().map(|l| l.1).collect();
        let count = part.len();
        let level = clipped_mean(part);
        if level > 0.0 {
            let of = |k: usize| levels[from + (count - 1) * k / 8].0;
            let frequencies = (0..=8).map(of).collect();
            let weight = count as f64 / window.shared_bins;
            out.push(Band { frequencies, turn, block, level, weight });
        }
        from = to;
    }
    out
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
fn bessel(x: f64) -> f64 {
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
fn fitted(bands: &[Band], correlation: Option<f64>) -> (f64, [f64; 3]) {
    let shapes: Vec<[f64; 3]> = bands.iter().map(|band| band.shapes(correlation)).collect();
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
        let levels = levels_of(bands, &shapes, parts);
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
            ROBUST * ROBUST * (1.0 + b.deviance(model(s, levels)) / (ROBUST * ROBUST)).ln()
        })
        .sum()
}

/// The likeliest levels of the `parts`, by Fisher's scoring of their logarithms: none is negative, and what
/// is not there goes to nothing.
fn levels_of(bands: &[Band], shapes: &[[f64; 3]], parts: [bool; 3]) -> [f64; 3] {
    let alone = |i: usize| {
        let mut ratios: Vec<f64> = bands.iter().zip(shapes).map(|(b, s)| b.level / s[i]).collect();
        crate::statistics::median(&mut ratios)
    };
    let mut levels = [0, 1, 2].map(|i| if parts[i] { alone(i) } else { 0.0 });
    for _ in 0..30 {
        let mut information = nalgebra::Matrix3::<f64>::identity() * 1e-3;
        let mut score = nalgebra::Vector3::<f64>::zeros();
        for (b, s) in bands.iter().zip(shapes) {
            let m = model(s, &levels);
            let weight = b.weight / (1.0 + b.deviance(m) / (ROBUST * ROBUST));
            let share = nalgebra::Vector3::from_fn(|i, _| s[i] * levels[i] / m);
            information += weight * share * share.transpose();
            score += weight * (b.level / m - 1.0) * share;
        }
        let Some(step) = information.lu().solve(&score) else { break };
        for i in 0..3 {
            levels[i] *= step[i].clamp(-1.0, 1.0).exp();
        }
        if step.amax() < 1e-3 {
            break;
        }
    }
    levels
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
