//! Pieces of free decays, each with an initial condition of its own.

use crate::fit::free_decay::FreeDecay;
use crate::fit::layout::Layout;
use crate::fit::part::DIFFERENCE;
use crate::fit::structure::{Structure, WN, ZERO, ZETA};
use crate::motion::simulate::readings_of_all;
use crate::par_map::ParMap;
use crate::solver::blocks::damped_inverse;
use crate::solver::descent::{descend, Attempt, Damping, Descent, Ended};
use crate::stop::Stop;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use std::ops::{Deref, Range};
use std::sync::Arc;

/// A piece of a free decay.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) decay: FreeDecay,
    /// The release that it is of, among those that are fitted at once.
    pub(crate) release: usize,
    /// Of each of those: the ones of one number have natural frequency and damping ratio in common.
    pub(crate) modal: Arc<[usize]>,
}

impl Deref for Piece {
    type Target = FreeDecay;

    fn deref(&self) -> &FreeDecay {
        &self.decay
    }
}

impl Piece {
    /// All of a release that is fitted alone.
    pub(crate) fn whole(decay: &FreeDecay) -> Self {
        Self { decay: decay.clone(), release: 0, modal: Arc::new([0]) }
    }

    /// Where the numbers of a fit of `structure` to `pieces` are.
    pub(crate) fn layout(pieces: &[&Self], structure: &Structure) -> Layout {
        let release = pieces.iter().map(|piece| piece.release).collect();
        Layout::of_pieces(structure, &pieces[0].modal, release)
    }

    /// Its state at the first instant as its first means show it under a model.
    pub(crate) fn begun(&self, structure: &Structure, common: &[f64]) -> [f64; 2] {
        let p = Self::layout(&[self], structure).numbers(0, common, [0.0, 0.0]);
        let zero = if structure.zero_unknown { p[ZERO] } else { 0.0 };
        first_state(self, zero, [p[WN], p[ZETA]])
    }
}

/// Consecutive pieces of free decays.
pub(crate) struct Pieces {
    pub(crate) decays: Vec<Piece>,
}

impl Pieces {
    /// `count` pieces of the same length.
    pub(crate) fn new(decay: &FreeDecay, count: usize) -> Self {
        let n = decay.yaw_rad.len();
        let edge = |k: usize| k * n / count;
        Self::with(decay, (0..count).map(|k| edge(k)..edge(k + 1)).collect())
    }

    /// `count` pieces of the same length from beginning to end, of `most` means together at most: with gaps
    /// between them where the free decay has more.
    pub(crate) fn spread(decay: &FreeDecay, count: usize, most: usize) -> Self {
        let n = decay.yaw_rad.len();
        if n <= most || count < 2 {
            return Self::new(decay, count);
        }
        let length = most / count;
        let begin = |k: usize| k * (n - length) / (count - 1);
        Self::with(decay, (0..count).map(|k| begin(k)..begin(k) + length).collect())
    }

    fn with(decay: &FreeDecay, ranges: Vec<Range<usize>>) -> Self {
        let modal: Arc<[usize]> = Arc::new([0]);
        let piece = |range: &Range<usize>| {
            let decay = FreeDecay {
                smooth: decay.smooth.saturating_sub(range.start).min(range.len()),
                grid: crate::motion::simulate::Grid {
                    start_s: decay.grid.time_s(range.start),
                    count: range.len(),
                    ..decay.grid
                },
                yaw_rad: decay.yaw_rad[range.clone()].to_vec(),
                windows: Vec::new(),
                ..decay.clone()
            };
            Piece { decay, release: 0, modal: modal.clone() }
        };
        Self { decays: ranges.iter().map(piece).collect() }
    }

    pub(crate) fn count(&self) -> usize {
        self.decays.len()
    }

    /// The state of each that fits best under given common numbers.
    pub(crate) fn states(&self, structure: &Structure, common: &[f64]) -> Vec<[f64; 2]> {
        let state =
            |piece: &Piece| fit_state(piece, structure, common, piece.begun(structure, common)).0;
        self.decays.iter().par_map(state).collect()
    }

    /// Means of all pieces.
    pub(crate) fn means(&self) -> usize {
        self.decays.iter().map(|piece| piece.yaw_rad.len()).sum()
    }
}

