//! A smooth curve through values along time, and the mean of its slope.
//!
//! Legendre polynomials by weighted least squares. Beside the noise that is known of each value the values
//! scatter by something unknown, of one size or falling with the noise's own ratio: as large as makes the
//! scatter about the curve what it should be. The degree, and which of the two, is by BIC. It leaves out what is
//! hardly to be seen, and that is as large as chance: the mean of the slope is that of a curve with two numbers
//! more, one of which moves it.

use crate::bic;
use crate::statistics::{correlation, independent_share};
use nalgebra::{DMatrix, DVector};

/// Highest degree: over a tenfold fall of the amplitude what friction, drag or a stiffness that changes put
/// into a rate is followed to a percent of it.
const HIGHEST_DEGREE: usize = 6;
/// Values for each number of a curve, at least: of fewer nothing is seen of how they scatter.
const VALUES_A_NUMBER: usize = 2;
/// Numbers by which a curve is freer than the likeliest: of two degrees in a row one is odd.
const MORE: usize = 2;
/// Halvings in which the unknown scatter is found: to a thousandth of itself from a range of 2^40.
const HALVINGS: usize = 50;

/// A value, and the standard deviation of its noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) time_s: f64,
    pub(super) value: f64,
    pub(super) u: f64,
}

/// A polynomial over a stretch of time.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    ends_s: [f64; 2],
    likeliest: Scattered,
    /// With two numbers more.
    freer: Scattered,
}

impl Curve {
    /// Over `from_s..to_s` through at least three points in it.
    pub(super) fn through(points: &[Point], [from_s, to_s]: [f64; 2]) -> Option<Self> {
        let most = (points.len().div_ceil(VALUES_A_NUMBER)).min(HIGHEST_DEGREE + 1);
        let usable = |p: &Point| p.value.is_finite() && p.u > 0.0 && p.u.is_finite();
        if points.len() < 3 || !points.iter().all(usable) {
            return None;
        }
        let least = points.iter().map(|p| p.u).fold(f64::INFINITY, f64::min);
        // Sizes of the unknown scatter: the same for all, or as the noise.
        let sizes = [vec![least; points.len()], points.iter().map(|p| p.u).collect()];
        let rows: Vec<Vec<f64>> = points
            .iter()
            .map(|p| legendre(place([from_s, to_s], p.time_s), most + MORE).0)
            .collect();
        let of = |numbers: usize| -> Vec<Scattered> {
            let design = DMatrix::from_fn(points.len(), numbers, |i, k| rows[i][k]);
            let of_sizes = |sizes: &Vec<f64>| Scattered::about(points, &design, sizes);
            sizes.iter().filter_map(of_sizes).collect()
        };
        let tries: Vec<Scattered> = (2..=most).flat_map(of).collect();
        // Neighbours that are off together count as fewer: as about the curve that bends most.
        let share = tries.last()?.share;
        let count = share * points.len() as f64;
        let best = |tries: Vec<Scattered>| {
            let bic =
                |of: &Scattered| bic::of_deviance(share * of.deviance, count.max(1.0), of.counted);
            tries.into_iter().min_by(|a, b| bic(a).total_cmp(&bic(b)))
        };
        let likeliest = best(tries)?;
        let freer =
            of((likeliest.numbers.len() + MORE).min(points.len().div_ceil(VALUES_A_NUMBER)));
        Some(Self { ends_s: [from_s, to_s], likeliest, freer: best(freer)? })
    }

    /// Mean of its slope over all of it, and the standard uncertainty.
    pub(super) fn mean_rate(&self) -> (f64, f64) {
        // P_k(1) - P_k(-1): 2 of the odd ones.
        let gain = |k: usize, _: usize| if k % 2 == 1 { 2.0 } else { 0.0 };
        self.freer.sum(&DVector::from_fn(self.freer.numbers.len(), gain), self.length_s())
    }

    /// Its slope at a time, and the standard uncertainty.
    pub(super) fn rate(&self, time_s: f64) -> (f64, f64) {
        let slopes = legendre(place(self.ends_s, time_s), self.likeliest.numbers.len()).1;
        self.likeliest.sum(&DVector::from_vec(slopes), 0.5 * self.length_s())
    }

    /// Whether its slope is not the same all along.
    pub(super) fn bends(&self) -> bool {
        self.likeliest.numbers.len() > 2
    }

    fn length_s(&self) -> f64 {
        self.ends_s[1] - self.ends_s[0]
    }
}

/// From -1 to 1 between the ends.
fn place([from_s, to_s]: [f64; 2], time_s: f64) -> f64 {
    2.0 * (time_s - from_s) / (to_s - from_s) - 1.0
}

/// A fit with the unknown scatter.
#[derive(Clone, Debug)]
struct Scattered {
    numbers: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Share of the points that count as independent.
    share: f64,
    deviance: f64,
    /// Numbers that were fitted.
    counted: usize,
}

impl Scattered {
    /// What the numbers add up to with these weights, over so much, and its standard uncertainty.
    fn sum(&self, weights: &DVector<f64>, over: f64) -> (f64, f64) {
        let variance = weights.dot(&(&self.covariance * weights)).max(0.0);
        (weights.dot(&self.numbers) / over, variance.sqrt() / over)
    }

