//! Standard uncertainties that hold for coloured residuals, and the Cramer-Rao bound beside them.
//!
//! The estimator looks at the record through J, whose columns are narrow-band about the damped frequency w.
//! Of the residual's spectrum only the density there matters: J'RJ = S(w) J'J, so the white-noise covariance
//! s^2 (J'J)^-1 becomes S(w) (J'J)^-1. S(w) is the mean periodogram of the residual over the bins about w,
//! less the two complex bins' worth that the fit itself has taken out.

use super::damped_sinusoid::{DampedSinusoid, Mode};
use super::least_squares::ModeFit;
use super::samples::Stretch;
use crate::discrepancy::{self, Discrepancy, Left, Observed};
use crate::record::Derivative;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Bins on either side of the damped frequency over which the residual's spectrum is averaged.
const HALF_WIDTH_BINS: usize = 12;
/// Fewest bins on either side: with three cycles nothing narrower holds enough.
const MIN_HALF_WIDTH: usize = 3;
/// Means a cycle on which it is seen what a mode lacks, and the step by which a law is tried there.
const MEANS_PER_CYCLE: f64 = 50.0;
/// Times the frequency of the mode, between which noise is what is left: at 2.5 times, a random moment moves the
/// rig by (1 - 2.5^2)^-2, a thirtieth, of what it does far below the mode.
const ABOVE: [f64; 2] = [2.5, 7.5];
/// Bins that tell its density to an eighth; up to twice as many are taken.
const MAX_BINS: usize = 64;
/// Least noise, as a share of the amplitude: what rounding leaves.
const MIN_NOISE: f64 = 1e-9;
/// Complex bins that fitting amplitude, phase, wn and zeta takes out of the residual.
const ABSORBED: f64 = 2.0;

/// Standard uncertainties (k = 1) of one fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    pub(crate) natural_frequency_rad_s: f64,
    pub(crate) damping_ratio: f64,
    /// What an unbiased estimate could reach at best if the residual were white noise.
    pub(crate) bound: Bound,
    /// What of both is for a law that one mode lacks.
    pub(crate) lacking: Lacking,
    /// Whether something of both is for what shakes a rig.
    pub(crate) is_shaken: bool,
    /// S(w) over the residual's variance: 1 for white noise, (1 + r)/(1 - r) at low frequency for lag-one
    /// correlation r.
    pub(crate) spectral_ratio: f64,
}

/// What of the standard uncertainties of wn and zeta is for a law that one mode lacks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lacking {
    /// Of wn.
    pub natural_frequency_rad_s: f64,
    /// Of zeta.
    pub damping_ratio: f64,
}

/// Cramer-Rao bound on the standard deviations of wn and zeta.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    /// Least standard deviation of wn.
    pub natural_frequency_rad_s: f64,
    /// Least standard deviation of zeta.
    pub damping_ratio: f64,
}

impl ModeFit {
    /// Standard uncertainties of wn and zeta, from the residual as it is, what is recorded being of this
    /// `derivative`.
    pub fn uncertainty(
        &self,
        stretch: &Stretch<'_>,
        derivative: Derivative,
    ) -> Option<Uncertainty> {
        let residuals = DampedSinusoid { stretch: *stretch }.residuals_deg(&self.mode);
        let noise = of(self, stretch, &residuals)?;
        let least = MIN_NOISE * self.mode.amplitude_deg(stretch.start_s());
        let variance = self.fit.variance();
        let beside = density_above(stretch, &residuals, self.mode.damped_frequency_rad_s);
        let floor = beside.unwrap_or(variance).sqrt().max(least);
        let held = noise.spectral_ratio * variance / (floor * floor);
        let Some(found) = discrepancy(&self.mode, stretch, derivative, &residuals, floor, held)
        else {
            return Some(noise);
        };
        let all = modal_deviations(&self.mode, found.covariance());
        let more = |all: f64, noise: f64| match found.lacks_law() {
            true => (all * all - noise * noise).max(0.0).sqrt(),
            false => 0.0,
        };
        let natural_frequency_rad_s =
            all.natural_frequency_rad_s.max(noise.natural_frequency_rad_s);
        let damping_ratio = all.damping_ratio.max(noise.damping_ratio);
        Some(Uncertainty {
            natural_frequency_rad_s,
            damping_ratio,
            lacking: Lacking {
                natural_frequency_rad_s: more(
                    natural_frequency_rad_s,
                    noise.natural_frequency_rad_s,
                ),
                damping_ratio: more(damping_ratio, noise.damping_ratio),
            },
            is_shaken: found.is_shaken(),
            ..noise
        })
    }
}

