//! A measured law as tables, with its uncertainty.

use crate::effects::MeasuredLaw;
use crate::fit::structure::{WN, ZETA};
use crate::quantity::Quantity;
use nalgebra::{DMatrix, DVector};

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
pub struct Tables<'a> {
    pub(super) law: &'a MeasuredLaw,
    pub(super) common: &'a [f64],
    pub(super) covariance: &'a DMatrix<f64>,
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
        let point = |k: u8| {
            let at = reach * (2.0 * f64::from(k) / 40.0 - 1.0);
            Point { at, moment_rad_s2: self.quantity(&row(at)) }
        };
        (0..=40).map(point).collect()
    }

    /// D at a rate, rad/s2, as it stands.
    pub(super) fn dissipation(&self, rate_rad_s: f64) -> f64 {
        let row = self.widened(&self.law.rows(0.0, rate_rad_s)[1]);
        row.iter().zip(self.common).map(|(a, b)| a * b).sum()
    }

    /// K(b) over the yaw angles reached, rad from the rest: what the whole restoring moment is beyond wn^2 b,
    /// whose line is taken as it is. The uncertainty is that of the whole.
    pub fn stiffness(&self) -> Vec<Point> {
        beyond(self.total_stiffness(), self.common[WN] * self.common[WN])
    }

    /// D(r) over the yaw rates reached, rad/s: beyond 2 zeta wn r, alike.
    pub fn damping(&self) -> Vec<Point> {
        beyond(self.total_damping(), 2.0 * self.common[ZETA] * self.common[WN])
    }

    /// wn^2 b + K(b): the whole restoring moment.
    pub fn total_stiffness(&self) -> Vec<Point> {
        let wn = self.common[WN];
        // Linear about the fit: half of d(wn^2 b)/d wn times wn.
        let points = self.table(self.law.yaw_rad, |b| {
            let mut row = self.widened(&self.law.rows(b, 0.0)[0]);
            row[0] = 2.0 * wn * b;
            row
        });
        beyond(points, wn * wn)
    }

    /// 2 zeta wn r + D(r): the whole dissipation.
    pub fn total_damping(&self) -> Vec<Point> {
        let (wn, zeta) = (self.common[WN], self.common[ZETA]);
        let points = self.table(self.law.rate_rad_s, |r| {
            let mut row = self.widened(&self.law.rows(0.0, r)[1]);
            (row[0], row[1]) = (2.0 * zeta * r, 2.0 * wn * r);
            row
        });
        beyond(points, 2.0 * zeta * wn)
    }
}

/// `points` less a line of this slope.
fn beyond(mut points: Vec<Point>, slope: f64) -> Vec<Point> {
    points.iter_mut().for_each(|p| p.moment_rad_s2.value -= slope * p.at);
    points
}
