//! The numbers of one cause from both columns of all springs at once: least squares with the full covariance
//! of the columns' errors.

use super::cause::{Cause, Motion};
use super::chance;
use crate::solver::{minimise, Options, Problem, Rows};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Wagner's function of a plate has two; a third has nothing left to be seen by.
pub(super) const MAX_LAGS: usize = 2;
/// How far beyond the reduced frequencies measured a lag is looked for, as a factor: over one so far off the
/// function is that of the limit b = 0, or none, to 1 %.
const BEYOND: f64 = 10.0;
/// Starts of a lag over that range: some ten for each factor of ten, within which its function turns.
const STARTS: usize = 30;
/// The covariance goes with the fitted columns by a few percent of itself: it has settled sooner.
const ROUNDS: usize = 20;

/// What was measured: Cn_beta and Cn_r of each motion one after the other.
pub(super) struct Columns {
    pub(super) motions: Vec<Motion>,
    pub(super) values: DVector<f64>,
}

/// Of the columns' errors where a cause is the truth; without one, where what was measured is.
pub(super) type CovarianceOf<'a> = dyn Fn(Option<&Cause>) -> DMatrix<f64> + 'a;

/// A fitted cause.
pub(super) struct Fitted {
    pub(super) cause: Cause,
    /// Of its list of numbers, by the stated uncertainties.
    pub(super) covariance: DMatrix<f64>,
    pub(super) chi_squared: f64,
    pub(super) degrees: usize,
    /// For each of the numbers, whether it is at an end of where it was looked for.
    pub(super) at_end: Vec<bool>,
}

impl Fitted {
    pub(super) fn chance(&self) -> f64 {
        chance::chi_squared_tail(self.chi_squared, self.degrees)
    }

    /// By how much the columns scatter more than stated, where that is more than chance (Birge's ratio).
    pub(super) fn widened(&self) -> f64 {
        match self.chance() < chance::RARE {
            true => (self.chi_squared / self.degrees as f64).sqrt(),
            false => 1.0,
        }
    }

    /// Whether its further lags are more than chance against `simpler`: by chi squared where it holds the
    /// columns, and where it does not, since then they scatter more than stated, by F.
    fn is_better_than(&self, simpler: &Self) -> bool {
        let further = simpler.degrees - self.degrees;
        let gained = simpler.chi_squared - self.chi_squared;
        let by_chance = match self.chance() < chance::RARE {
            true => {
                let left = self.chi_squared / self.degrees as f64;
                chance::f_tail(gained / further as f64 / left, further, self.degrees)
            }
            false => chance::chi_squared_tail(gained, further),
        };
        by_chance < chance::RARE
    }
}

/// The fits without lag, with one, and so on, as far as the columns hold more numbers; `None` where their
/// errors are no basis to weigh by. Beside them the fewest lags that further ones do not better.
pub(super) fn fits(columns: &Columns, covariance: &CovarianceOf) -> Option<(Vec<Fitted>, usize)> {
    let fewer = |lags: &usize| 2 + 2 * lags < columns.values.len();
    let all: Option<Vec<Fitted>> =
        (0..=MAX_LAGS).filter(fewer).map(|lags| fit(columns, lags, covariance)).collect();
    let all = all.filter(|all| !all.is_empty())?;
    let better = |chosen: usize, next: usize| match all[next].is_better_than(&all[chosen]) {
        true => next,
        false => chosen,
    };
    let chosen = (1..all.len()).fold(0, better);
    Some((all, chosen))
}

/// With so many lags. The covariance is that of the errors about the fitted columns, not about the measured
/// ones: an error of scale that all share would else draw the fit towards zero (Peelle's puzzle).
fn fit(columns: &Columns, lags: usize, covariance: &CovarianceOf) -> Option<Fitted> {
    let mut fitted = Weighed::new(columns, covariance(None))?.fit(lags);
    for _ in 0..ROUNDS {
        let next = Weighed::new(columns, covariance(Some(&fitted.cause)))?.fit(lags);
        let settled =
            (next.chi_squared - fitted.chi_squared).abs() <= 1e-6 * (1.0 + next.chi_squared);
        fitted = next;
        if settled {
            break;
        }
    }
    Some(fitted)
}

/// The columns with their errors made independent and of size one.
struct Weighed<'a> {
    columns: &'a Columns,
    covariance: Cholesky<f64, Dyn>,
    /// ln b, lowest and highest.
    ends: [f64; 2],
    lags: usize,
}

impl<'a> Weighed<'a> {
    fn new(columns: &'a Columns, covariance: DMatrix<f64>) -> Option<Self> {
        let frequencies = columns.motions.iter().map(|[re, im]| re.hypot(*im));
        let (low, high) =
            frequencies.fold((f64::INFINITY, 0.0f64), |(l, h), k| (l.min(k), h.max(k)));
        let ends = [(low / BEYOND).ln(), (high * BEYOND).ln()];
        Some(Self { columns, covariance: Cholesky::new(covariance)?, ends, lags: 0 })
    }

