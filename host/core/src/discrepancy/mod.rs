//! By how much the numbers of a fit may be off because no model is the rig: the law discrepancy, and a moment
//! in time ([`random`]).
//!
//! Beside its effects the true equation of motion has a smooth moment that no effect of the model is,
//!
//! b'' = ... - wn^2 A sum_i delta_i f_i((b - rest) / A, r / (wn A)),   delta_i ~ N(0, tau^2 / order_i^2),
//!
//! A being the largest amplitude. Shapes f_i of the restoring moment have a flat tangent at rest, so that wn
//! stays that of small motions; of the dissipation one is the jump of dry friction, the others have a flat
//! tangent, too. Their size tau, one for stiffness and one for damping, is what makes the residual likeliest
//! (its evidence, the numbers of the model and the strengths integrated out: M. C. Kennedy, A. O'Hagan, J. R.
//! Stat. Soc. B 63, 2001), residuals counted by the correlation of what is then left of them. Least squares
//! knows nothing of it: a strength delta puts an error (J'J)^-1 J'Phi delta into its numbers, Phi being the
//! readings' derivatives by the strengths. Each combination of strengths that the residual tells from the
//! others, whatever the shapes they are written in, counts as an error as large as the residual shows it, of
//! a sign that is not known; the noise adds what is left of the residual. Where the residual is noise there
//! is no discrepancy, and nothing is added; where a random moment is the likelier cause there is no law.
//!
//! With the strengths' whole prior in place of what is seen of them, uncertainties come out several times too
//! wide: shapes that an effect of the model imitates are seen by nothing.

mod random;

use self::random::Shaken;
pub(crate) use self::random::Swing;
use crate::effects::{Moment, State};
use crate::motion::simulate::{readings_of_all, Grid, Motion};
use crate::solver::{Normal, Rows};
use crate::statistics::independent_share;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Shapes of the restoring moment, then of the dissipation.
pub(crate) const SHAPES: usize = STIFFNESS + DAMPING;
const STIFFNESS: usize = 5;
const DAMPING: usize = 4;
/// Shapes end where the record does: beyond it they are held.
const REACH: f64 = 1.2;
/// Rate, as a share of the largest, over which dry friction changes its sign: a twentieth of the smallest
/// amplitudes that are analysed as a rule (a tenth of the largest).
const JUMP: f64 = 0.005;
/// Sizes tried, as shares of the spring's moment: from a millionth to all of it, even in the logarithm.
const SIZES: usize = 20;
const SMALLEST: f64 = 1e-6;
/// Gain of evidence (in ln) above which a discrepancy is believed where the residual may be noise: half of
/// the difference of BIC that effects need. Where it is more than the noise something is missing, and the
/// likeliest is taken.
const BELIEVED: f64 = 0.5 * crate::bic::MARGIN;
/// Rounds in which strengths and noise settle.
const ROUNDS: usize = 4;
/// Residual over the noise beyond which it is more than noise, whose floor is known to some six per cent.
pub(crate) const ABOVE_NOISE: f64 = 1.1;
/// Share of residuals that count while their correlation is not known yet.
const AT_FIRST: f64 = 0.2;

/// A moment beside the model's effects: which, its strength (rad/s2), the largest angle and rate, and the
/// rest angle.
struct Shape;

impl Moment for Shape {
    #[inline]
    fn moment(p: &[f64], s: &State) -> f64 {
        -p[1] * shape(p[0] as usize, (s.yaw_rad - p[4]) / p[2], s.rate_rad_s / p[3])
    }
}

/// Adds shape `which` about the rest angle of `motion`, with a strength as a share of the spring's moment at
/// `yaw_rad`, the largest angle from there.
pub(crate) fn add_shape(motion: &mut Motion, which: usize, strength: f64, yaw_rad: f64) {
    let (wn, rest_rad) = (motion.natural_frequency_rad_s, motion.rest_rad());
    let strength_rad_s2 = strength * wn * wn * yaw_rad;
    let numbers = [which as f64, strength_rad_s2, yaw_rad, wn * yaw_rad, rest_rad];
    motion.terms.add_moment::<Shape>(&numbers);
}