/// What one mode lacks, as large as the residuals (record - mode) show it. `None` where they show nothing.
fn discrepancy(
    mode: &Mode,
    stretch: &Stretch<'_>,
    derivative: Derivative,
    residuals_deg: &[f64],
    noise_deg: f64,
    held: f64,
) -> Option<Discrepancy> {
    let per_cycle = TAU / mode.damped_frequency_rad_s / stretch.step_s;
    let block = (per_cycle / MEANS_PER_CYCLE).floor().max(1.0);
    let step_s = block * stretch.step_s;
    let count = (stretch.duration_s() / step_s) as usize;
    let (mut sums, mut seen) = (vec![0.0; count], vec![0.0f64; count]);
    for (k, residual_deg) in residuals_deg.iter().enumerate().filter(|(k, _)| !stretch.excluded[*k])
    {
        let bin = ((stretch.time_s[k] - stretch.start_s()) / step_s + 1e-6) as usize;
        if bin < count {
            sums[bin] += residual_deg;
            seen[bin] += 1.0;
        }
    }
    // Of the mean of a block.
    let noise_deg = noise_deg / block.sqrt();
    let start_s = stretch.start_s() + 0.5 * (step_s - stretch.step_s);
    let [a, b, c, s, w] = mode.parameters_at(start_s);
    let mut columns = vec![vec![0.0; count]; 5];
    let (mut readings, mut residuals) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for k in 0..count {
        let t = k as f64 * step_s;
        let (e, (sin, cos)) = ((-s * t).exp(), (w * t).sin_cos());
        let (u, v) = (e * cos, e * sin);
        let slopes = [u, v, 1.0, -t * (a * u + b * v), t * (b * u - a * v)];
        columns.iter_mut().zip(slopes).for_each(|(column, slope)| column[k] = slope / noise_deg);
        // Where no sample counts it is as the mode says.
        let off = sums[k] / seen[k].max(1.0) / noise_deg;
        residuals.push(-off);
        readings.push((a * u + b * v + c) / noise_deg + off);
    }
    let observed = Observed {
        readings,
        residuals,
        places: (0..5).collect(),
        columns,
        phase_rad: (0..count).map(|k| w * k as f64 * step_s).collect(),
        unit_rad: derivative.of_motion(noise_deg.to_radians(), mode.natural_frequency_rad_s()),
    };
    let left = if observed.is_noise() { Left::Noise } else { Left::Unknown };
    discrepancy::of(&[observed], 5, left, held)
}

/// From a fit and its residuals (record - model, at every sample of the stretch).
pub(crate) fn of(
    found: &ModeFit,
    stretch: &Stretch<'_>,
    residuals_deg: &[f64],
) -> Option<Uncertainty> {
    let bound = white(found)?;
    let frequency = found.mode.damped_frequency_rad_s;
    let ratio = spectral_density(stretch, residuals_deg, frequency) / found.fit.variance();
    // A fit of noise-free data leaves no residual to speak of.
    let ratio = if ratio.is_finite() { ratio } else { 1.0 };
    Some(Uncertainty {
        natural_frequency_rad_s: bound.natural_frequency_rad_s * ratio.sqrt(),
        damping_ratio: bound.damping_ratio * ratio.sqrt(),
        bound,
        lacking: Lacking::default(),
        is_shaken: false,
        spectral_ratio: ratio,
    })
}

/// What the covariance of the fit says by itself: standard deviations for a white residual.
pub(crate) fn white(found: &ModeFit) -> Option<Bound> {
    Some(modal_deviations(&found.mode, found.fit.covariance.as_ref()?))
}

/// Standard deviation of the mode's mid-line, deg, for a white residual.
pub(crate) fn white_midline_deg(found: &ModeFit) -> Option<f64> {
    Some(found.fit.covariance.as_ref()?[(2, 2)].max(0.0).sqrt())
}

