//! The best straight line through points uncertain in both coordinates.
//!
//! Reference: D. York, N. M. Evensen, M. López Martínez, J. De Basabe Delgado, "Unified equations for the
//! slope, intercept, and standard errors of the best straight line", Am. J. Phys. 72 (2004) 367, without
//! correlation between the two errors of a point.

/// A point with the standard uncertainties of its coordinates, not both zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) u_x: f64,
    pub(crate) y: f64,
    pub(crate) u_y: f64,
}

/// y = intercept + slope x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StraightLine {
    pub(crate) slope: f64,
    pub(crate) intercept: f64,
    /// From the points' stated uncertainties alone, k = 1.
    pub(crate) u_slope: f64,
    pub(crate) u_intercept: f64,
    /// Weighted sum of squared misfits; about `degrees_of_freedom` where the stated uncertainties are true.
    pub(crate) chi_squared: f64,
    /// Points less two.
    pub(crate) degrees_of_freedom: usize,
}

impl StraightLine {
    /// By how much the points scatter more than stated: the square root of chi squared per degree of freedom,
    /// at least 1 (Birge's ratio).
    pub(crate) fn scatter_ratio(&self) -> f64 {
        if self.degrees_of_freedom == 0 {
            return 1.0;
        }
        (self.chi_squared / self.degrees_of_freedom as f64).sqrt().max(1.0)
    }
}

/// The line, or `None` for fewer than two different x.
pub(crate) fn fit(points: &[Point]) -> Option<StraightLine> {
    let n = points.len() as f64;
    let (mean_x, mean_y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x / n, y + p.y / n));
    let (sxx, sxy) = points.iter().fold((0.0, 0.0), |(sxx, sxy), p| {
        (sxx + (p.x - mean_x).powi(2), sxy + (p.x - mean_x) * (p.y - mean_y))
    });
    if points.len() < 2 || sxx.is_nan() || sxx <= 0.0 {
        return None;
    }
    let mut slope = sxy / sxx;
    // For any sensible data it settles to rounding sooner.
    for _ in 0..50 {
        let (centre, weights) = centre(points, slope);
        let (mut above, mut below) = (0.0, 0.0);
        for (p, w) in points.iter().zip(weights) {
            let (du, dv) = (p.x - centre.0, p.y - centre.1);
            let beta = w * (du * p.u_y * p.u_y + slope * dv * p.u_x * p.u_x);
            above += w * beta * dv;
            below += w * beta * du;
        }
        let next = above / below;
        let settled = (next - slope).abs() <= 1e-15 * next.abs();
        slope = next;
        if settled {
            break;
        }
    }
    let (centre, weights) = centre(points, slope);
    let intercept = centre.1 - slope * centre.0;
    let total: f64 = weights.iter().sum();
    // The spread of the points moved onto the line.
    let adjusted = |p: &Point, w: f64| {
        let (du, dv) = (p.x - centre.0, p.y - centre.1);
        centre.0 + w * (du * p.u_y * p.u_y + slope * dv * p.u_x * p.u_x)
    };
    let mean: f64 =
        points.iter().zip(&weights).map(|(p, w)| w * adjusted(p, *w)).sum::<f64>() / total;
    let spread: f64 =
        points.iter().zip(&weights).map(|(p, w)| w * (adjusted(p, *w) - mean).powi(2)).sum();
    let chi_squared =
        points.iter().zip(&weights).map(|(p, w)| w * (p.y - intercept - slope * p.x).powi(2)).sum();
    Some(StraightLine {
        slope,
        intercept,
        u_slope: spread.recip().sqrt(),
        u_intercept: (total.recip() + mean * mean / spread).sqrt(),
        chi_squared,
        degrees_of_freedom: points.len() - 2,
    })
}

