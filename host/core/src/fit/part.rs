//! One release's share of a fit: what it leaves, and its derivatives by the numbers that it has.

use crate::discrepancy::Observed;
use crate::effects::Effect;
use crate::fit::free_decay::FreeDecay;
use crate::fit::structure::Structure;
use crate::motion::simulate::{readings_of_all, Grid, Motion};
use nalgebra::{DMatrix, DVector};

/// Of an effect's size (where it rivals the spring): the step of the differences.
pub(crate) const DIFFERENCE: f64 = 1e-6;

/// The first `count` means of a free decay.
#[derive(Clone, Copy, Debug)]
pub struct Release<'a> {
    /// The free decay.
    pub decay: &'a FreeDecay,
    /// Block means of it that are fitted, from the first on.
    pub count: usize,
}

impl<'a> Release<'a> {
    /// All of it.
    pub fn whole(decay: &'a FreeDecay) -> Self {
        Self { decay, count: decay.yaw_rad.len() }
    }
    /// The first `share` of it.
    pub fn part(decay: &'a FreeDecay, share: f64) -> Self {
        Self { decay, count: (share * decay.yaw_rad.len() as f64) as usize }
    }
}

/// The last of fits to ever longer parts of `releases`, from five cycles on to all: over a few a fit from
/// afar has no other minimum.
pub(crate) fn lengthened<'a, F>(
    releases: &[Release<'a>],
    mut fit: impl FnMut(&[Release<'a>]) -> F,
) -> F {
    let mut cycles = 5.0;
    loop {
        let count = |r: &Release| r.count.min((cycles * r.decay.per_cycle()) as usize);
        let part = |r: &Release<'a>| Release { count: count(r), ..*r };
        let parts: Vec<Release> = releases.iter().map(part).collect();
        let found = fit(&parts);
        if parts.iter().zip(releases).all(|(part, whole)| part.count == whole.count) {
            return found;
        }
        cycles *= 1.8;
    }
}

/// One release's share of the problem.
pub(crate) struct Part<'a> {
    pub(crate) release: Release<'a>,
    pub(crate) structure: Structure,
    /// Of each number of the release: its place among all.
    pub(crate) places: Vec<usize>,
    /// Numbers that are not fixed and act in its wind, in the order of their places.
    pub(crate) free: Vec<usize>,
    /// Of each number, whether it does anything in the release's wind.
    pub(crate) acting: Vec<bool>,
    pub(crate) bounds: Vec<(f64, f64)>,
    steps: Vec<f64>,
    /// Angle and rate at each instant, where they are known and the effects are to act along them.
    pub(crate) states: Option<&'a [[f64; 2]]>,
}

impl<'a> Part<'a> {
    /// `acting` and `bounds` are of each of its numbers.
    pub(crate) fn new(
        release: Release<'a>,
        (structure, acting): (Structure, Vec<bool>),
        places: Vec<usize>,
        bounds: Vec<(f64, f64)>,
    ) -> Self {
        let is_free = |j: &usize| bounds[*j].0 < bounds[*j].1 && acting[*j];
        let mut free: Vec<usize> = (0..places.len()).filter(is_free).collect();
        free.sort_by_key(|&j| places[j]);
        let sizes = structure.sizes(release.decay);
        let difference = difference(&structure);
        debug_assert_eq!(sizes.len(), places.len());
        let steps = sizes.iter().map(|s| difference * s).collect();
        Self { release, structure, places, free, acting, bounds, steps, states: None }
    }
}

impl Part<'_> {
    pub(crate) fn motion(&self, p: &[f64]) -> (Motion, f64) {
        self.structure.motion(p, self.release.decay.around())
    }

    pub(crate) fn grid(&self) -> Grid {
        Grid { count: self.release.count, ..self.release.decay.grid }
    }

    pub(crate) fn numbers(&self, all: &[f64]) -> Vec<f64> {
        self.places.iter().map(|&at| all[at]).collect()
    }

    /// Residuals and their derivatives by the free numbers, over the noise, at the parameters `all`.
    pub(crate) fn linearised(&self, all: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        self.linearised_by(all, &self.free)
    }

    /// The same by some of the free numbers.
    pub(crate) fn linearised_by(&self, all: &[f64], by: &[usize]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let decay = self.release.decay;
        let weight = decay.noise_rad.recip();
        let p = self.numbers(all);
        let mut moved = vec![p.clone(); 1 + by.len()];
        for (q, &j) in moved[1..].iter_mut().zip(by) {
            // Into the range of the parameter.
            let up = p[j] + self.steps[j];
            q[j] = if up <= self.bounds[j].1 { up } else { p[j] - self.steps[j] };
        }
        let (motions, zeros): (Vec<Motion>, Vec<f64>) =
            moved.iter().map(|q| self.motion(q)).unzip();
        let grid = &self.grid();
        let mut readings = match self.states {
            None => readings_of_all(&motions, grid),
            Some(states) => motions.iter().map(|m| m.readings_along(states, grid)).collect(),
        };
        for (readings, zero) in readings.iter_mut().zip(&zeros).filter(|(_, zero)| **zero != 0.0) {
            readings.iter_mut().for_each(|y| *y += zero);
        }
        let mut columns = readings.split_off(1);
        let mut residuals = readings.swap_remove(0);
        for ((column, q), &j) in columns.iter_mut().zip(&moved[1..]).zip(by) {
            let inverse = weight / (q[j] - p[j]);
            for (c, y) in column.iter_mut().zip(&residuals) {
                *c = (*c - y) * inverse;
            }
        }
        for (r, y) in residuals.iter_mut().zip(&decay.yaw_rad) {
            *r = (*r - y) * weight;
        }
        self.add_penalty(&p, by, &mut residuals, &mut columns);
        (residuals, columns)
    }

    /// The rows from which a discrepancy is estimated at the numbers `all`, those marked `fixed` apart.
    pub(crate) fn observed(&self, all: &[f64], fixed: &[bool]) -> Observed {
        let decay = self.release.decay;
        let (mut residuals, mut columns) = self.linearised(all);
        // Where dry friction is about to stop the model, no small step says what another law would do.
        let count = self.release.count.min(decay.smooth);
        let stopping = count..self.release.count;
        residuals.drain(stopping.clone());
        columns.iter_mut().for_each(|column| drop(column.drain(stopping.clone())));
        let free = self.free.iter().map(|&j| self.places[j]).zip(columns);
        let (places, columns) = free.filter(|(at, _)| !fixed[*at]).unzip();
        let weight = decay.noise_rad.recip();
        Observed {
            readings: decay.yaw_rad[..count].iter().map(|y| y * weight).collect(),
            residuals,
            places,
            columns,
            phase_rad: decay.phase_rad(count),
            unit_rad: decay
                .measurand
                .derivative()
                .of_motion(decay.noise_rad, decay.frequency_rad_s),
        }
    }

    /// The roughness of a measured law as further residuals: in proportion to the means, so that pieces of a
    /// free decay add up to the whole.
    fn add_penalty(
        &self,
        p: &[f64],
        by: &[usize],
        residuals: &mut Vec<f64>,
        columns: &mut [Vec<f64>],
    ) {
        let decay = self.release.decay;
        for (effect, at) in self.structure.places() {
            let Some(rows) = effect.penalty() else { continue };
            let sizes = effect.sizes(&decay.scale());
            let weight = (self.release.count as f64).sqrt() * decay.reading_rad() / decay.noise_rad;
            let rows = DMatrix::from_fn(rows.nrows(), rows.ncols(), |i, j| {
                weight * rows[(i, j)] / sizes[j]
            });
            let values = &rows * DVector::from_column_slice(&p[at..at + rows.ncols()]);
            residuals.extend(values.iter());
            for (column, &j) in columns.iter_mut().zip(by) {
                let inside = j.checked_sub(at).filter(|k| *k < rows.ncols());
                column.extend((0..rows.nrows()).map(|i| inside.map_or(0.0, |k| rows[(i, k)])));
            }
        }
    }
}

/// Whether the integration chooses its steps by itself.
pub(crate) fn adapts_steps(structure: &Structure) -> bool {
    structure.precise || structure.effects.iter().any(Effect::is_own)
}

/// Whether a moment has states with equations of motion of their own. Once a model swings they change its
/// frequency and damping as the spring and the damper do: a valley that takes twice the evaluations, and finer
/// differences, to be followed to its bottom.
pub(crate) fn has_states(structure: &Structure) -> bool {
    structure.effects.iter().any(Effect::has_states)
}

/// Of an effect's size, the step of the differences: a longer one where steps adapt themselves.
fn difference(structure: &Structure) -> f64 {
    match adapts_steps(structure) {
        true if has_states(structure) => 3.0 * DIFFERENCE,
        true => 30.0 * DIFFERENCE,
        false => DIFFERENCE,
    }
}
