//! Levenberg-Marquardt, bounds by projection.

use super::descent::{descend, Attempt, Damping, Descent, Ended};
use super::{Fit, Normal, Problem};
use nalgebra::{Cholesky, DMatrix, DVector};

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Options {
    /// Evaluations of the model allowed.
    pub(crate) max_evaluations: usize,
    /// Distance to the minimum, in standard errors of the parameters, that is near enough.
    pub(crate) tolerance: f64,
    /// By how much, of the residuals' variance, an evaluation's sum of squares may err: a step that promises
    /// no more, and keeps less than half of it, is the last. 0: exact.
    pub(crate) accuracy: f64,
    /// First damping, relative to the diagonal of J'J: small for a good start, near 1 for a poor one.
    pub(crate) damping: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_evaluations: 100, tolerance: 1e-4, accuracy: 0.0, damping: 1e-3 }
    }
}

/// Where a fit stands: what its parameters are to each other there.
struct Local {
    free: Vec<usize>,
    /// J'J and J'r of the free parameters.
    a: DMatrix<f64>,
    g: DVector<f64>,
    variance: f64,
}

/// A fit on its way.
struct Levenberg<'a, P> {
    problem: &'a P,
    options: &'a Options,
    p: Vec<f64>,
    here: Normal,
    local: Local,
    /// The largest column norms seen: the scaling of the damping, so that units do not matter.
    scale: Vec<f64>,
    trial: Vec<f64>,
    there: Normal,
    evaluations: usize,
}

impl<P: Problem> Descent for Levenberg<'_, P> {
    fn arrived(&mut self) -> Option<Ended> {
        if !self.here.is_finite() {
            return Some(Ended::NotFinite);
        }
        let (jtj, jtr) = (self.here.matrix(), self.here.gradient());
        let free = free_parameters(self.problem, &self.p, &jtr);
        let residuals = self.here.residuals();
        if residuals < free.len() || residuals == 0 {
            return Some(Ended::TooFewResiduals);
        }
        for (i, scale) in self.scale.iter_mut().enumerate() {
            *scale = scale.max(jtj[(i, i)]);
        }
        let variance = self.here.sum_of_squares() / (residuals - free.len()).max(1) as f64;
        let a = jtj.select_rows(&free).select_columns(&free);
        let g = jtr.select_rows(&free);
        if g.amax() == 0.0 {
            return Some(Ended::Converged);
        }
        // g'(J'J)^-1 g / s^2 is the squared distance to the minimum in standard errors.
        let distance = Cholesky::new(a.clone()).map(|full| full.solve(&g).dot(&g));
        self.local = Local { free, a, g, variance };
        let near = self.options.tolerance.powi(2) * variance;
        distance.is_some_and(|distance| distance <= near).then_some(Ended::Converged)
    }

    fn step(&mut self, damping: f64) -> Attempt {
        if self.evaluations >= self.options.max_evaluations {
            return Attempt::Ended(Ended::MaxEvaluations);
        }
        let Local { free, a, g, .. } = &self.local;
        let mut damped = a.clone();
        for (k, &i) in free.iter().enumerate() {
            damped[(k, k)] += damping * self.scale[i].max(f64::MIN_POSITIVE);
        }
        let step = Cholesky::new(damped).map(|c| -c.solve(g));
        let Some(step) = step.filter(|s| s.iter().all(|x| x.is_finite())) else {
            return Attempt::Impossible;
        };
        self.trial.clone_from(&self.p);
        for (k, &i) in free.iter().enumerate() {
            self.trial[i] = clamp(self.problem, i, self.p[i] + step[k]);
        }
        let norm = |v: &dyn Fn(usize) -> f64| {
            free.iter().map(|&i| self.scale[i] * v(i).powi(2)).sum::<f64>().sqrt()
        };
        let moved = |i: usize| self.trial[i] - self.p[i];
        // Lost in rounding.
        if norm(&moved) <= 1e-13 * norm(&|i| self.p[i]) {
            return Attempt::Ended(Ended::SmallStep);
        }
        let taken = DVector::from_iterator(free.len(), free.iter().map(|&i| moved(i)));
        self.problem.bend(&self.p, &mut self.trial);
        for (i, value) in self.trial.iter_mut().enumerate() {
            *value = clamp(self.problem, i, *value);
        }
        Attempt::Promises(-(2.0 * g.dot(&taken) + taken.dot(&(a * &taken))))
    }

    fn gain(&mut self) -> Option<f64> {
        self.there.clear();
        self.problem.evaluate(&self.trial, &mut self.there);
        self.evaluations += 1;
        let gained = self.here.sum_of_squares() - self.there.sum_of_squares();
        self.there.is_finite().then_some(gained)
    }

    fn is_last(&self, promised: f64, gained: Option<f64>) -> bool {
        let accurate = promised <= self.options.accuracy * self.local.variance;
        accurate && gained.is_some_and(|gained| gained < 0.5 * promised)
    }

    fn take(&mut self) {
        std::mem::swap(&mut self.p, &mut self.trial);
        std::mem::swap(&mut self.here, &mut self.there);
    }
}

