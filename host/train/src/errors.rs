//! How far estimates of natural frequency and damping ratio lie from the truth.

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
    pub fn of(pairs: &[([f64; 2], [f64; 2])]) -> Self {
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

/// Of sorted values; not a number where there are none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = ((sorted.len() as f64 * share) as usize).min(sorted.len().saturating_sub(1));
    sorted.get(at).copied().unwrap_or(f64::NAN)
}
