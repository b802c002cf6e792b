//! What repeats of one quantity say together: their mean, and how much they scatter.

use crate::quantity::{self, weighted_mean, Quantity};
use crate::statistics::rare_chi_squared;

/// A mean and where its standard uncertainty comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mean {
    pub(crate) value: f64,
    pub(crate) u_fit: f64,
    /// What of it is for a law that the linear model lacks.
    pub(crate) u_lacking: f64,
    pub(crate) u_repeatability: f64,
    /// By how much the repeats scatter more than their fits state, where that is more than chance; else 1.
    pub(crate) birge_ratio: f64,
}

impl Mean {
    /// So much of it for a law that the linear model lacks.
    pub(super) fn lacking(self, u: f64) -> Self {
        Self { u_lacking: u.min(self.u_fit), ..self }
    }

    pub(crate) fn u(&self) -> f64 {
        self.u_fit.hypot(self.u_repeatability)
    }
}

/// Standard deviation between releases beyond their own uncertainties, pooled over the groups by moments; 0
/// where there is none or nothing was repeated.
pub(super) fn excess_scatter(groups: &[Vec<Quantity>]) -> f64 {
    let (mut excess, mut freedom) = (0.0, 0.0);
    for group in groups.iter().filter(|group| group.len() > 1) {
        let n = group.len() as f64;
        let mean = group.iter().map(|q| q.value).sum::<f64>() / n;
        let scatter: f64 = group.iter().map(|q| (q.value - mean).powi(2)).sum();
        let expected: f64 = group.iter().map(|q| q.u * q.u).sum::<f64>() * (n - 1.0) / n;
        excess += scatter - expected;
        freedom += n - 1.0;
    }
    if freedom > 0.0 {
        (excess / freedom).max(0.0).sqrt()
    } else {
        0.0
    }
}

/// Chi squared of repeats against their stated uncertainties with its degrees of freedom, and what the
/// weighted mean's uncertainty would be by those; `None` for one release, or where one claims to be exact.
pub(super) fn chi_squared(values: &[Quantity]) -> Option<(f64, f64, f64)> {
    let freedom = values.len().checked_sub(1).filter(|n| *n > 0)? as f64;
    if !values.iter().all(Quantity::is_known) {
        return None;
    }
    let mean = weighted_mean(values.iter().copied())?;
    Some((quantity::chi_squared(values.iter().copied(), mean.value), freedom, mean.u))
}

/// Square root of chi squared per degree of freedom, and what the weighted mean's uncertainty would be as
/// stated; `None` also where chance alone exceeds it once in a hundred or more often.
fn birge(values: &[Quantity]) -> Option<(f64, f64)> {
    let (chi_squared, freedom, stated) = chi_squared(values)?;
    let is_rare = chi_squared > rare_chi_squared(freedom);
    is_rare.then(|| ((chi_squared / freedom).sqrt(), stated))
}