/// Angle and rate at the beginning of a piece from a cubic through its first means, `zero` taken off, as a
/// plain oscillation has them.
fn first_state(piece: &FreeDecay, zero: f64, [wn, zeta]: [f64; 2]) -> [f64; 2] {
    // From the first 0.15 of a cycle.
    let n = ((0.15 * piece.per_cycle()) as usize).clamp(4, 60).min(piece.yaw_rad.len());
    let h = 1.0 / n as f64;
    let a = DMatrix::from_fn(n, 4.min(n), |k, j| (k as f64 * h).powi(j as i32));
    let y = DVector::from_fn(n, |k, _| piece.yaw_rad[k] - zero);
    let fit = (a.transpose() * &a).cholesky().map(|c| c.solve(&(a.transpose() * y)));
    let read = fit.map_or([piece.yaw_rad[0] - zero, 0.0], |c| [c[0], c[1] * h / piece.grid.step_s]);
    piece.measurand.derivative().state(read, wn, zeta)
}

/// A piece's state, and the sums of its residuals over it: matrix, gradient, squares (rad2).
type OfState = ([f64; 2], Matrix2<f64>, Vector2<f64>, f64);

/// A fit of a piece's state on its way.
struct StateFit<F> {
    sums: F,
    here: OfState,
    there: OfState,
    tries: usize,
    stop: Stop,
}

impl<F: Fn([f64; 2]) -> OfState> Descent for StateFit<F> {
    fn arrived(&mut self) -> Option<Ended> {
        None
    }
    fn step(&mut self, damping: f64) -> Attempt {
        let used_up = self.tries == 0;
        if used_up || self.stop.is_requested() {
            return Attempt::Ended(if used_up {
                Ended::MaxEvaluations
            } else {
                Ended::Interrupted
            });
        }
        self.tries -= 1;
        let (x, h, g, _) = &self.here;
        let Some(step) = damped_inverse(*h, damping).map(|inverse| inverse * g) else {
            return Attempt::Ended(Ended::NoStep);
        };
        self.there = (self.sums)([x[0] - step[0], x[1] - step[1]]);
        Attempt::Promises(step.dot(g))
    }
    fn gain(&mut self) -> Option<f64> {
        Some(self.here.3 - self.there.3)
    }
    fn is_last(&self, promised: f64, gained: Option<f64>) -> bool {
        match gained.filter(|gained| *gained > 0.0) {
            Some(gained) => gained < 1e-6 * self.there.3,
            None => promised < 1e-6 * self.here.3,
        }
    }
    fn take(&mut self) {
        self.here = self.there;
    }
    fn relaxation(&self, _kept: f64) -> f64 {
        0.1
    }
}

/// The state of `piece` that fits best under given common numbers, and its sum of squares (rad2), infinite
/// where it has no course or is stopped.
pub(crate) fn fit_state(
    piece: &Piece,
    structure: &Structure,
    common: &[f64],
    start: [f64; 2],
) -> ([f64; 2], f64) {
    let layout = Piece::layout(&[piece], structure);
    let wn_rad_s = common[layout.modal(0)];
    let steps = [DIFFERENCE * piece.amplitude_rad, DIFFERENCE * piece.amplitude_rad * wn_rad_s];
    let sums = |x: [f64; 2]| {
        let moved = [x, [x[0] + steps[0], x[1]], [x[0], x[1] + steps[1]]];
        let mut zero = 0.0;
        let motions = moved.map(|x| {
            let (motion, z) = structure.motion(&layout.numbers(0, common, x), piece.around());
            zero = z;
            motion
        });
        let readings = readings_of_all(&motions, &piece.grid);
        let (mut h, mut g, mut s) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        for (k, y) in piece.yaw_rad.iter().enumerate() {
            let e = readings[0][k] + zero - y;
            let d = Vector2::new(
                (readings[1][k] - readings[0][k]) / steps[0],
                (readings[2][k] - readings[0][k]) / steps[1],
            );
            s += e * e;
            g += d * e;
            h += d * d.transpose();
        }
        (x, h, g, s)
    };
    let here = sums(start);
    if !here.3.is_finite() {
        return (start, f64::INFINITY);
    }
    // A model that cannot follow its piece is not done after so many tries, and would predict otherwise with more.
    let mut fit = StateFit { sums, here, there: here, tries: 25, stop: piece.stop.clone() };
    descend(&mut fit, Damping::new(1e-6, [0.0, f64::INFINITY]).raised_to(1e-4).tenfold());
    let squares = if piece.stop.is_requested() { f64::INFINITY } else { fit.here.3 };
    (fit.here.0, squares)
}
