//! Sizes of what a model may lack, and under them the posterior of its numbers.

use super::cycles::{Left, Measure};
use super::kernels::Kernels;
use crate::bic;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

/// Sizes that are tried, logarithms to the root of 10: of p and q, and of the moment as the phase that it adds
/// within a radian at the largest amplitude, over the noise's standard deviation.
const SIZES: std::ops::RangeInclusive<i32> = -12..=2;
/// The same of what moves the mid-line, over the standard deviation that noise gives it.
const MIDDLE_SIZES: std::ops::RangeInclusive<i32> = 0..=8;
/// Of a smooth process's covariance: what rounding may take off.
const ROUNDING: f64 = 1e-9;
/// Gain of the log marginal likelihood above which something is believed that need not be: half of the difference of BIC
/// that effects need.
const NEEDED: f64 = 0.5 * bic::MARGIN;
/// Logarithm of the posterior probability, over the largest, of sizes below which they are left out.
const NEGLIGIBLE: f64 = -7.0;

fn root_ten(power: i32) -> f64 {
    10f64.powf(0.5 * f64::from(power))
}

/// No size and those that are tried, with the logarithm of what each is worth beforehand: all of them together
/// 1, none at all as much as is said.
fn tried(sizes: std::ops::RangeInclusive<i32>, none: f64) -> Vec<(f64, f64)> {
    let each = -(sizes.clone().count() as f64).ln();
    std::iter::once((0.0, none)).chain(sizes.map(|power| (root_ten(power), each))).collect()
}

/// What some rows tell of the numbers under a covariance of their own.
#[derive(Clone)]
pub(super) struct Told {
    pub(super) matrix: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    pub(super) squares: f64,
    /// Logarithm of the covariance's determinant.
    pub(super) logs: f64,
    pub(super) root: Cholesky<f64, Dyn>,
}

impl Told {
    pub(super) fn new(rows: &Measure, covariance: DMatrix<f64>) -> Option<Self> {
        let root = Cholesky::new(covariance)?;
        let slopes = root.l().solve_lower_triangular(&rows.slopes)?;
        let off = root.l().solve_lower_triangular(&rows.off)?;
        Some(Self {
            matrix: slopes.tr_mul(&slopes),
            gradient: slopes.tr_mul(&off),
            squares: off.norm_squared(),
            logs: 2.0 * root.l().diagonal().iter().map(|d| d.ln()).sum::<f64>(),
            root,
        })
    }
}

/// What the mid-line tells, with the process and the noise that make it likeliest.
pub(super) fn of_middle(rows: &Measure, process: &DMatrix<f64>) -> Option<Told> {
    let noise = rows.variance.mean();
    let n = rows.off.len() as f64;
    let of = |(size, prior): (f64, f64)| {
        let mut covariance = process * (size * size * noise);
        covariance.set_diagonal(&(covariance.diagonal() * (1.0 + ROUNDING) + &rows.variance));
        let told = Told::new(rows, covariance)?;
        let level = (told.squares / n).max(1.0);
        let log_marginal_likelihood =
            prior - 0.5 * (told.logs + n * level.ln() + told.squares / level);
        let (matrix, gradient) = (&told.matrix / level, &told.gradient / level);
        Some((log_marginal_likelihood, Told { matrix, gradient, ..told }))
    };
    let best = tried(MIDDLE_SIZES, 0.0).into_iter().filter_map(of);
    best.max_by(|a, b| a.0.total_cmp(&b.0)).map(|best| best.1)
}

/// Sizes of the processes of frequency and damping, and of the random moment.
pub(super) struct Sizes {
    pub(super) each: [Vec<(f64, f64)>; 3],
    left: Left,
}

/// Which of each.
pub(super) type Place = [usize; 3];

impl Sizes {
    /// Where what is left is noise it has to be shown that a law is missing; and that the rig is shaken where it
    /// is known what is noise.
    pub(super) fn new(left: Left) -> Self {
        let needed = |is_needed: bool| tried(SIZES, if is_needed { NEEDED } else { 0.0 });
        let law = needed(left == Left::Noise);
        Self { each: [law.clone(), law, needed(left != Left::Unknown)], left }
    }
    /// What they are worth beforehand; none where the rig is not shaken and lacks no law, but more than noise
    /// is left.
    pub(super) fn prior(&self, at: Place) -> Option<f64> {
        let is_possible = self.left != Left::More || at[2] > 0 || at[0] > 0 && at[1] > 0;
        is_possible.then(|| at.iter().zip(&self.each).map(|(k, sizes)| sizes[*k].1).sum())
    }
}

/// What phase and amplitude tell under sizes that have been asked for.
pub(super) struct Tolds<'a> {
    pub(super) swing: &'a [Measure; 2],
    pub(super) kernels: &'a Kernels,
    pub(super) sizes: &'a Sizes,
    pub(super) known: RefCell<HashMap<[usize; 3], Option<Arc<Told>>>>,
}