/// Weighted by 1 / (u^2 + tau^2); unweighted where a release claims to be exact.
pub(super) fn mean(values: &[Quantity], tau: f64) -> Mean {
    let variances = values.iter().map(|q| q.u * q.u + tau * tau);
    let weights: Vec<f64> = if variances.clone().all(|variance| variance > 0.0) {
        variances.map(f64::recip).collect()
    } else {
        vec![1.0; values.len()]
    };
    let total: f64 = weights.iter().sum();
    let shares: Vec<f64> = weights.iter().map(|weight| weight / total).collect();
    let both = || values.iter().zip(&shares);
    let u_fit = both().map(|(q, share)| (share * q.u).powi(2)).sum::<f64>().sqrt();
    let pooled = tau.abs() * shares.iter().map(|share| share * share).sum::<f64>().sqrt();
    let (birge_ratio, stated) = birge(values).unwrap_or((1.0, 0.0));
    let widened = (birge_ratio * stated).powi(2) - u_fit * u_fit;
    Mean {
        value: both().map(|(q, share)| share * q.value).sum(),
        u_fit,
        u_lacking: 0.0,
        u_repeatability: pooled.max(widened.max(0.0).sqrt()),
        birge_ratio,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatter_within_the_fits_uncertainty_is_not_counted_twice() {
        let group =
            vec![Quantity::new(1.0, 0.1), Quantity::new(1.1, 0.1), Quantity::new(0.95, 0.1)];
        assert_eq!(excess_scatter(std::slice::from_ref(&group)), 0.0);
        let mean = mean(&group, 0.0);
        assert!((mean.value - 3.05 / 3.0).abs() < 1e-12);
        assert!((mean.u() - 0.1 / 3f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn scatter_beyond_it_is_found_and_pooled() {
        let exact = |values: &[f64]| values.iter().map(|v| Quantity::exact(*v)).collect::<Vec<_>>();
        let groups = [exact(&[1.0, 1.2]), exact(&[5.0]), exact(&[3.0, 3.0, 3.3])];
        // Sums of squares 0.02 and 0.06 over three degrees of freedom.
        let tau = excess_scatter(&groups);
        assert!((tau - (0.08f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((mean(&groups[2], tau).u_repeatability - tau / 3f64.sqrt()).abs() < 1e-12);
        assert_eq!(mean(&groups[1], tau).u_repeatability, tau, "counts for what was released once");
    }

    /// Five releases of each of 2000 conditions, normally distributed about one value by `scatter` times what
    /// they state.
    fn repeats(scatter: f64) -> Vec<Vec<Quantity>> {
        use rand::SeedableRng;
        use rand_distr::{Distribution, Normal};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(25);
        let normal = Normal::new(0.0, scatter).expect("a spread");
        let one = |k: u32| [0.01, 0.02, 0.015, 0.01, 0.03][k as usize];
        let mut of = |k: u32| Quantity::new(1.0 + one(k) * normal.sample(&mut random), one(k));
        (0..2000).map(|_| (0..5).map(&mut of).collect()).collect()
    }

    #[test]
    fn repeats_that_scatter_more_than_they_state_widen_their_mean_by_the_birge_ratio() {
        let all = repeats(4.0);
        let means: Vec<Mean> = all.iter().map(|of| mean(of, 0.0)).collect();
        // Chi squared of 4 degrees of freedom times 16 is below what is rare, 13.3, in 6.6 % of conditions.
        let widened = means.iter().filter(|m| m.birge_ratio > 1.0).count();
        assert!((1830..=1905).contains(&widened), "{widened}");
        // The mean of chi squared over its degrees of freedom is one.
        let square = |m: &Mean| m.birge_ratio.powi(2);
        let of_stated = means.iter().map(square).sum::<f64>() / 2000.0;
        assert!((of_stated / 16.0 - 1.0).abs() < 0.06, "{of_stated}");
        for (of, m) in all.iter().zip(&means).filter(|(_, m)| m.birge_ratio > 1.0) {
            let stated = of.iter().map(|q| (q.u * q.u).recip()).sum::<f64>().sqrt().recip();
            assert!((m.u() / (m.birge_ratio * stated) - 1.0).abs() < 1e-12, "{m:?}");
            assert!((m.u_fit / stated - 1.0).abs() < 1e-12, "{m:?}");
        }
        // Truths within 2 u: Student's t of 4 degrees of freedom says 88.4 %.
        let held = means.iter().filter(|m| (m.value - 1.0).abs() < 2.0 * m.u()).count();
        assert!((1680..=1830).contains(&held), "{held}");
    }

    #[test]
    fn repeats_that_agree_are_not_widened() {
        let all = repeats(1.0);
        let means: Vec<Mean> = all.iter().map(|of| mean(of, 0.0)).collect();
        // Once in a hundred it is chance: 20 of 2000, deviation 4.4.
        let widened = means.iter().filter(|m| m.birge_ratio > 1.0).count();
        assert!((7..=34).contains(&widened), "{widened}");
        assert!(means.iter().filter(|m| m.birge_ratio == 1.0).all(|m| m.u_repeatability == 0.0));
        assert_eq!(mean(&all[0][..1], 0.0).birge_ratio, 1.0, "released once");
        let exact = [Quantity::exact(1.0), Quantity::exact(1.1)];
        assert_eq!(mean(&exact, 0.05).birge_ratio, 1.0, "exact");
    }

    #[test]
    fn what_all_conditions_scatter_counts_where_it_is_more() {
        let group = [Quantity::new(1.0, 0.01), Quantity::new(1.08, 0.01)];
        let (alone, pooled) = (mean(&group, 0.0), mean(&group, 0.2));
        assert!((alone.birge_ratio - 32.0f64.sqrt()).abs() < 1e-9, "{alone:?}");
        assert!((alone.u() - 0.04).abs() < 1e-9, "half the difference: {alone:?}");
        assert!((pooled.u_repeatability - 0.2 / 2f64.sqrt()).abs() < 1e-12, "{pooled:?}");
    }

    #[test]
    fn a_better_release_weighs_more() {
        let mean = mean(&[Quantity::new(1.0, 0.1), Quantity::new(2.0, 0.2)], 0.0);
        assert!((mean.value - 1.2).abs() < 1e-12);
        assert!((mean.u_fit - (1.0f64 / (100.0 + 25.0)).sqrt()).abs() < 1e-12);
    }
}
