//! A release cycle by cycle: by how much its phase, amplitude and mid-line are off the model's, and what of that
//! each number of the model could do.

use super::level::{enough, level};
use crate::par_map::ParMap;
use crate::solver::{Normal, Rows};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Cycles of all releases together, consecutive ones gathered where there are more.
const MAX_GROUPS: usize = 96;
const MIN_GROUPS: usize = 8;
/// Standard deviations of its own noise below which a cycle has no phase.
const MIN_AMPLITUDE: f64 = 4.0;

/// What a fit has left of a record.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Left {
    /// No more than the noise of its samples.
    Noise,
    /// More than that.
    More,
    /// What may be noise of any colour.
    Unknown,
}

/// Rows of one release: record and model, and the model's derivatives, over the noise of a mean.
#[derive(Clone)]
pub(crate) struct Observed {
    /// Of the record; shorter than the residuals where what follows keeps a law smooth.
    pub(crate) readings: Vec<f64>,
    /// Model less record.
    pub(crate) residuals: Vec<f64>,
    /// Of each column: its number's place among all.
    pub(crate) places: Vec<usize>,
    pub(crate) columns: Vec<Vec<f64>>,
    /// Of the record's oscillation at each reading, about; rising.
    pub(crate) phase_rad: Vec<f64>,
    /// Amplitude of the motion, rad, where that of the readings is 1.
    pub(crate) unit_rad: f64,
}

impl Observed {
    /// Whether the residuals are no more than noise.
    pub(crate) fn is_noise(&self) -> bool {
        let count = self.readings.len();
        let squares: f64 = self.residuals[..count].iter().map(|r| r * r).sum();
        squares <= enough(count)
    }
}

/// One measure of the oscillation, of each group of cycles.
#[derive(Clone)]
pub(super) struct Measure {
    /// Record less model.
    pub(super) off: DVector<f64>,
    /// Derivatives of the model's by its numbers.
    pub(super) slopes: DMatrix<f64>,
    /// Variance by white noise of the readings.
    pub(super) variance: DVector<f64>,
}

/// Cycles of one release.
pub(super) struct Cycles {
    pub(super) ln_amplitude: Vec<f64>,
    /// Middle of each group.
    pub(super) phase_rad: Vec<f64>,
    /// Phase, logarithm of the amplitude.
    pub(super) swing: [Measure; 2],
    pub(super) middle: Measure,
    /// What the rest of the readings tells of the numbers.
    pub(super) rest: DMatrix<f64>,
}

/// Harmonics, from the second on, that a wave's shape is made of as far as the readings are dense enough.
const HARMONICS: std::ops::RangeInclusive<usize> = 2..=3;

/// Makes mid-line, cosine and sine part of a cycle's readings; and takes out of them, where enough are left,
/// these three, how much cosine and sine change within the cycle (they do by whatever natural frequency and
/// damping ratio are there), and the wave's `shape`.
fn projections(phase_rad: &[f64], shape: bool) -> Option<(DMatrix<f64>, Option<DMatrix<f64>>)> {
    let n = phase_rad.len();
    let middle = 0.5 * (phase_rad[0] + phase_rad[n - 1]);
    let mut columns: Vec<DVector<f64>> = Vec::new();
    let mut column = |of: &dyn Fn(f64) -> f64| {
        columns.push(DVector::from_iterator(n, phase_rad.iter().map(|p| of(*p))));
    };
    column(&|_| 1.0);
    column(&f64::cos);
    column(&|p| -p.sin());
    column(&|p| (p - middle) * p.cos());
    column(&|p| (p - middle) * p.sin());
    for h in HARMONICS.filter(|h| shape && n > 2 * h + 5).map(|h| h as f64) {
        column(&|p| (h * p).cos());
        column(&|p| (h * p).sin());
    }
    let project = |columns: &[DVector<f64>]| {
        let basis = DMatrix::from_columns(columns);
        let project = (basis.transpose() * &basis).try_inverse()? * basis.transpose();
        Some((basis, project))
    };
    let parts = project(&columns[..3])?.1;
    let rest = project(&columns).filter(|_| n > columns.len() + 1);
    Some((parts, rest.map(|(basis, parts)| DMatrix::identity(n, n) - basis * parts)))
}

/// Ratio of two phasors, which are the last two of three parts: its logarithm's real and imaginary part.
fn turn(a: &DVector<f64>, b: &DVector<f64>) -> [f64; 2] {
    let square = b[1] * b[1] + b[2] * b[2];
    [(a[1] * b[1] + a[2] * b[2]) / square, (a[2] * b[1] - a[1] * b[2]) / square]
}

/// Rows of a cycle: departure, slopes and variance of phase, ln amplitude and mid-line.
struct Cycle {
    ln_amplitude: f64,
    phase_rad: f64,
    rows: [(f64, Vec<f64>, f64); 3],
}

impl Cycles {
    /// Smallest amplitude.
    pub(super) fn smallest_rad(&self) -> f64 {
        self.ln_amplitude.iter().copied().fold(f64::INFINITY, f64::min).exp()
    }