    /// To the rows of `design`, the unknown scatter in proportion to `sizes`.
    fn about(points: &[Point], design: &DMatrix<f64>, sizes: &[f64]) -> Option<Self> {
        let numbers = design.ncols();
        let freedom = (points.len() - numbers) as f64;
        let fitted = |scatter: f64| {
            let u = points.iter().zip(sizes).map(|(p, size)| p.u.hypot(scatter * size));
            let u: Vec<f64> = u.collect();
            let weighted = DMatrix::from_fn(points.len(), numbers, |i, k| design[(i, k)] / u[i]);
            let right = DVector::from_fn(points.len(), |i, _| points[i].value / u[i]);
            let normal = (weighted.transpose() * &weighted).cholesky()?;
            let solved = normal.solve(&(weighted.transpose() * &right));
            let left = right - &weighted * &solved;
            Some((solved, normal.inverse(), left, u))
        };
        let is_too_small = |scatter: f64| {
            fitted(scatter).is_some_and(|(_, _, left, _)| left.norm_squared() > freedom)
        };
        let mut scatter = 0.0;
        if is_too_small(0.0) {
            let (mut low, mut high) = (1e-6f64, 1e12f64);
            for _ in 0..HALVINGS {
                let middle = (low * high).sqrt();
                *(if is_too_small(middle) { &mut low } else { &mut high }) = middle;
            }
            scatter = high;
        }
        let (solved, covariance, left, u) = fitted(scatter)?;
        // What is known of the noise is that of neighbours by themselves.
        let share = match scatter > 0.0 {
            true => independent_share(correlation(&[left.as_slice().to_vec()])),
            false => 1.0,
        };
        let deviance = left.norm_squared() + 2.0 * u.iter().map(|u| u.ln()).sum::<f64>();
        let counted = numbers + usize::from(scatter > 0.0);
        let covariance = covariance / share;
        Some(Self { numbers: solved, covariance, share, deviance, counted })
    }
}

/// The first so many Legendre polynomials at x, and their slopes.
fn legendre(x: f64, numbers: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut values, mut slopes) = (vec![1.0, x], vec![0.0, 1.0]);
    for k in 2..numbers {
        let n = k as f64;
        values.push(((2.0 * n - 1.0) * x * values[k - 1] - (n - 1.0) * values[k - 2]) / n);
        slopes.push(slopes[k - 2] + (2.0 * n - 1.0) * values[k - 1]);
    }
    values.truncate(numbers);
    slopes.truncate(numbers);
    (values, slopes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    /// `count` values over 10 s whose noise is `u`, at `value` of the time.
    fn points(count: usize, u: f64, seed: u64, value: impl Fn(f64) -> f64) -> Vec<Point> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let at = |k: usize| {
            let time_s = 10.0 * (k as f64 + 0.5) / count as f64;
            let value = value(time_s) + u * rng.sample::<f64, _>(StandardNormal);
            Point { time_s, value, u }
        };
        (0..count).map(at).collect()
    }

    /// Of 400 means 382 are within 2 u, give or take 4; by degrees of chance in some of them a few less.
    #[test]
    fn means_are_as_uncertain_as_they_say() {
        let values = [|t: f64| 0.3 * t, |t: f64| 4.0 * (-0.3 * t).exp(), |t: f64| (12.0 - t).ln()];
        // Noise as it is known, and four times more.
        for more in [1.0, 4.0] {
            let mut inside = 0;
            for (seed, value) in (0..402).zip(values.iter().cycle()) {
                let mut points = points(30, 0.02 * more, seed, value);
                points.iter_mut().for_each(|p| p.u = 0.02);
                let curve = Curve::through(&points, [0.0, 10.0]).expect("points");
                let (mean, u) = curve.mean_rate();
                inside += u32::from((mean - (value(10.0) - value(0.0)) / 10.0).abs() < 2.0 * u);
            }
            println!("noise times {more}: {inside} of 402 within 2 u");
            assert!(inside > 360, "{inside} of 402");
        }
    }

    #[test]
    fn a_straight_line_has_its_uncertainty_and_a_mean_that_of_a_curve() {
        let points = points(40, 0.05, 3, |t| 2.0 - 0.7 * t);
        let curve = Curve::through(&points, [0.0, 10.0]).expect("points");
        assert!(!curve.bends());
        let squares: f64 = points.iter().map(|p| (p.time_s - 5.0).powi(2)).sum();
        let (mean, u) = curve.mean_rate();
        let (rate, u_rate) = curve.rate(1.0);
        assert!((u_rate / (0.05 / squares.sqrt()) - 1.0).abs() < 0.2, "{u_rate}");
        // Shares of the variance of a mean: 12 of the first degree, 28 of the third.
        assert!((u / u_rate / (40f64 / 12.0).sqrt() - 1.0).abs() < 0.1, "{u} {u_rate}");
        assert!((mean + 0.7).abs() < 3.0 * u && (rate + 0.7).abs() < 3.0 * u_rate);
    }

    #[test]
    fn what_bends_has_its_slopes_and_few_points_have_no_curve() {
        let points = points(60, 1e-4, 4, |t| (12.0 - t).ln());
        let curve = Curve::through(&points, [0.0, 10.0]).expect("points");
        for t in [0.5, 5.0, 9.5] {
            let (rate, u) = curve.rate(t);
            assert!(curve.bends() && (rate * (t - 12.0) - 1.0).abs() < 0.02, "{t}: {rate} +- {u}");
        }
        assert!(Curve::through(&points[..2], [0.0, 10.0]).is_none());
    }
}