/// Cramer-Rao bound for one known mode in white noise of `noise_rms_deg`: sigma^2 (J'J)^-1 over the samples.
pub fn cramer_rao(mode: &Mode, stretch: &Stretch<'_>, noise_rms_deg: f64) -> Option<Bound> {
    use crate::solver::{Normal, Problem};
    let mut normal = Normal::new(5);
    DampedSinusoid { stretch: *stretch }
        .evaluate(&mode.parameters_at(stretch.start_s()), &mut normal);
    let inverse = normal.matrix().try_inverse()?;
    Some(modal_deviations(mode, &(inverse * noise_rms_deg.powi(2))))
}

/// Standard deviations of wn and zeta from the covariance of the five parameters.
fn modal_deviations(mode: &Mode, covariance: &DMatrix<f64>) -> Bound {
    let c = covariance.fixed_view::<2, 2>(3, 3);
    let deviation = |row: [f64; 2]| {
        let variance: f64 =
            (0..2).flat_map(|i| (0..2).map(move |j| row[i] * row[j] * c[(i, j)])).sum();
        variance.max(0.0).sqrt()
    };
    let [wn, zeta] = mode.modal_jacobian();
    Bound { natural_frequency_rad_s: deviation(wn), damping_ratio: deviation(zeta) }
}

/// Power spectral density of the residual where neither the motion nor what a model of it lacks has much: well
/// above the mode. Noise has the same about the mode. `None` where the samples are
/// not dense enough.
fn density_above(
    stretch: &Stretch<'_>,
    residuals_deg: &[f64],
    frequency_rad_s: f64,
) -> Option<f64> {
    let duration = stretch.duration_s();
    let bin = |times: f64| (times * frequency_rad_s * duration / TAU).ceil() as usize;
    let highest = (0.45 * duration / stretch.step_s) as usize;
    let range = bin(ABOVE[0])..=bin(ABOVE[1]).min(highest);
    let step = (range.clone().count() / MAX_BINS).max(1);
    let bins: Vec<usize> = range.step_by(step).collect();
    (bins.len() > MIN_HALF_WIDTH).then(|| power(stretch, residuals_deg, &bins) / bins.len() as f64)
}

/// Power spectral density of the residual about `frequency_rad_s`, scaled so that white noise of variance v
/// gives v.
pub(super) fn spectral_density(
    stretch: &Stretch<'_>,
    residuals_deg: &[f64],
    frequency_rad_s: f64,
) -> f64 {
    let duration = stretch.duration_s();
    let centre = (frequency_rad_s * duration / TAU).round().max(1.0) as usize;
    let half = (centre / 2).clamp(MIN_HALF_WIDTH, HALF_WIDTH_BINS);
    let highest = (0.45 * duration / stretch.step_s) as usize;
    let bins: Vec<usize> =
        (centre.saturating_sub(half).max(1)..=(centre + half).min(highest)).collect();
    if bins.len() < 4 {
        return f64::NAN;
    }
    power(stretch, residuals_deg, &bins) / (bins.len() as f64 - ABSORBED)
}

/// Sum of the residual's periodogram over `bins` (rising multiples of one over the duration), each of which
/// is v for white noise of variance v.
pub(super) fn power(stretch: &Stretch<'_>, residuals_deg: &[f64], bins: &[usize]) -> f64 {
    let duration = stretch.duration_s();
    // The transform takes sums over a twentieth of the shortest period: it needs no finer time.
    let highest = *bins.last().expect("a bin") as f64;
    let width = (duration / highest / stretch.step_s / 20.0).floor().max(1.0) * stretch.step_s;
    let mut sums = vec![0.0; (duration / width).ceil() as usize + 1];
    let mut kept = 0.0;
    for (k, &r) in residuals_deg.iter().enumerate() {
        if !stretch.excluded[k] {
            sums[((stretch.time_s[k] - stretch.start_s()) / width + 1e-6) as usize] += r;
            kept += 1.0;
        }
    }
    let turn: Vec<(f64, f64)> =
        bins.iter().map(|&k| (k as f64 * TAU / duration * width).sin_cos()).collect();
    let mut phasor = vec![(0.0, 1.0); bins.len()];
    let mut transform = vec![(0.0, 0.0); bins.len()];
    for sum in sums {
        for k in 0..bins.len() {
            let (s, c) = phasor[k];
            transform[k].0 += sum * c;
            transform[k].1 += sum * s;
            let (ts, tc) = turn[k];
            phasor[k] = (s * tc + c * ts, c * tc - s * ts);
        }
    }
    transform.iter().map(|(a, b)| a * a + b * b).sum::<f64>() / kept
}