impl Tolds<'_> {
    pub(super) fn at(&self, [phase, amplitude, random]: Place) -> Option<[Arc<Told>; 2]> {
        Some([self.of(0, phase, random)?, self.of(1, amplitude, random)?])
    }
    pub(super) fn of(&self, q: usize, law: usize, random: usize) -> Option<Arc<Told>> {
        let told = || {
            let [law, random] = [self.sizes.each[q][law].0, self.sizes.each[2][random].0];
            let Kernels { summed, random: shaken, .. } = self.kernels;
            let mut covariance = summed * (law * law) + shaken * (random * random);
            let diagonal = covariance.diagonal() * (1.0 + ROUNDING) + &self.swing[q].variance;
            covariance.set_diagonal(&diagonal);
            Told::new(&self.swing[q], covariance).map(Arc::new)
        };
        self.known.borrow_mut().entry([q, law, random]).or_insert_with(told).clone()
    }
}

/// Every place whose `worth` is not negligible beside the largest, with it, and the largest: from the best of
/// a coarse grid on to neighbours.
pub(super) fn likeliest(
    sizes: &Sizes,
    worth: impl Fn(Place) -> Option<f64>,
) -> (Vec<(Place, f64)>, f64) {
    let mut known: HashMap<Place, Option<f64>> = HashMap::new();
    let coarse = |k: usize| (0..sizes.each[k].len()).filter(|i| *i == 0 || i % 4 == 1);
    let mut next: Vec<Place> = coarse(0)
        .flat_map(|p| coarse(1).flat_map(move |a| coarse(2).map(move |r| [p, a, r])))
        .collect();
    let mut most = f64::NEG_INFINITY;
    while !next.is_empty() {
        for at in next {
            let found = worth(at).filter(|v| v.is_finite());
            most = most.max(found.unwrap_or(most));
            known.insert(at, found);
        }
        let near = known.iter().filter(|(_, v)| v.is_some_and(|v| v > most + NEGLIGIBLE));
        let around = |(at, _): (&Place, &Option<f64>)| {
            let at = *at;
            (0..3).flat_map(move |k| {
                [1, usize::MAX].map(|by| {
                    let mut at = at;
                    at[k] = at[k].wrapping_add(by);
                    at
                })
            })
        };
        let mut around: Vec<Place> = near
            .flat_map(around)
            .filter(|at| (0..3).all(|k| at[k] < sizes.each[k].len()) && !known.contains_key(at))
            .collect();
        around.sort_unstable();
        around.dedup();
        next = around;
    }
    let mut each: Vec<(Place, f64)> = known
        .into_iter()
        .filter_map(|(at, v)| Some((at, v.filter(|v| *v > most + NEGLIGIBLE)?)))
        .collect();
    each.sort_unstable_by_key(|(at, _)| *at);
    (each, most)
}

/// Truth less fit under given sizes.
pub(super) struct Posterior {
    pub(super) log_marginal_likelihood: f64,
    pub(super) off: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Variance of the noise of phase and amplitude over that of white noise at the floor.
    pub(super) level: f64,
}

impl Posterior {
    pub(super) fn new(told: [&Told; 2], known: &DMatrix<f64>, pull: &DVector<f64>) -> Option<Self> {
        let n = 2.0 * told[0].root.l_dirty().nrows() as f64;
        let matrix = &told[0].matrix + &told[1].matrix;
        let gradient = &told[0].gradient + &told[1].gradient;
        let squares = told[0].squares + told[1].squares;
        let used: Vec<usize> =
            (0..known.nrows()).filter(|&i| matrix[(i, i)] + known[(i, i)] > 0.0).collect();
        let at = |level: f64| {
            let all = &matrix / level + known;
            let size: Vec<f64> = used.iter().map(|&i| all[(i, i)].sqrt()).collect();
            let scaled = DMatrix::from_fn(used.len(), used.len(), |a, b| {
                let ridge = if a == b { 1.0 + 1e-12 } else { 1.0 };
                all[(used[a], used[b])] / (size[a] * size[b]) * ridge
            });
            let root = Cholesky::new(scaled)?;
            let slope = &gradient / level + pull;
            let slope = DVector::from_fn(used.len(), |a, _| slope[used[a]] / size[a]);
            let off = root.solve(&slope);
            let mut full = DVector::zeros(known.nrows());
            used.iter().zip(off.iter()).zip(&size).for_each(|((&i, v), s)| full[i] = v / s);
            Some((root, size, full, off.dot(&slope)))
        };
        let freedom = (n - used.len() as f64).max(1.0);
        let mut level = (squares / n).max(1.0);
        for _ in 0..3 {
            let full = at(level)?.2;
            let left = squares - 2.0 * full.dot(&gradient) + full.dot(&(&matrix * &full));
            level = (left / freedom).max(1.0);
        }
        let (root, size, off, gained) = at(level)?;
        let logs = |v: &mut dyn Iterator<Item = f64>| 2.0 * v.map(f64::ln).sum::<f64>();
        let own =
            logs(&mut root.l_dirty().diagonal().iter().copied()) + logs(&mut size.iter().copied());
        let log_marginal_likelihood =
            -0.5 * (told[0].logs + told[1].logs + n * level.ln() + squares / level - gained + own);
        let inverse = root.inverse();
        let mut covariance = DMatrix::zeros(known.nrows(), known.nrows());
        for (a, &i) in used.iter().enumerate() {
            for (b, &j) in used.iter().enumerate() {
                covariance[(i, j)] = inverse[(a, b)] / (size[a] * size[b]);
            }
        }
        Some(Self { log_marginal_likelihood, off, covariance, level })
    }
}
