//! A measured law as tables, with its uncertainty.

use crate::effects::MeasuredLaw;
use crate::quantity::Quantity;
use nalgebra::{DMatrix, DVector};

/// Points from one end to the other.
const CURVE_POINTS: usize = 41;

/// A point of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Yaw angle in rad, or yaw rate in rad/s.
    pub at: f64,
    /// Moment over Izz, rad/s2; positive where it opposes a positive angle or rate.
    pub moment_rad_s2: Quantity,
}

/// A law among the shared parameters of a fit, which it ends; natural frequency and damping ratio are the
/// first two.
pub(super) struct Tables<'a> {
    pub(crate) law: &'a MeasuredLaw,
    pub(crate) common: &'a [f64],
    pub(crate) covariance: &'a DMatrix<f64>,
}

impl Tables<'_> {
    /// A row over the shared parameters as a quantity.
    fn quantity(&self, row: &DVector<f64>) -> Quantity {
        let value = row.iter().zip(self.common).map(|(a, b)| a * b).sum();
        Quantity::new(value, (row.transpose() * self.covariance * row)[(0, 0)].max(0.0).sqrt())
    }

    /// `row` over the law's parameters as one over the shared parameters.
    fn widened(&self, row: &DVector<f64>) -> DVector<f64> {
        let mut all = DVector::zeros(self.common.len());
        let begin = all.len() - row.len();
        all.rows_mut(begin, row.len()).copy_from(row);
        all
    }

    fn table(&self, reach: f64, row: impl Fn(f64) -> DVector<f64>) -> Vec<Point> {
        let point = |k: usize| {
            let at = reach * (2.0 * k as f64 / (CURVE_POINTS - 1) as f64 - 1.0);
            Point { at, moment_rad_s2: self.quantity(&row(at)) }
        };
        (0..CURVE_POINTS).map(point).collect()
    }

    /// D at a rate, rad/s2, as it stands.
    pub(super) fn dissipation(&self, rate_rad_s: f64) -> f64 {
        let row = self.widened(&self.law.rows(0.0, rate_rad_s)[1]);
        row.iter().zip(self.common).map(|(a, b)| a * b).sum()
    }

    pub(super) fn stiffness(&self) -> Vec<Point> {
        beyond(self.total_stiffness(), self.common[0] * self.common[0])
    }

    pub(super) fn damping(&self) -> Vec<Point> {
        beyond(self.total_damping(), 2.0 * self.common[1] * self.common[0])
    }

    pub(super) fn total_stiffness(&self) -> Vec<Point> {
        let wn = self.common[0];
        // Linear about the fit: half of d(wn^2 b)/d wn times wn.
        let mut points = self.table(self.law.yaw_rad, |b| {
            let mut row = self.widened(&self.law.rows(b, 0.0)[0]);
            row[0] = 2.0 * wn * b;
            row
        });
        points.iter_mut().for_each(|p| p.moment_rad_s2.value -= wn * wn * p.at);
        points
    }

    pub(super) fn total_damping(&self) -> Vec<Point> {
        let (wn, zeta) = (self.common[0], self.common[1]);
        let mut points = self.table(self.law.rate_rad_s, |r| {
            let mut row = self.widened(&self.law.rows(0.0, r)[1]);
            (row[0], row[1]) = (2.0 * zeta * r, 2.0 * wn * r);
            row
        });
        points.iter_mut().for_each(|p| p.moment_rad_s2.value -= 2.0 * zeta * wn * p.at);
        points
    }
}

/// `points` less a line of this slope.
fn beyond(mut points: Vec<Point>, slope: f64) -> Vec<Point> {
    points.iter_mut().for_each(|p| p.moment_rad_s2.value -= slope * p.at);
    points
}