/// Of the angle Legendre's polynomials less their tangent at zero, and abs(b) b; of the rate Chebyshev's less
/// theirs, abs(r) r, and dry friction.
fn shape(which: usize, angle: f64, rate: f64) -> f64 {
    let (u, v) = (angle.clamp(-REACH, REACH), rate.clamp(-REACH, REACH));
    let (u2, v2) = (u * u, v * v);
    match which {
        0 => 1.5 * u2,
        1 => 2.5 * u2 * u,
        2 => u2 * (35.0 * u2 - 30.0) / 8.0,
        3 => u.abs() * u,
        4 => u2 * ((231.0 * u2 - 315.0) * u2 + 105.0) / 16.0,
        5 => 4.0 * v2 * v,
        6 => v2 * v * (16.0 * v2 - 20.0),
        7 => v.abs() * v,
        _ => v / (v2 + JUMP * JUMP).sqrt(),
    }
}

/// How much smaller each shape is expected to be than the first: rougher ones less likely.
fn order(which: usize) -> f64 {
    [1.0, 1.0, 2.0, 1.0, 4.0, 1.0, 2.0, 1.0, 1.0][which]
}

/// What is not in the model, as far as the residual shows how large it is.
#[derive(Clone, Debug)]
pub(crate) struct Discrepancy {
    /// Strengths of the shapes, shares of the spring's moment at the largest amplitude: a column for each
    /// combination of shapes that the residual tells from the others.
    pub(crate) strengths: DMatrix<f64>,
    /// Derivatives of the fitted numbers by the strengths: a row for each number of the fit, a column for
    /// each shape.
    pub(crate) shift: DMatrix<f64>,
    /// Covariance that a random moment beside the model puts into the fitted numbers.
    pub(crate) random: DMatrix<f64>,
    /// Variance of what is left of the residuals over the noise, each counted as one of so many independent.
    pub(crate) left: f64,
}

impl Discrepancy {
    /// The covariance that it adds to the fitted numbers.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        self.of_law() + &self.random
    }

    /// What of it the smooth moment adds.
    pub(crate) fn of_law(&self) -> DMatrix<f64> {
        let moved = &self.shift * &self.strengths;
        &moved * moved.transpose()
    }

    /// That of one of several releases, whose numbers have these `places` among all.
    pub(crate) fn of_release(&self, places: &[usize]) -> Self {
        let n = places.len();
        let random = DMatrix::from_fn(n, n, |a, b| self.random[(places[a], places[b])]);
        let shift = DMatrix::from_fn(n, SHAPES, |a, k| self.shift[(places[a], k)]);
        Self { shift, random, ..self.clone() }
    }

    fn is_none(&self) -> bool {
        self.strengths.iter().chain(self.random.iter()).all(|v| *v == 0.0)
    }
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
        squares <= ABOVE_NOISE * ABOVE_NOISE * self.count as f64
    }
}

/// Derivatives of the readings of `motion` by the strength of each shape, as a share of the spring's moment
/// at `yaw_rad`; `step` is that of the differences.
pub(crate) fn responses(motion: &Motion, grid: &Grid, yaw_rad: f64, step: f64) -> Vec<Vec<f64>> {
    let moved = |(which, strength): (usize, f64)| {
        let mut motion = motion.clone();
        add_shape(&mut motion, which, strength, yaw_rad);
        motion
    };
    // The plain one with a strength of nothing: all are followed side by side.
    let all = std::iter::once((0, 0.0)).chain((0..SHAPES).map(|which| (which, step)));
    let motions: Vec<Motion> = all.map(moved).collect();
    let mut readings = vec![vec![0.0; grid.count]; motions.len()];
    readings_of_all(&motions, grid, &mut readings);
    let mut changed = readings.split_off(1);
    for y in &mut changed {
        y.iter_mut().zip(&readings[0]).for_each(|(y, plain)| *y = (*y - plain) / step);
    }
    changed
}