/// Smallest sum of squares reached from `start` (brought inside the bounds first).
pub(crate) fn minimise(problem: &impl Problem, start: &[f64], options: &Options) -> Fit {
    let n = problem.parameters();
    assert_eq!(start.len(), n, "a start value for each parameter");
    let p: Vec<f64> = (0..n).map(|i| clamp(problem, i, start[i])).collect();
    let mut here = Normal::new(n);
    problem.evaluate(&p, &mut here);
    let (a, g) = (DMatrix::zeros(0, 0), DVector::zeros(0));
    let mut fit = Levenberg {
        problem,
        options,
        trial: p.clone(),
        p,
        here,
        there: Normal::new(n),
        local: Local { free: Vec::new(), a, g, variance: 0.0 },
        scale: vec![0.0; n],
        evaluations: 1,
    };
    let stop = descend(&mut fit, Damping::new(options.damping, [1e-15, 1e16]));
    let Levenberg { p, here, evaluations, .. } = fit;
    finish(problem, p, &here, stop, evaluations)
}

fn finish(
    problem: &impl Problem,
    p: Vec<f64>,
    normal: &Normal,
    stop: Ended,
    evaluations: usize,
) -> Fit {
    let gradient = normal.gradient();
    let free = free_parameters(problem, &p, &gradient);
    let at_bound = (0..p.len()).map(|i| !free.contains(&i)).collect();
    let normal_matrix = normal.matrix();
    let freedom = normal.residuals().saturating_sub(free.len());
    let inverse = || invert(&normal_matrix, &free);
    let covariance = (stop.is_minimum() && freedom > 0).then(inverse).flatten();
    Fit {
        parameters: p,
        sum_of_squares: normal.sum_of_squares(),
        residuals: normal.residuals(),
        stop,
        evaluations,
        at_bound,
        covariance: covariance.map(|inverse| inverse * (normal.sum_of_squares() / freedom as f64)),
        normal_matrix,
    }
}

/// (J'J)^-1 over the `free` parameters, the other rows and columns zero; none where the residuals do not
/// depend on one of them apart from the others.
fn invert(jtj: &DMatrix<f64>, free: &[usize]) -> Option<DMatrix<f64>> {
    // Scaled to a unit diagonal, so that a singular matrix is distinguished from small units.
    let root: Vec<f64> = free.iter().map(|&i| jtj[(i, i)].sqrt()).collect();
    if root.iter().any(|&r| r == 0.0 || !r.is_finite()) {
        return None;
    }
    let m = free.len();
    let scaled = DMatrix::from_fn(m, m, |a, b| jtj[(free[a], free[b])] / (root[a] * root[b]));
    let eigen = scaled.symmetric_eigen();
    if eigen.eigenvalues.iter().any(|value| *value < 1e-13) {
        return None;
    }
    let mut inverse = DMatrix::zeros(jtj.nrows(), jtj.nrows());
    for a in 0..m {
        for b in 0..m {
            let sum: f64 = (0..m)
                .map(|e| {
                    eigen.eigenvectors[(a, e)] * eigen.eigenvectors[(b, e)] / eigen.eigenvalues[e]
                })
                .sum();
            inverse[(free[a], free[b])] = sum / (root[a] * root[b]);
        }
    }
    Some(inverse)
}

fn clamp(problem: &impl Problem, i: usize, value: f64) -> f64 {
    let (low, high) = problem.bounds(i);
    value.max(low).min(high)
}

