//! Residuals and derivatives as sums, and the evidence of a smooth moment of some size.

use super::shapes::{order, SHAPES, STIFFNESS_SHAPES};
use super::swing::Swing;
use crate::solver::{Normal, Rows};
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Residual over the noise beyond which it is more than noise, whose floor is known to some six per cent.
pub(crate) const ABOVE_NOISE: f64 = 1.1;

/// Sum of squares over the noise of so many residuals that is no more than noise: no further start is tried.
pub fn enough(count: usize) -> f64 {
    ABOVE_NOISE * ABOVE_NOISE * count as f64
}

/// Rows of one release: residuals (model less record) with their derivatives by the model's numbers and by
/// the shapes' strengths, all over the noise.
#[derive(Clone)]
pub(crate) struct Observed {
    pub(crate) residuals: Vec<f64>,
    /// The means among them; what follows keeps a law smooth.
    pub(crate) count: usize,
    /// Of each column but the shapes': its number's place among all.
    pub(crate) places: Vec<usize>,
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) responses: Vec<Vec<f64>>,
    /// The oscillation, where a random moment would show.
    pub(crate) swing: Option<Swing>,
}

impl Observed {
    /// Whether the residuals over the noise are no more than that.
    pub(crate) fn may_be_noise(&self) -> bool {
        let squares: f64 = self.residuals[..self.count].iter().map(|r| r * r).sum();
        squares <= enough(self.count)
    }
}

/// The rows as sums, the model's numbers eliminated.
pub(super) struct Sums {
    count: f64,
    pub(super) numbers: usize,
    used: Vec<usize>,
    /// Of the shapes: what of them no change of the numbers imitates, its product with the residuals, and
    /// theirs.
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
    pub(super) shift: DMatrix<f64>,
    /// R with R'R the inverse of J'J: the columns of JR' are of length 1 and at right angles.
    pub(super) root: DMatrix<f64>,
    /// Half the logarithm of its determinant: what it costs that the numbers are free.
    pub(super) elimination: f64,
}

/// Strengths of the likeliest size, and the variance of the residuals that is left.
pub(super) struct Likeliest {
    /// The sizes, a standard deviation for each shape.
    pub(super) deviations: DVector<f64>,
    strengths: DVector<f64>,
    pub(super) noise: f64,
}

impl Sums {
    pub(super) fn new(releases: &[Observed], numbers: usize) -> Option<Self> {
        let mut normal = Normal::new(numbers + SHAPES);
        for release in releases {
            let Observed { residuals, places, columns, responses, .. } = release;
            let places: Vec<usize> =
                places.iter().copied().chain((0..SHAPES).map(|k| numbers + k)).collect();
            let columns: Vec<&[f64]> = columns.iter().chain(responses).map(Vec::as_slice).collect();
            normal.part(residuals, &places, &columns);
        }
        if !normal.is_finite() {
            return None;
        }
        let (all, slope) = (normal.matrix(), normal.gradient());
        let used: Vec<usize> = (0..numbers).filter(|&i| all[(i, i)] > 0.0).collect();
        let m = used.len();
        // To columns of length 1: units do not matter then.
        let size: Vec<f64> = used.iter().map(|&i| all[(i, i)].sqrt()).collect();
        let own = DMatrix::from_fn(m, m, |a, b| {
            let ridge = if a == b { 1.0 + 1e-12 } else { 1.0 };
            all[(used[a], used[b])] / (size[a] * size[b]) * ridge
        });
        let cross = DMatrix::from_fn(m, SHAPES, |a, k| all[(used[a], numbers + k)] / size[a]);
        let own_slope = DVector::from_fn(m, |a, _| slope[used[a]] / size[a]);
        let own = Cholesky::new(own)?;
        let logs = |v: &mut dyn Iterator<Item = f64>| v.map(f64::ln).sum::<f64>();
        let elimination =
            logs(&mut own.l().diagonal().iter().copied()) + logs(&mut size.iter().copied());
        let solved = own.solve(&cross);
        let mut shift = DMatrix::zeros(numbers, SHAPES);
        for (a, &i) in used.iter().enumerate() {
            for k in 0..SHAPES {
                shift[(i, k)] = solved[(a, k)] / size[a];
            }
        }
        let scaled = own.l().try_inverse()?;
        let mut root = DMatrix::zeros(m, numbers);
        for (a, &i) in used.iter().enumerate() {
            root.column_mut(i).copy_from(&(scaled.column(a) / size[a]));
        }
        let count = releases.iter().map(|r| r.count).sum::<usize>() as f64;
        let matrix = all.view((numbers, numbers), (SHAPES, SHAPES)) - cross.transpose() * &solved;
        // Record less model.
        let gradient = solved.transpose() * &own_slope - slope.rows(numbers, SHAPES);
        let squares = normal.sum_of_squares() - own_slope.dot(&own.solve(&own_slope));
        let enough = count > (m + SHAPES) as f64 && squares > 0.0;
        enough.then_some(Self {
            count,
            numbers,
            used,
            matrix,
            gradient,
            squares,
            shift,
            root,
            elimination,
        })
    }