    fn fit(mut self, lags: usize) -> Fitted {
        self.lags = lags;
        let starts = self.starts();
        let tried = starts.into_iter().filter_map(|poles| self.linear(&poles));
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        let start = best.map_or_else(|| vec![0.0; self.parameters()], |(_, numbers)| numbers);
        let options = Options { max_evaluations: 500, tolerance: 1e-6, ..Options::default() };
        let found = minimise(&self, &start, &options);
        let count = self.parameters();
        let free: Vec<usize> = (0..count).filter(|&i| !found.at_bound[i]).collect();
        let normal = found.normal_matrix.select_rows(&free).select_columns(&free);
        let inverse = Cholesky::new(normal).map(|c| c.inverse());
        let mut covariance = DMatrix::zeros(count, count);
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                covariance[(i, j)] = inverse.as_ref().map_or(f64::INFINITY, |c| c[(a, b)]);
            }
        }
        // The slower lag first.
        let mut order: Vec<usize> = (0..lags).collect();
        order.sort_by(|a, b| found.parameters[2 * a + 3].total_cmp(&found.parameters[2 * b + 3]));
        let places: Vec<usize> =
            [0, 1].into_iter().chain(order.iter().flat_map(|k| [2 * k + 2, 2 * k + 3])).collect();
        let numbers: Vec<f64> = places.iter().map(|&i| found.parameters[i]).collect();
        Fitted {
            cause: Cause::new(&numbers),
            covariance: covariance.select_rows(&places).select_columns(&places),
            chi_squared: found.sum_of_squares,
            degrees: self.columns.values.len() - count,
            at_end: places.iter().map(|&i| found.at_bound[i]).collect(),
        }
    }

    /// ln b of each lag, over the range; of two lags each pair once.
    fn starts(&self) -> Vec<Vec<f64>> {
        let [low, high] = self.ends;
        let at = |k: usize| low + (high - low) * (k as f64 + 0.5) / STARTS as f64;
        (0..self.lags).fold(vec![Vec::new()], |before, _| {
            let further = |poles: &Vec<f64>| {
                let above = poles.last().copied().unwrap_or(f64::NEG_INFINITY);
                let next = (0..STARTS).map(at).filter(move |pole| *pole > above);
                let poles = poles.clone();
                next.map(move |pole| [&poles[..], &[pole]].concat())
            };
            before.iter().flat_map(further).collect()
        })
    }

    /// Chi squared and all numbers where the poles are these: the others are linear.
    fn linear(&self, poles: &[f64]) -> Option<(f64, Vec<f64>)> {
        let mut numbers = vec![0.0; 2];
        poles.iter().for_each(|pole| numbers.extend([0.0, *pole]));
        let linear: Vec<usize> =
            [0, 1].into_iter().chain((1..=poles.len()).map(|k| 2 * k)).collect();
        let (residuals, slopes) = self.weighed(&numbers);
        let slopes = slopes.select_columns(&linear);
        let found = Cholesky::new(slopes.tr_mul(&slopes))?.solve(&-slopes.tr_mul(&residuals));
        linear.iter().zip(found.iter()).for_each(|(&i, x)| numbers[i] = *x);
        Some(((residuals + slopes * found).norm_squared(), numbers))
    }

    /// What the numbers leave, and the slopes of it.
    fn weighed(&self, numbers: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let cause = Cause::new(numbers);
        let mut residuals = -self.columns.values.clone();
        let mut slopes = DMatrix::zeros(residuals.len(), numbers.len());
        for (k, motion) in self.columns.motions.iter().enumerate() {
            let (values, by) = cause.columns(*motion);
            for c in 0..2 {
                residuals[2 * k + c] += values[c];
                by.iter().enumerate().for_each(|(i, by)| slopes[(2 * k + c, i)] = by[c]);
            }
        }
        let lower = self.covariance.l_dirty();
        // A factor has no zero on its diagonal.
        lower.solve_lower_triangular_mut(&mut residuals);
        lower.solve_lower_triangular_mut(&mut slopes);
        (residuals, slopes)
    }
}

impl Problem for Weighed<'_> {
    fn parameters(&self) -> usize {
        2 + 2 * self.lags
    }

    fn evaluate(&self, numbers: &[f64], rows: &mut dyn Rows) {
        let (residuals, slopes) = self.weighed(numbers);
        let columns: Vec<&[f64]> = slopes.as_slice().chunks_exact(residuals.len()).collect();
        rows.block(residuals.as_slice(), &columns);
    }

    fn bounds(&self, index: usize) -> (f64, f64) {
        match index > 2 && index % 2 == 1 {
            true => (self.ends[0], self.ends[1]),
            false => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }
}