/// Those that are not pressed against a bound by the gradient.
fn free_parameters(problem: &impl Problem, p: &[f64], gradient: &DVector<f64>) -> Vec<usize> {
    (0..p.len())
        .filter(|&i| {
            let (low, high) = problem.bounds(i);
            !(p[i] <= low && gradient[i] > 0.0 || p[i] >= high && gradient[i] < 0.0 || low == high)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{check, Rows};

    /// Rosenbrock's valley as two residuals.
    struct Valley;
    impl Problem for Valley {
        fn parameters(&self) -> usize {
            2
        }
        fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
            rows.row(10.0 * (p[1] - p[0] * p[0]), &[-20.0 * p[0], 10.0]);
            rows.row(1.0 - p[0], &[-1.0, 0.0]);
        }
    }

    /// y = a exp(-b x) on given data.
    struct Decay {
        data: Vec<(f64, f64)>,
        lowest_b: f64,
    }
    impl Problem for Decay {
        fn parameters(&self) -> usize {
            2
        }
        fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
            for &(x, y) in &self.data {
                let e = (-p[1] * x).exp();
                rows.row(p[0] * e - y, &[e, -p[0] * x * e]);
            }
        }
        fn bounds(&self, index: usize) -> (f64, f64) {
            (if index == 1 { self.lowest_b } else { f64::NEG_INFINITY }, f64::INFINITY)
        }
    }

    fn decay(lowest_b: f64) -> Decay {
        // Alternating disturbance: known residual, no random numbers.
        let data = (0..40)
            .map(|k| {
                let x = k as f64 * 0.1;
                (x, 3.0 * (-0.7 * x).exp() + if k % 2 == 0 { 0.01 } else { -0.01 })
            })
            .collect();
        Decay { data, lowest_b }
    }

    #[test]
    fn the_valley_is_followed_to_its_end() {
        let fit = minimise(&Valley, &[-1.2, 1.0], &Options::default());
        assert!(fit.stop.is_minimum(), "{:?}", fit.stop);
        assert!((fit.parameters[0] - 1.0).abs() < 1e-8 && (fit.parameters[1] - 1.0).abs() < 1e-8);
        assert!(fit.covariance.is_none(), "as many numbers as residuals");
    }

    #[test]
    fn covariance_is_that_of_linear_regression_at_the_minimum() {
        let problem = decay(f64::NEG_INFINITY);
        let fit = minimise(&problem, &[1.0, 0.1], &Options::default());
        assert_eq!(fit.stop, Ended::Converged);
        assert!((fit.parameters[1] - 0.7).abs() < 0.01, "{:?}", fit.parameters);
        let covariance = fit.covariance.clone().unwrap();
        let product = covariance * &fit.normal_matrix / fit.variance();
        assert!((product - DMatrix::identity(2, 2)).amax() < 1e-9);
        let rms = (fit.sum_of_squares / fit.residuals as f64).sqrt();
        assert!((rms - 0.01).abs() < 1e-4, "{rms}");
    }

    #[test]
    fn a_parameter_pressed_against_its_bound_is_reported_and_the_other_still_fitted() {
        let fit = minimise(&decay(1.0), &[1.0, 3.0], &Options::default());
        assert!(fit.stop.is_minimum());
        assert_eq!(fit.at_bound, [false, true]);
        assert_eq!(fit.parameters[1], 1.0);
        let covariance = fit.covariance.unwrap();
        assert!(covariance[(0, 0)] > 0.0 && covariance[(1, 1)] == 0.0);
    }

    #[test]
    fn there_is_no_covariance_where_the_data_does_not_see_a_parameter() {
        struct Blind;
        impl Problem for Blind {
            fn parameters(&self) -> usize {
                2
            }
            fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
                for y in [1.0, 2.0, 4.0] {
                    rows.row(p[0] + p[1] - y, &[1.0, 1.0]);
                }
            }
        }
        let fit = minimise(&Blind, &[0.0, 0.0], &Options::default());
        assert!(fit.stop.is_minimum() && fit.covariance.is_none());
    }

    #[test]
    fn a_start_that_is_not_finite_is_said_so() {
        let fit = minimise(&decay(f64::NEG_INFINITY), &[f64::NAN, 0.1], &Options::default());
        assert_eq!(fit.stop, Ended::NotFinite);
        assert!(fit.covariance.is_none());
    }

    #[test]
    fn running_out_of_evaluations_is_said_so() {
        let options = Options { max_evaluations: 3, ..Options::default() };
        assert_eq!(minimise(&Valley, &[-1.2, 1.0], &options).stop, Ended::MaxEvaluations);
    }

    #[test]
    fn jacobians_agree_with_differences() {
        assert!(check::jacobian_error(&Valley, &[-1.2, 1.0]) < 1e-8);
        assert!(check::jacobian_error(&decay(0.0), &[2.0, 0.4]) < 1e-8);
    }
}
