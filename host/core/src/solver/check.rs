//! A problem's Jacobian against differences of its residuals: for the tests of whoever writes a problem.

use super::{Problem, Rows};

struct Dense {
    parameters: usize,
    residuals: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

impl Dense {
    fn new(problem: &impl Problem, p: &[f64]) -> Self {
        let mut dense =
            Self { parameters: problem.parameters(), residuals: Vec::new(), rows: Vec::new() };
        problem.evaluate(p, &mut dense);
        dense
    }
}

impl Rows for Dense {
    fn row(&mut self, residual: f64, derivatives: &[f64]) {
        self.residuals.push(residual);
        self.rows.push(derivatives.to_vec());
    }
    fn part(&mut self, residuals: &[f64], which: &[usize], columns: &[&[f64]]) {
        for (k, &r) in residuals.iter().enumerate() {
            let mut row = vec![0.0; self.parameters];
            for (&i, column) in which.iter().zip(columns) {
                row[i] = column[k];
            }
            self.row(r, &row);
        }
    }
}

/// All residuals at `p`, in order.
pub(crate) fn residuals(problem: &impl Problem, p: &[f64]) -> Vec<f64> {
    Dense::new(problem, p).residuals
}

/// Largest difference between the analytic Jacobian and one by fourth-order central differences,
/// relative to the largest element of its column.
pub(crate) fn jacobian_error(problem: &impl Problem, p: &[f64]) -> f64 {
    let analytic = Dense::new(problem, p);
    let mut worst = 0.0_f64;
    for j in 0..p.len() {
        let h = 1e-3 * p[j].abs().max(1e-3);
        let at = |shift: f64| {
            let mut q = p.to_vec();
            q[j] += shift;
            residuals(problem, &q)
        };
        let (a, b, c, d) = (at(-2.0 * h), at(-h), at(h), at(2.0 * h));
        let largest = analytic.rows.iter().fold(0.0_f64, |m, row| m.max(row[j].abs()));
        for (k, row) in analytic.rows.iter().enumerate() {
            let difference = (a[k] - 8.0 * b[k] + 8.0 * c[k] - d[k]) / (12.0 * h);
            worst = worst.max((difference - row[j]).abs() / largest.max(f64::MIN_POSITIVE));
        }
    }
    worst
}