    /// The strengths parted along the combinations of shapes that are seen independently of each other: the
    /// principal axes of what the residual tells of strengths of these sizes.
    pub(super) fn apart(&self, found: &Likeliest) -> DMatrix<f64> {
        let Likeliest { deviations, strengths, .. } = found;
        let seen = SymmetricEigen::new(self.scaled(deviations));
        let whitened = strengths.zip_map(deviations, |s, d| if d > 0.0 { s / d } else { 0.0 });
        let along = seen.eigenvectors.transpose() * whitened;
        DMatrix::from_diagonal(deviations) * seen.eigenvectors * DMatrix::from_diagonal(&along)
    }

    fn scaled(&self, deviations: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(SHAPES, SHAPES, |i, j| self.matrix[(i, j)] * deviations[i] * deviations[j])
    }

    /// Logarithm of the evidence for strengths of these `deviations`, with the strengths and the noise at
    /// their best, `share` of the residuals being independent.
    pub(super) fn evidence(
        &self,
        deviations: DVector<f64>,
        share: f64,
    ) -> Option<(f64, Likeliest)> {
        let freedom = self.count - self.used.len() as f64;
        let scaled = self.scaled(&deviations);
        let pull = self.gradient.component_mul(&deviations);
        let at = |noise: f64| {
            let weight = share / noise;
            let posterior = Cholesky::new(&scaled * weight + DMatrix::identity(SHAPES, SHAPES))?;
            let own = posterior.solve(&(&pull * weight));
            let left = self.squares - 2.0 * own.dot(&pull) + own.dot(&(&scaled * &own));
            Some((posterior, own, left))
        };
        // Strengths that explain more leave less noise, which settles in a few rounds.
        let mut noise = self.squares / freedom;
        for _ in 0..4 {
            noise = at(noise)?.2.max(f64::MIN_POSITIVE) / freedom;
        }
        let (posterior, own, left) = at(noise)?;
        let evidence = -0.5 * freedom * share * noise.ln()
            - 0.5 * own.norm_squared()
            - posterior.l().diagonal().iter().map(|d| d.ln()).sum::<f64>()
            - 0.5 * left * share / noise;
        let strengths = own.component_mul(&deviations);
        Some((evidence, Likeliest { deviations, strengths, noise }))
    }

    /// The sizes of the discrepancy that make the residuals likeliest; none where either gains less than
    /// `needed`.
    pub(super) fn likeliest(&self, share: f64, needed: f64) -> Option<Likeliest> {
        // None, or from a millionth of the spring's moment to all of it, even in the logarithm.
        let size = |step: u8| match step {
            0 => 0.0,
            _ => f64::powf(1e-6, 1.0 - f64::from(step - 1) / 19.0),
        };
        let deviations = |stiffness: u8, damping: u8| {
            DVector::from_fn(SHAPES, |k, _| {
                size(if k < STIFFNESS_SHAPES { stiffness } else { damping }) / order(k)
            })
        };
        let (none, plain) = self.evidence(deviations(0, 0), share)?;
        let steps = (0..=20).flat_map(|k| (0..=20).map(move |d| (k, d)));
        let best = steps
            .filter_map(|(k, d)| {
                let cost = needed * f64::from(u8::from(k > 0) + u8::from(d > 0));
                let (evidence, found) = self.evidence(deviations(k, d), share)?;
                Some((evidence - cost, found))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        Some(best.filter(|b| b.0 > none).map_or(plain, |b| b.1))
    }

    /// What the model with the discrepancy leaves of each release.
    pub(super) fn left(&self, releases: &[Observed], likeliest: &Likeliest) -> Vec<Vec<f64>> {
        let mut moved = DVector::zeros(self.numbers + SHAPES);
        moved.rows_mut(0, self.numbers).copy_from(&(-&self.shift * &likeliest.strengths));
        moved.rows_mut(self.numbers, SHAPES).copy_from(&likeliest.strengths);
        let of = |release: &Observed| {
            let mut left = release.residuals[..release.count].to_vec();
            let shapes = (self.numbers..).zip(&release.responses);
            for (at, column) in release.places.iter().copied().zip(&release.columns).chain(shapes) {
                left.iter_mut().zip(column).for_each(|(left, c)| *left += moved[at] * c);
            }
            left
        };
        releases.iter().map(of).collect()
    }
}
