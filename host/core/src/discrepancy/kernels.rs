//! Covariances, over the cycles of all releases, of what a model may lack.

use super::cycles::Cycles;
use nalgebra::DMatrix;

/// Covariances of unit size over all groups of cycles of all releases.
pub(super) struct Kernels {
    /// Of a process, by amplitude.
    pub(super) process: DMatrix<f64>,
    /// What it adds up to along the phase.
    pub(super) summed: DMatrix<f64>,
    /// The matrix that sums.
    pub(super) sums: DMatrix<f64>,
    /// What a white moment adds up to.
    pub(super) random: DMatrix<f64>,
    pub(super) ln_amplitude: Vec<f64>,
}

/// Logarithm of the ratio of two amplitudes over which laws bend. With two thirds of it, or four thirds, the
/// uncertainties are much the same.
const RANGE: f64 = 1.5;

/// Correlation of a process at two amplitudes, given by their logarithms: Matern's with one derivative, a half
/// where one is four times the other.
pub(super) fn alike(a: f64, b: f64) -> f64 {
    let x = 3f64.sqrt() * (a - b).abs() / RANGE;
    (1.0 + x) * (-x).exp()
}

impl Kernels {
    pub(super) fn new(all: &[Cycles]) -> Self {
        let ln_amplitude: Vec<f64> =
            all.iter().flat_map(|c| c.ln_amplitude.iter().copied()).collect();
        let n = ln_amplitude.len();
        let largest = ln_amplitude.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let process = DMatrix::from_fn(n, n, |i, j| alike(ln_amplitude[i], ln_amplitude[j]));
        let (mut sums, mut random) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        let mut first = 0;
        for cycles in all {
            let end = first + cycles.phase_rad.len();
            for k in first + 1..end {
                let step = cycles.phase_rad[k - first] - cycles.phase_rad[k - first - 1];
                for row in k..end {
                    sums[(row, k)] += 0.5 * step;
                    sums[(row, k - 1)] += 0.5 * step;
                    for column in k..end {
                        random[(row, column)] += step * (2.0 * (largest - ln_amplitude[k])).exp();
                    }
                }
            }
            first = end;
        }
        let summed = &sums * &process * sums.transpose();
        Self { process, summed, sums, random, ln_amplitude }
    }
}