/// What a model of so many `numbers`, fitted to `releases`, lacks; `may_be_noise`: all that is left. `None`
/// where it lacks nothing that shows: too few residuals as well, or numbers that they do not determine.
pub(crate) fn of(releases: &[Observed], numbers: usize, may_be_noise: bool) -> Option<Discrepancy> {
    let sums = Sums::new(releases, numbers)?;
    let needed = if may_be_noise { BELIEVED } else { 0.0 };
    let first = sums.likeliest(AT_FIRST, needed)?;
    let share = independent_share(correlation(&sums.left(releases, &first)));
    let law = sums.likeliest(share, needed)?;
    let none = sums.evidence(DVector::zeros(SHAPES), share)?.1;
    let shaken = |law: &Likeliest| Shaken::of(releases, numbers, &law.deviations, needed);
    let evidence = |s: &Option<Shaken>| s.as_ref().map_or(f64::NEG_INFINITY, |s| s.evidence);
    let (beside_law, alone) = (shaken(&law), shaken(&none));
    let is_law = evidence(&beside_law) >= evidence(&alone);
    let (shaken, best) = if is_law { (beside_law, law) } else { (alone, none) };
    let random = shaken
        .and_then(|shaken| shaken.covariance(releases, &sums.root))
        .unwrap_or_else(|| DMatrix::zeros(numbers, numbers));
    let strengths = sums.apart(&best);
    let found = Discrepancy { strengths, shift: sums.shift, random, left: best.noise / share };
    Some(found).filter(|found| !found.is_none())
}

/// Lag-one correlation of what is `left` of all releases.
fn correlation(left: &[Vec<f64>]) -> f64 {
    let lag: f64 = left.iter().flat_map(|left| left.windows(2).map(|w| w[0] * w[1])).sum();
    let power: f64 = left.iter().flatten().map(|r| r * r).sum();
    if power > 0.0 {
        lag / power
    } else {
        0.0
    }
}

/// The rows as sums, the model's numbers eliminated.
struct Sums {
    count: f64,
    numbers: usize,
    used: Vec<usize>,
    /// Of the shapes: what of them no change of the numbers imitates, its product with the residuals, and
    /// theirs.
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
    shift: DMatrix<f64>,
    /// R with R'R the inverse of J'J: the columns of JR' are of length 1 and at right angles.
    root: DMatrix<f64>,
    /// Half the logarithm of its determinant: what it costs that the numbers are free.
    elimination: f64,
}

/// Strengths of the likeliest size, and the variance of the residuals that is left.
struct Likeliest {
    /// The sizes, a standard deviation for each shape.
    deviations: DVector<f64>,
    strengths: DVector<f64>,
    noise: f64,
}

impl Sums {
    fn new(releases: &[Observed], numbers: usize) -> Option<Self> {
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
    fn apart(&self, found: &Likeliest) -> DMatrix<f64> {
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
    fn evidence(&self, deviations: DVector<f64>, share: f64) -> Option<(f64, Likeliest)> {
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
        for _ in 0..ROUNDS {
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
    fn likeliest(&self, share: f64, needed: f64) -> Option<Likeliest> {
        let size = |step: usize| match step {
            0 => 0.0,
            _ => SMALLEST.powf(1.0 - (step - 1) as f64 / (SIZES - 1) as f64),
        };
        let deviations = |stiffness: usize, damping: usize| {
            DVector::from_fn(SHAPES, |k, _| {
                size(if k < STIFFNESS { stiffness } else { damping }) / order(k)
            })
        };
        let (none, plain) = self.evidence(deviations(0, 0), share)?;
        let steps = (0..=SIZES).flat_map(|k| (0..=SIZES).map(move |d| (k, d)));
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
    fn left(&self, releases: &[Observed], likeliest: &Likeliest) -> Vec<Vec<f64>> {
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

#[cfg(test)]
mod tests;
