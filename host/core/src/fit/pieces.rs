//! Pieces of free decays, each with an initial condition of its own, and where a release's own numbers are.

use crate::at_once::AtOnce;
use crate::fit::free_decay::FreeDecay;
use crate::fit::problem::DIFFERENCE;
use crate::fit::structure::Structure;
use crate::motion::simulate::readings_of_all;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use std::ops::{Deref, Range};

/// Where a release has its own numbers among the common ones of a fit to several: behind the first release's
/// wn, zeta and rest angle, before the effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Own {
    /// Of the natural frequency; the damping ratio is next.
    pub(crate) modal: usize,
    pub(crate) rest: usize,
    /// How many there are beyond the first release's.
    pub(crate) more: usize,
}

impl Own {
    /// Of a release that is fitted alone.
    pub(crate) const ALONE: Self = Self { modal: 0, rest: 2, more: 0 };

    /// Of a number in the order of [`crate::fit::fitting::Fitted`]; none for the state.
    pub(crate) fn place(&self, j: usize, structure: &Structure) -> Option<usize> {
        match j {
            0 | 1 => Some(self.modal + j),
            2 | 3 => None,
            4 if structure.zero_unknown => Some(self.rest),
            _ => Some(j - 2 + self.more),
        }
    }

    /// Numbers in the order of [`crate::fit::fitting::Fitted`].
    pub(crate) fn numbers(
        &self,
        structure: &Structure,
        common: &[f64],
        state: [f64; 2],
    ) -> Vec<f64> {
        let mut p = common[self.modal..self.modal + 2].to_vec();
        p.extend(state);
        p.extend(structure.zero_unknown.then(|| common[self.rest]));
        p.extend(&common[structure.own_numbers() - 2 + self.more..]);
        p
    }
}

/// A piece of a free decay.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) decay: FreeDecay,
    pub(crate) own: Own,
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
        Self { decay: decay.clone(), own: Own::ALONE }
    }

    /// Its state at the first instant as its first means show it under a model.
    pub(crate) fn begun(&self, structure: &Structure, common: &[f64]) -> [f64; 2] {
        let modal = [common[self.own.modal], common[self.own.modal + 1]];
        first_state(self, if structure.zero_unknown { common[self.own.rest] } else { 0.0 }, modal)
    }
}

/// Consecutive pieces of free decays.
pub(crate) struct Pieces {
    pub(crate) decays: Vec<Piece>,
}

impl Pieces {
    /// `count` pieces of the same length.
    pub(crate) fn of(decay: &FreeDecay, count: usize) -> Self {
        let n = decay.yaw_rad.len();
        let edge = |k: usize| k * n / count;
        Self::with(decay, (0..count).map(|k| edge(k)..edge(k + 1)).collect())
    }

    /// `count` pieces of the same length from beginning to end, of `most` means together at most: with gaps
    /// between them where the free decay has more.
    pub(crate) fn spread(decay: &FreeDecay, count: usize, most: usize) -> Self {
        let n = decay.yaw_rad.len();
        if n <= most || count < 2 {
            return Self::of(decay, count);
        }
        let length = most / count;
        let begin = |k: usize| k * (n - length) / (count - 1);
        Self::with(decay, (0..count).map(|k| begin(k)..begin(k) + length).collect())
    }

    fn with(decay: &FreeDecay, ranges: Vec<Range<usize>>) -> Self {
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
            Piece { decay, own: Own::ALONE }
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
        self.decays.iter().map_at_once(state).collect()
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

/// `matrix` with a larger diagonal.
pub(super) fn damped(mut matrix: Matrix2<f64>, damping: f64) -> Matrix2<f64> {
    matrix[(0, 0)] *= 1.0 + damping;
    matrix[(1, 1)] *= 1.0 + damping;
    matrix
}

/// The state of `piece` that fits best under given common numbers, and its sum of squares (rad2), infinite
/// where it has no course or is stopped.
pub(crate) fn fit_state(
    piece: &Piece,
    structure: &Structure,
    common: &[f64],
    start: [f64; 2],
) -> ([f64; 2], f64) {
    let wn_rad_s = common[piece.own.modal];
    let steps = [DIFFERENCE * piece.amplitude_rad, DIFFERENCE * piece.amplitude_rad * wn_rad_s];
    let at = |x: [f64; 2]| {
        let moved = [x, [x[0] + steps[0], x[1]], [x[0], x[1] + steps[1]]];
        let mut zero = 0.0;
        let motions = moved.map(|x| {
            let (motion, z) =
                structure.motion(&piece.own.numbers(structure, common, x), piece.around());
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
        (h, g, s)
    };
    let mut best = start;
    let (mut h, mut g, mut s) = at(best);
    let mut damping = 1e-6;
    for _ in 0..25 {
        if !s.is_finite() || piece.stop.is_requested() {
            return (best, f64::INFINITY);
        }
        let Some(step) = damped(h, damping).try_inverse().map(|i| i * g) else { break };
        let trial = [best[0] - step[0], best[1] - step[1]];
        let there = at(trial);
        if there.2 < s {
            let gain = s - there.2;
            (best, h, g, s) = (trial, there.0, there.1, there.2);
            damping *= 0.1;
            if gain < 1e-6 * s {
                break;
            }
        } else {
            if step.dot(&g) < 1e-6 * s {
                break;
            }
            damping = (damping * 10.0).max(1e-4);
        }
    }
    (best, s)
}