/// The weighted middle and the weights at this slope.
fn centre(points: &[Point], slope: f64) -> ((f64, f64), Vec<f64>) {
    let weights: Vec<f64> =
        points.iter().map(|p| (p.u_y * p.u_y + slope * slope * p.u_x * p.u_x).recip()).collect();
    let total: f64 = weights.iter().sum();
    let sum = |of: fn(&Point) -> f64| -> f64 {
        points.iter().zip(&weights).map(|(p, w)| w * of(p)).sum::<f64>() / total
    };
    ((sum(|p| p.x), sum(|p| p.y)), weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Pearson's data with York's weights: the example every such fit is judged by. Published: slope
    /// -0.480533 +- 0.057985 (here and below: York et al. 2004, Table II), intercept 5.479910 +- 0.294971,
    /// chi squared 11.8664.
    #[test]
    fn pearson_s_data_with_york_s_weights() {
        let x = [0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4];
        let y = [5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5];
        let weight_x = [1000.0, 1000.0, 500.0, 800.0, 200.0, 80.0, 60.0, 20.0, 1.8, 1.0f64];
        let weight_y = [1.0, 1.8, 4.0, 8.0, 20.0, 20.0, 70.0, 70.0, 100.0, 500.0f64];
        let points: Vec<Point> = (0..10)
            .map(|i| Point {
                x: x[i],
                u_x: weight_x[i].sqrt().recip(),
                y: y[i],
                u_y: weight_y[i].sqrt().recip(),
            })
            .collect();
        let line = fit(&points).unwrap();
        assert!((line.slope + 0.480_533).abs() < 1e-6, "{line:?}");
        assert!((line.intercept - 5.479_910).abs() < 1e-6, "{line:?}");
        assert!((line.chi_squared - 11.866_353).abs() < 1e-5, "{line:?}");
        assert!((line.u_slope - 0.057_985).abs() < 1e-4, "{line:?}");
        assert!((line.u_intercept - 0.294_971).abs() < 1e-3, "{line:?}");
        assert!((line.scatter_ratio() - (11.866_353f64 / 8.0).sqrt()).abs() < 1e-6);
    }

    /// Either coordinate may be exact.
    #[test]
    fn exact_points_give_the_line_itself() {
        for (u_x, u_y) in [(0.1, 0.0), (0.0, 0.1), (0.1, 0.2)] {
            let points: Vec<Point> = (1..6)
                .map(|i| Point { x: f64::from(i), u_x, y: 3.0 - 2.0 * f64::from(i), u_y })
                .collect();
            let line = fit(&points).unwrap();
            assert!((line.slope + 2.0).abs() < 1e-12 && (line.intercept - 3.0).abs() < 1e-11);
            assert!(line.chi_squared < 1e-20);
            assert_eq!(line.scatter_ratio(), 1.0);
        }
        assert_eq!(fit(&[Point { x: 1.0, u_x: 0.1, y: 1.0, u_y: 0.1 }]), None);
    }

    /// The stated uncertainties are those of many noisy repetitions, with noise in both coordinates.
    #[test]
    fn uncertainties_are_those_of_repetitions() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(11);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
        let (runs, mut inside, mut chi) = (4000, [0, 0], 0.0);
        for _ in 0..runs {
            let points: Vec<Point> = (0..8)
                .map(|i| {
                    let x = 1.0 + 3.0 * f64::from(i);
                    let (u_x, u_y) = (0.05 + 0.02 * f64::from(i), 0.1);
                    Point { x: x + u_x * normal(), u_x, y: 0.4 + 1.7 * x + u_y * normal(), u_y }
                })
                .collect();
            let line = fit(&points).unwrap();
            inside[0] += i32::from((line.slope - 1.7).abs() < line.u_slope);
            inside[1] += i32::from((line.intercept - 0.4).abs() < line.u_intercept);
            chi += line.chi_squared / f64::from(runs);
        }
        // 68.27 % of 4000 has a standard deviation of 0.74 %.
        for inside in inside {
            let share = f64::from(inside) / f64::from(runs);
            assert!((share - 0.6827).abs() < 0.025, "{share}");
        }
        assert!((chi - 6.0).abs() < 0.25, "{chi}");
    }
}