    /// Of a wave whose shape counts where it `may_be_noise`. `None` where fewer than two cycles have a phase.
    fn new(
        release: &Observed,
        numbers: usize,
        most_groups: usize,
        may_be_noise: bool,
    ) -> Option<Self> {
        let Observed { readings, residuals, places, columns, phase_rad, unit_rad } = release;
        let count = readings.len();
        let begin = *phase_rad.first()?;
        let mut edges = vec![0];
        for (k, phase) in phase_rad.iter().enumerate().take(count).skip(1) {
            if phase - begin >= TAU * edges.len() as f64 {
                edges.push(k);
            }
        }
        let mut rest_residuals = Vec::with_capacity(count);
        let mut rest_columns: Vec<Vec<f64>> = vec![Vec::with_capacity(count); columns.len()];
        let mut cycles: Vec<Cycle> = Vec::new();
        let mut phase_off = 0.0;
        for edge in edges.windows(2) {
            let (range, n) = (edge[0]..edge[1], (edge[1] - edge[0]) as f64);
            let (parts, rest) = projections(&phase_rad[range.clone()], !may_be_noise)?;
            let of = |rows: &DMatrix<f64>, y: &[f64]| rows * DVector::from_column_slice(y);
            let seen = of(&parts, &readings[range.clone()]);
            let model = &seen + of(&parts, &residuals[range.clone()]);
            let [amplitude, models] = [&seen, &model].map(|z| z[1].hypot(z[2]));
            if amplitude.min(models) < MIN_AMPLITUDE * (2.0 / n).sqrt() {
                break;
            }
            let left = |y: &[f64]| rest.as_ref().map(|rest| of(rest, y).data.as_vec().clone());
            rest_residuals.extend(left(&residuals[range.clone()]).unwrap_or_default());
            let mut slopes = [Vec::new(), Vec::new(), Vec::new()];
            for (column, rest) in columns.iter().zip(&mut rest_columns) {
                let column = &column[range.clone()];
                rest.extend(left(column).unwrap_or_default());
                let moved = of(&parts, column);
                let [grown, turned] = turn(&moved, &model);
                slopes.iter_mut().zip([turned, grown, moved[0]]).for_each(|(s, v)| s.push(v));
            }
            let [real, imaginary] = turn(&seen, &model);
            let angle = imaginary.atan2(real);
            phase_off = angle + ((phase_off - angle) / TAU).round() * TAU;
            let off = [phase_off, (amplitude / models).ln(), seen[0] - model[0]];
            let variance = 2.0 / n / amplitude.powi(2);
            let [phase, growth, middle] = slopes;
            cycles.push(Cycle {
                ln_amplitude: (amplitude * unit_rad).ln(),
                phase_rad: 0.5 * (phase_rad[edge[0]] + phase_rad[edge[1]]) - begin,
                rows: [
                    (off[0], phase, variance),
                    (off[1], growth, variance),
                    (off[2], middle, 1.0 / n),
                ],
            });
        }
        let mut rest = Normal::new(numbers);
        let scale = level(&rest_residuals).sqrt().recip();
        rest_columns.iter_mut().flatten().for_each(|v| *v *= scale);
        let columns_of = |all: &[Vec<f64>], from: usize| -> Vec<Vec<f64>> {
            all.iter().map(|c| c[from..].to_vec()).collect()
        };
        // What keeps a law smooth is known without any noise.
        for all in [columns_of(&rest_columns, 0), columns_of(columns, count)] {
            let each: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
            let length = each.first().map_or(0, |c| c.len());
            rest.part(&vec![0.0; length], places, &each);
        }
        if cycles.len() < 2 {
            return None;
        }
        let each = cycles.len().div_ceil(most_groups);
        let groups: Vec<&[Cycle]> = cycles.chunks(each).collect();
        let mean = |of: &dyn Fn(&Cycle) -> f64| -> Vec<f64> {
            groups.iter().map(|g| g.iter().map(of).sum::<f64>() / g.len() as f64).collect()
        };
        let measure = |q: usize| {
            let off = DVector::from_vec(mean(&|c| c.rows[q].0));
            let variance = mean(&|c| c.rows[q].2);
            let variance =
                DVector::from_fn(groups.len(), |g, _| variance[g] / groups[g].len() as f64);
            let mut slopes = DMatrix::zeros(groups.len(), numbers);
            for (j, &at) in places.iter().enumerate() {
                slopes.column_mut(at).copy_from_slice(&mean(&|c| c.rows[q].1[j]));
            }
            Measure { off, slopes, variance }
        };
        Some(Self {
            ln_amplitude: mean(&|c| c.ln_amplitude),
            phase_rad: mean(&|c| c.phase_rad),
            swing: [measure(0), measure(1)],
            middle: measure(2),
            rest: rest.matrix(),
        })
    }
}

/// Of all releases; `None` where one of them does not show enough.
pub(super) fn of_all(
    releases: &[Observed],
    numbers: usize,
    may_be_noise: bool,
) -> Option<Vec<Cycles>> {
    let most_groups = (MAX_GROUPS / releases.len()).max(MIN_GROUPS);
    let of = |release: &Observed| Cycles::new(release, numbers, most_groups, may_be_noise);
    let all: Vec<Option<Cycles>> = releases.iter().par_map(of).collect();
    all.into_iter().collect()
}
