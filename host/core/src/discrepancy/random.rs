//! By how much the numbers of a fit may be off because the rig is shaken: a random moment beside the model.
//!
//! What it adds to the readings is largest, and moves natural frequency and damping, about the oscillation's
//! own frequency. There the residuals, turned back by the motion's phase and averaged over each cycle, are a
//! first-order process that decays as the motion does, beside white noise; halfway between the harmonics,
//! where a law leaves nothing, they are that noise and a little of the response. The evidence of each
//! intensity is that of these means, with the fit's numbers and a law's strengths integrated out; the
//! expected one is taken. Least squares knows nothing of it: its numbers' covariance is (J'J)^-1 J'CJ
//! (J'J)^-1, C being that of what the moment adds to the readings.

use super::sums::{Observed, Sums};
use super::swing::Swing;
use crate::motion::random::Step;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Logarithms (to 10) of the sizes that are tried: variance that the moment adds to a cycle's mean within a
/// cycle, over that of the mean's noise.
const MOMENT_SIZES: std::ops::RangeInclusive<i32> = -4..=8;

/// Whitens means over a cycle each of a first-order process from a known start, by its Kalman filter; gives
/// half the logarithm of their covariance's determinant. `size`: variance that the process gains in a cycle,
/// a third of which is in the cycle's mean, which shares half with the cycle's end.
fn whiten(means: &mut [f64], transition: f64, size: f64) -> f64 {
    let (mut state, mut variance, mut logs) = (0.0, 0.0, 0.0);
    let middle = transition.sqrt();
    for y in means {
        let all: f64 = transition * variance + size / 3.0 + 1.0;
        let innovation = *y - middle * state;
        let gain = (transition * middle * variance + 0.5 * size) / all;
        logs += 0.5 * all.ln();
        state = transition * state + gain * innovation;
        variance = transition * transition * variance + size - gain * gain * all;
        *y = innovation / all.sqrt();
    }
    logs
}

/// Means of one release's readings.
struct Means {
    /// Of each cycle, cosines and then sines, and of the residuals those between the harmonics.
    rows: Observed,
    /// Cycles, and what is left of an oscillation from one to the next.
    cycles: usize,
    transition: f64,
    /// Variance of each mean between the harmonics by a moment of unit size.
    between: Vec<f64>,
}

impl Means {
    fn of(release: &Observed, swing: &Swing) -> Self {
        let means = |series: &Vec<f64>| swing.means(&series[..release.count], 1.0, 1.0).concat();
        let mut residuals = means(&release.residuals);
        let cycles = residuals.len() / 2;
        let per_cycle = swing.phase_rad.len() as f64 / swing.cycles();
        let mut between = Vec::new();
        // Below the oscillation the zero wanders, and far above it noise has another density.
        for ratio in [1.5, 2.5].into_iter().filter(|ratio| 2.5 * ratio < per_cycle) {
            let more = swing.means(&release.residuals[..release.count], ratio, 2.0).concat();
            let response = 4.0 / (TAU * (1.0 - ratio * ratio)).powi(2);
            between.extend(std::iter::repeat_n(response, more.len()));
            residuals.extend(more);
        }
        let rows = |columns: &[Vec<f64>]| {
            let mut rows: Vec<Vec<f64>> = columns.iter().map(means).collect();
            rows.iter_mut().for_each(|row| row.resize(residuals.len(), 0.0));
            rows
        };
        let rows = Observed {
            count: residuals.len(),
            places: release.places.clone(),
            columns: rows(&release.columns),
            responses: rows(&release.responses),
            residuals,
            swing: None,
        };
        let transition = (-swing.decay() * swing.period_s()).exp();
        Self { rows, cycles, transition, between }
    }

    /// The rows in which a moment of this `size` is white noise, and half the logarithm of the determinant
    /// that this costs.
    fn white(&self, size: f64) -> (Observed, f64) {
        let mut white = self.rows.clone();
        let Observed { residuals, columns, responses, .. } = &mut white;
        let mut logs = 0.0;
        for series in columns.iter_mut().chain(responses).chain([residuals]) {
            let (cycles, between) = series.split_at_mut(2 * self.cycles);
            logs = 0.0;
            for part in cycles.chunks_mut(self.cycles.max(1)) {
                logs += whiten(part, self.transition, size);
            }
            for (mean, response) in between.iter_mut().zip(&self.between) {
                let variance = 1.0 + size * response;
                *mean /= variance.sqrt();
                logs += 0.5 * variance.ln();
            }
        }
        (white, logs)
    }
}

/// The cycles' means of all releases under a moment of one size.
pub(super) struct Tried {
    size: f64,
    sums: Sums,
    /// What it costs in the logarithm of the evidence that numbers and moment are free.
    cost: f64,
}

/// No moment and each of those that are tried; none where the means do not determine the fit's `numbers`, or
/// a moment does not show in what is read.
pub(super) fn tried(releases: &[Observed], numbers: usize) -> Vec<Tried> {
    let means = |release: &Observed| Some(Means::of(release, release.swing.as_ref()?));
    let means: Option<Vec<Means>> = releases.iter().map(means).collect();
    let Some(means) = means else { return Vec::new() };
    let of = |size: f64| {
        let (rows, logs): (Vec<Observed>, Vec<f64>) =
            means.iter().map(|means| means.white(size)).unzip();
        let sums = Sums::new(&rows, numbers)?;
        Some(Tried { size, cost: sums.elimination + logs.iter().sum::<f64>(), sums })
    };
    std::iter::once(0.0).chain(MOMENT_SIZES.map(|size| 10f64.powi(size))).filter_map(of).collect()
}

