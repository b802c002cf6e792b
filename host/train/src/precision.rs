//! How much the weights and each output's errors count: MacKay's evidence, as Foresee and Hagan use it.
//!
//! The minimised function is `F = sum_o beta_o E_o + alpha W`, E_o the sum of squared errors of output
//! o, W the sum of squared weights (thesis 4.8), so an output's error variance is `1/(2 beta_o)`.
//! With one beta for all outputs this is the thesis's (4.9); with one each, gamma splits into the
//! outputs' shares `gamma_o = beta_o tr(H^-1 J_o'J_o)`, H half the Hessian, and n counts per output.

use serde::{Deserialize, Serialize};

/// What the precisions are worked out from, at the present weights and precisions.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    /// Effective parameters, per output where precisions are, else one sum.
    pub gamma: Vec<f64>,
    /// Sum of squared errors, grouped as `gamma`.
    pub errors: Vec<f64>,
    /// Largest trace of J_o'J_o of a group.
    pub curvature: Vec<f64>,
    /// Number of target values in each group.
    pub terms: f64,
    pub weights_sq: f64,
    pub parameters: usize,
}

/// How often a safeguard had to act; all zero in an uneventful training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Guards {
    /// A beta held at its cap, or below the point where rounding would drown the prior.
    pub beta_capped: usize,
    /// Alpha kept from running away.
    pub alpha_bounded: usize,
    /// Gamma not between 0 and the number of parameters: the update was left out.
    pub gamma_collapsed: usize,
    /// Gamma as large as the number of target values: n - gamma taken as 1.
    pub no_freedom_left: usize,
    /// A curvature that was not positive definite: damped more.
    pub cholesky_failed: usize,
}

/// Alpha stays in here: weights of 1e4 and 1e-4 as the prior's standard deviation.
const ALPHA: (f64, f64) = (5e-9, 5e7);
/// Largest factor by which alpha changes in one update.
const ALPHA_STEP: f64 = 100.0;
/// Rounding of beta J'J is about epsilon times its trace. It must stay this far below alpha, or the
/// directions only the prior holds seem to have curvature of either sign, and gamma collapses. Seen
/// with 41-6-2 without noise: gamma 37 to 42 up to a ratio of 0.4, negative beyond 2.
const ROUNDING_BELOW_ALPHA: f64 = 0.25;

/// The next alpha and betas (thesis 4.9), or `None` where gamma makes no sense.
pub(super) fn update(
    alpha: f64,
    measured: &Measured,
    beta_cap: f64,
    guards: &mut Guards,
) -> Option<(f64, Vec<f64>)> {
    let n = measured.parameters as f64;
    let gamma: f64 = measured.gamma.iter().sum();
    // Not-a-number fails both comparisons.
    let sensible = |g: f64| g >= 0.0 && g <= n;
    if !sensible(gamma) || !measured.gamma.iter().all(|g| sensible(*g)) {
        guards.gamma_collapsed += 1;
        return None;
    }
    let wanted = gamma / (2.0 * measured.weights_sq);
    let next_alpha = if wanted.is_nan() { alpha } else { wanted }
        .clamp(alpha / ALPHA_STEP, alpha * ALPHA_STEP)
        .clamp(ALPHA.0, ALPHA.1);
    guards.alpha_bounded += usize::from(next_alpha != wanted);
    let groups = measured.gamma.iter().zip(&measured.errors).zip(&measured.curvature);
    let betas = groups.map(|((gamma, errors), curvature)| {
        let freedom = measured.terms - gamma;
        guards.no_freedom_left += usize::from(freedom < 1.0);
        let resolved = ROUNDING_BELOW_ALPHA * next_alpha / (f64::EPSILON * curvature);
        let cap = beta_cap.min(resolved);
        let wanted = freedom.max(1.0) / (2.0 * errors);
        guards.beta_capped += usize::from(wanted > cap);
        wanted.min(cap)
    });
    let betas = betas.collect();
    Some((next_alpha, betas))
}

/// Logarithm of the evidence for the network and its precisions (MacKay 1992; thesis B.3 to B.6).
///
/// `log_det` is of half the Hessian. Equivalent networks (`hidden` nodes of a layer swapped or their
/// signs turned) count, so that networks of different sizes can be compared.
pub(super) fn log_evidence(
    objective: f64,
    log_det: f64,
    (alpha, beta): (f64, &[f64]),
    samples: usize,
    parameters: usize,
    hidden: &[usize],
) -> f64 {
    let symmetry: f64 =
        hidden.iter().map(|&h| (1..=h).map(|i| (2.0 * i as f64).ln()).sum::<f64>()).sum();
    let data: f64 = beta.iter().map(|b| (b / std::f64::consts::PI).ln()).sum();
    -objective - 0.5 * log_det
        + 0.5 * parameters as f64 * alpha.ln()
        + 0.5 * samples as f64 * data
        + symmetry
}

#[cfg(test)]
mod tests {
    use super::*;

    fn healthy() -> Measured {
        Measured {
            gamma: vec![30.0, 12.0],
            errors: vec![0.5, 2.0],
            curvature: vec![1e4, 1e4],
            terms: 250.0,
            weights_sq: 21.0,
            parameters: 266,
        }
    }

    #[test]
    fn follows_foresee_and_hagan() {
        let mut guards = Guards::default();
        let (alpha, beta) = update(1.0, &healthy(), 1e10, &mut guards).unwrap();
        assert_eq!((alpha, beta), (1.0, vec![220.0, 59.5]));
        assert_eq!(guards, Guards::default());
    }

    #[test]
    fn leaves_a_collapsed_gamma_alone() {
        for bad in [-3.0, 300.0, f64::NAN] {
            let mut guards = Guards::default();
            let m = Measured { gamma: vec![30.0, bad], ..healthy() };
            assert_eq!(update(1.0, &m, 1e10, &mut guards), None, "{bad}");
            assert_eq!(guards.gamma_collapsed, 1);
        }
    }

    #[test]
    fn keeps_beta_finite_without_errors_or_freedom() {
        let mut guards = Guards::default();
        let m = Measured { errors: vec![0.0, 2.0], gamma: vec![1.0, 249.9], ..healthy() };
        let (_, beta) = update(1.0, &m, 1e10, &mut guards).unwrap();
        assert_eq!(beta, vec![1e10, 0.25]);
        assert_eq!((guards.beta_capped, guards.no_freedom_left), (1, 1));
    }

    #[test]
    fn keeps_rounding_below_the_prior() {
        let mut guards = Guards::default();
        let m = Measured { errors: vec![1e-13, 2.0], curvature: vec![1e7, 1e4], ..healthy() };
        let (alpha, beta) = update(1.0, &m, 1e12, &mut guards).unwrap();
        assert!(beta[0] * 1e7 * f64::EPSILON <= 0.2501 * alpha, "{}", beta[0]);
        assert_eq!(guards.beta_capped, 1);
    }

    #[test]
    fn keeps_alpha_from_blowing_up() {
        for weights_sq in [0.0, 1e-30, 1e30] {
            let mut guards = Guards::default();
            let m = Measured { weights_sq, ..healthy() };
            let (alpha, _) = update(1.0, &m, 1e10, &mut guards).unwrap();
            assert!((0.01..=100.0).contains(&alpha), "{alpha}");
            assert_eq!(guards.alpha_bounded, 1);
        }
        let mut guards = Guards::default();
        let m = Measured { gamma: vec![0.0, 0.0], weights_sq: 0.0, ..healthy() };
        assert_eq!(update(1.0, &m, 1e10, &mut guards).unwrap().0, 1.0);
    }
}
