//! How far estimates of natural frequency and damping ratio lie from the truth.

use yawrig_core::solver::linear_fit;

/// Errors in physical units. Medians and 95th percentiles stand beside the rms, which a few draws of
/// almost no damping dominate.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Errors {
    /// (rad/s)^2
    pub natural_frequency_mse: f64,
    pub natural_frequency_rms_percent: f64,
    pub natural_frequency_median_percent: f64,
    pub natural_frequency_p95_percent: f64,
    pub damping_ratio_mse: f64,
    pub damping_ratio_rms_percent: f64,
    pub damping_ratio_median_percent: f64,
    pub damping_ratio_p95_percent: f64,
}

impl Errors {
    /// Of pairs of estimate and truth, each natural frequency in rad/s, then damping ratio.
    pub fn new(pairs: &[([f64; 2], [f64; 2])]) -> Self {
        let count = pairs.len().max(1) as f64;
        let mse = |k: usize| pairs.iter().map(|(e, t)| (e[k] - t[k]).powi(2)).sum::<f64>() / count;
        let shares = |k: usize| {
            let mut all: Vec<f64> =
                pairs.iter().map(|(e, t)| 100.0 * (e[k] / t[k] - 1.0).abs()).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let (frequency, damping) = (shares(0), shares(1));
        let rms = |all: &[f64]| (all.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
        Self {
            natural_frequency_mse: mse(0),
            natural_frequency_rms_percent: rms(&frequency),
            natural_frequency_median_percent: quantile(&frequency, 0.5),
            natural_frequency_p95_percent: quantile(&frequency, 0.95),
            damping_ratio_mse: mse(1),
            damping_ratio_rms_percent: rms(&damping),
            damping_ratio_median_percent: quantile(&damping, 0.5),
            damping_ratio_p95_percent: quantile(&damping, 0.95),
        }
    }
}

/// How far a network's estimates of an effect's number lie from the truth, in the number's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberErrors {
    pub rms: f64,
    /// The power of the amplitude that their size goes with.
    pub amplitude_power: f64,
}

impl NumberErrors {
    /// Of windows' amplitudes, deg, and errors.
    pub fn new(errors: &[(f64, f64)]) -> Self {
        let mean_square = errors.iter().map(|(_, e)| e * e).sum::<f64>() / errors.len() as f64;
        // What is as good as none has no logarithm.
        let least = f64::MIN_POSITIVE.max(1e-9 * mean_square.sqrt());
        let logs =
            errors.iter().map(|(amplitude, e)| ([amplitude.ln(), 1.0], e.abs().max(least).ln()));
        let amplitude_power = linear_fit(logs).map_or(0.0, |[power, _]| power);
        Self { rms: mean_square.sqrt(), amplitude_power }
    }
}

/// Of sorted values; not a number where there are none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = ((sorted.len() as f64 * share) as usize).min(sorted.len().saturating_sub(1));
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_of_the_amplitude_that_errors_go_with_is_found() {
        for power in [-2.0_f64, 0.0, 1.0] {
            let error = |k: i32| {
                let amplitude = 0.7 * 1.01_f64.powi(k);
                // Of either sign, and of many sizes at each amplitude.
                (
                    amplitude,
                    amplitude.powf(power)
                        * (0.1 + f64::from(k * 37 % 100) / 100.0)
                        * (-1.0_f64).powi(k),
                )
            };
            let found = NumberErrors::new(&(0..270).map(error).collect::<Vec<_>>());
            assert!((found.amplitude_power - power).abs() < 0.1, "{power} {found:?}");
        }
    }
}