/// What the cycles' means tell of a random moment.
pub(super) struct Shaken {
    /// Logarithm of the evidence, all sizes of a moment that may be taken together.
    pub(super) evidence: f64,
    /// Expected variance that the moment adds to a cycle's mean within a cycle.
    variance: f64,
}

impl Shaken {
    /// Beside a law whose strengths have these `deviations`. That there is `none` is so much likelier
    /// beforehand, as a logarithm, than that there is one, of whatever size.
    pub(super) fn of(tried: &[Tried], deviations: &DVector<f64>, none: f64) -> Option<Self> {
        let of = |Tried { size, sums, cost }: &Tried| {
            let (evidence, found) = sums.evidence(deviations.clone(), 1.0)?;
            let prior = if *size == 0.0 { none + (MOMENT_SIZES.count() as f64).ln() } else { 0.0 };
            Some([evidence - cost + prior, size * found.noise])
        };
        let known = |each: &[f64; 2]| each.iter().all(|v| v.is_finite());
        let each: Vec<[f64; 2]> = tried.iter().filter_map(of).filter(known).collect();
        let most = each.iter().map(|t| t[0]).fold(f64::NEG_INFINITY, f64::max);
        let weights: f64 = each.iter().map(|t| (t[0] - most).exp()).sum();
        let variance = each.iter().map(|t| (t[0] - most).exp() * t[1]).sum::<f64>() / weights;
        (!each.is_empty()).then_some(Self { evidence: most + weights.ln(), variance })
    }

    /// The covariance that it puts into the fitted numbers, R'R being the inverse of J'J and `root` R.
    pub(super) fn covariance(
        &self,
        releases: &[Observed],
        root: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        let mut sum = DMatrix::zeros(root.nrows(), root.nrows());
        for release in releases {
            let swing = release.swing.as_ref()?;
            // A moment of intensity q adds q T / (2 w^2) to the variance of either part within a cycle T.
            let intensity =
                self.variance * 2.0 * swing.frequency_rad_s().powi(2) / swing.period_s();
            // In as many coordinates as the release has numbers, in which its columns are no longer than 1.
            let own = root.select_columns(&release.places).qr();
            let [across, along] = [own.q(), own.r()];
            sum += &across * gathered(release, swing, intensity, &along)? * across.transpose();
        }
        Some(root.transpose() * sum * root)
    }
}

/// R J'CJ R' of one release under a moment of `intensity` in the readings' unit, R being `root`, by the
/// adjoint, which runs backwards.
fn gathered(
    release: &Observed,
    swing: &Swing,
    intensity: f64,
    root: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let wn = swing.frequency_rad_s();
    let Step { transition: f, added: q, .. } =
        Step::new(swing.step_s, wn, swing.decay() / wn, intensity, false)?;
    let mut sum = DMatrix::zeros(root.nrows(), root.nrows());
    let mut adjoint = vec![[0.0; 2]; root.nrows()];
    for k in (1..release.count).rev() {
        let row = root * DVector::from_iterator(root.ncols(), release.columns.iter().map(|c| c[k]));
        for (x, row) in adjoint.iter_mut().zip(&row) {
            *x = [f[0][0] * x[0] + f[1][0] * x[1] + row, f[0][1] * x[0] + f[1][1] * x[1]];
        }
        for (i, a) in adjoint.iter().enumerate() {
            let [b, r] = [q[0] * a[0] + q[1] * a[1], q[1] * a[0] + q[2] * a[1]];
            for (j, c) in adjoint.iter().enumerate() {
                sum[(i, j)] += b * c[0] + r * c[1];
            }
        }
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The joint density of means over a cycle each of a first-order process that is followed in a hundred
    /// steps a cycle, beside noise of unit variance.
    #[test]
    fn whitened_means_have_the_likelihood_of_their_covariance() {
        let (cycles, steps, transition, size) = (12, 100, 0.97_f64, 3.0_f64);
        let step = transition.powf(1.0 / f64::from(steps));
        let mut covariance = DMatrix::<f64>::identity(cycles, cycles);
        // Column by column what one kick does to all means.
        for kick in 0..cycles * steps as usize {
            let mut response = DVector::<f64>::zeros(cycles);
            let mut there = 1.0;
            for k in kick..cycles * steps as usize {
                response[k / steps as usize] += there / f64::from(steps);
                there *= step;
            }
            covariance += &response * response.transpose() * (size / f64::from(steps));
        }
        let y = DVector::from_fn(cycles, |k, _| ((k * k * 7 % 13) as f64) - 6.0);
        let mut white = y.as_slice().to_vec();
        let logs = whiten(&mut white, transition, size);
        let root = nalgebra::Cholesky::new(covariance).unwrap();
        let squares: f64 = white.iter().map(|v| v * v).sum();
        let wanted = y.dot(&root.solve(&y));
        assert!((squares / wanted - 1.0).abs() < 0.03, "{squares} {wanted}");
        let wanted: f64 = root.l().diagonal().iter().map(|d| d.ln()).sum();
        assert!((logs / wanted - 1.0).abs() < 0.03, "{logs} {wanted}");
    }
}
