//! The residuals of one or several releases as a problem to be minimised.

use crate::discrepancy::{self, Discrepancy, Left, Observed};
use crate::fit::layout::{Layout, Sharing};
use crate::fit::part::{adapts_steps, has_states, Part, Release};
use crate::fit::structure::{Structure, WN, ZETA};
use crate::fit::valley;
use crate::par_map::ParMap;
use crate::solver::{minimise, off_bounds, Fit, Options, Problem, Rows};
use crate::statistics::median;
use nalgebra::DMatrix;

/// Evaluations of the model in a fit.
pub(crate) const EVALUATIONS: usize = 30;

/// Residuals of all releases over their noise.
pub(crate) struct JointProblem<'a> {
    pub(crate) parts: Vec<Part<'a>>,
    pub(crate) layout: Layout,
    pub(crate) bounds: Vec<(f64, f64)>,
}

impl<'a> JointProblem<'a> {
    /// `starts`: a value for each release's numbers.
    pub(crate) fn new(
        releases: &[Release<'a>],
        structure: &Structure,
        sharing: &Sharing,
        starts: &[Vec<f64>],
    ) -> Self {
        let layout = Layout::of_releases(structure, sharing);
        let structures = (0..releases.len()).map(|i| sharing.of_release(structure, i)).collect();
        Self::laid_out(releases, structures, layout, starts)
    }

    /// Of blocks whose numbers are as `layout` says, each with its structure and a value for each of its numbers.
    pub(crate) fn laid_out(
        blocks: &[Release<'a>],
        structures: Vec<Structure>,
        layout: Layout,
        starts: &[Vec<f64>],
    ) -> Self {
        let mut bounds: Vec<Option<(f64, f64)>> = vec![None; layout.count()];
        for (i, (block, start)) in blocks.iter().zip(starts).enumerate() {
            let own = structures[i].bounds(block.decay, start);
            for (&at, (low, high)) in layout.places(i).iter().zip(own) {
                let (least, most) = bounds[at].unwrap_or((low, high));
                let (low, high) = (low.max(least), high.min(most));
                // Two releases whose bounds do not meet keep to the first's.
                bounds[at] = Some(if low <= high { (low, high) } else { (least, most) });
            }
        }
        let mut bounds: Vec<(f64, f64)> =
            bounds.into_iter().map(|b| b.unwrap_or((f64::NEG_INFINITY, f64::INFINITY))).collect();
        let with_acting = |(structure, block): (Structure, &Release)| {
            let acting = structure.acting(block.decay.wind_speed_m_s);
            (structure, acting)
        };
        let structures: Vec<(Structure, Vec<bool>)> =
            structures.into_iter().zip(blocks).map(with_acting).collect();
        // A number that acts in the wind of no release stays where it begins.
        let mut begun: Vec<Option<f64>> = vec![None; layout.count()];
        for (i, (_, acting)) in structures.iter().enumerate() {
            for (j, &at) in layout.places(i).iter().enumerate() {
                begun[at] =
                    if acting[j] { Some(f64::NAN) } else { begun[at].or(Some(starts[i][j])) };
            }
        }
        for (bound, begun) in bounds.iter_mut().zip(begun) {
            if let Some(value) = begun.filter(|value| !value.is_nan()) {
                *bound = (value, value);
            }
        }
        let parts = structures.into_iter().zip(blocks).enumerate();
        let part = |(i, (structure, &release)): (usize, ((Structure, Vec<bool>), &Release<'a>))| {
            let places = layout.places(i).to_vec();
            let own = places.iter().map(|&at| bounds[at]).collect();
            Part::new(release, structure, places, own)
        };
        let parts = parts.map(part).collect();
        Self { parts, layout, bounds }
    }

    /// Where to begin: what releases share at their median, each number inside its bounds. States that come to other
    /// numbers that way change frequency and damping; those that each release had stay.
    pub(crate) fn gathered(&self, starts: &[Vec<f64>]) -> Vec<f64> {
        let mut all = self.medians(starts);
        for (value, (low, high)) in all.iter_mut().zip(&self.bounds) {
            *value = value.max(*low).min(*high);
        }
        if !self.parts.iter().any(|part| has_states(&part.structure)) {
            return all;
        }
        let kept = |(part, start): (&Part, &Vec<f64>)| {
            let mut kept = start.clone();
            let (from, there) = (part.motion(start).0, part.motion(&part.numbers(&all)).0);
            if let Some(own) = from.slow_slopes().and_then(|seen| there.of_slow_slopes(seen)) {
                [kept[WN], kept[ZETA]] = own;
            }
            kept
        };
        self.medians(&self.parts.iter().zip(starts).map(kept).collect::<Vec<_>>())
    }

    /// The median of each number over the releases that share it: one that is in another minimum draws no
    /// mean aside. What acts in the wind of some counts there alone.
    fn medians(&self, starts: &[Vec<f64>]) -> Vec<f64> {
        let gathered = |acting: bool| {
            let mut all: Vec<Vec<f64>> = vec![Vec::new(); self.layout.count()];
            for (part, start) in self.parts.iter().zip(starts) {
                let of = part.places.iter().zip(start).zip(&part.acting);
                of.filter(|(_, acts)| **acts == acting)
                    .for_each(|((&at, &value), _)| all[at].push(value));
            }
            all
        };
        let pairs = gathered(true).into_iter().zip(gathered(false));
        pairs
            .map(|(mut of, mut other)| median(if of.is_empty() { &mut other } else { &mut of }))
            .collect()
    }

    /// What the model lacks at its fitted numbers `all`, those marked `fixed` apart, `held` being the level of the
    /// noise that their own covariance holds; `None` where it lacks nothing that shows.
    pub(crate) fn discrepancy(
        &self,
        all: &[f64],
        fixed: &[bool],
        held: f64,
    ) -> Option<Discrepancy> {
        // Once somebody asks for an end, whoever asked finds out why there is none.
        let observed = |part: &Part| {
            (!part.release.decay.stop.is_requested()).then(|| part.observed(all, fixed))
        };
        let releases: Vec<Observed> = self.parts.iter().par_map(observed).collect::<Option<_>>()?;
        let is_noise = releases.iter().all(Observed::is_noise);
        let left = if is_noise { Left::Noise } else { Left::More };
        discrepancy::of(&releases, all.len(), left, held)
    }

    /// `covariance` at the numbers `all` of one release, with a variance for those that ended on a bound
    /// without being fixed.
    pub(crate) fn off_bounds(&self, all: &[f64], covariance: &DMatrix<f64>) -> DMatrix<f64> {
        let is_pressed =
            |j: usize| covariance[(j, j)] == 0.0 && self.bounds[j].0 < self.bounds[j].1;
        if !(0..all.len()).any(is_pressed) {
            return covariance.clone();
        }
        let part = &self.parts[0];
        let (residuals, columns) = part.linearised(all);
        let mut jacobian = DMatrix::zeros(residuals.len(), all.len());
        for (&j, column) in part.free.iter().zip(&columns) {
            jacobian.column_mut(j).copy_from_slice(column);
        }
        let freedom = residuals.len().saturating_sub(part.free.len()).max(1);
        let variance = residuals.iter().map(|r| r * r).sum::<f64>() / freedom as f64;
        off_bounds(covariance, &jacobian.tr_mul(&jacobian), variance, is_pressed)
    }

    pub(crate) fn minimise(&self, start: &[f64], max_evaluations: usize) -> Fit {
        let has_law = self.parts.iter().any(|p| p.structure.has_law());
        let adapts = self.parts.iter().any(|p| adapts_steps(&p.structure));
        // By how much the sum of squares may err, of the residuals' variance: half of it where steps adapt
        // themselves, else a tenth of a standard error, squared, as friction stops the model in one step or
        // the next.
        let accuracy = if adapts || has_law { 0.5 } else { 0.01 };
        // Distance to the minimum in standard errors. The many numbers of a law share what they explain: a
        // valley is followed no further than that.
        let tolerance = if has_law { 0.1 } else { 0.01 };
        let in_valley = self.parts.iter().any(|p| has_states(&p.structure));
        let max_evaluations = match max_evaluations >= EVALUATIONS && in_valley {
            true => 2 * max_evaluations,
            false => max_evaluations,
        };
        let options = Options { max_evaluations, tolerance, accuracy, damping: 1e-4 };
        minimise(self, start, &options)
    }
}

impl Problem for JointProblem<'_> {
    fn parameters(&self) -> usize {
        self.layout.count()
    }

    fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
        if self.parts.iter().any(|part| part.release.decay.stop.is_requested()) {
            // Nowhere to be evaluated: the fit ends at once, and whoever asked for it finds out why.
            return rows.row(f64::NAN, &vec![0.0; p.len()]);
        }
        let mut add = |part: &Part, (residuals, columns): (Vec<f64>, Vec<Vec<f64>>)| {
            let which: Vec<usize> = part.free.iter().map(|&j| part.places[j]).collect();
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            rows.part(&residuals, &which, &columns);
        };
        if let [part] = &self.parts[..] {
            return add(part, part.linearised(p));
        }
        let all: Vec<_> = self.parts.iter().par_map(|part| part.linearised(p)).collect();
        for (part, linearised) in self.parts.iter().zip(all) {
            add(part, linearised);
        }
    }

    fn bend(&self, from: &[f64], to: &mut [f64]) {
        let mut done = Vec::new();
        for part in self.parts.iter().filter(|part| has_states(&part.structure)) {
            let [wn, zeta] = [WN, ZETA].map(|number| part.places[number]);
            if done.contains(&wn) || ![WN, ZETA].iter().all(|number| part.free.contains(number)) {
                continue;
            }
            done.push(wn);
            let at = |share: f64| {
                let number = |&k: &usize| from[k] + share * (to[k] - from[k]);
                part.motion(&part.places.iter().map(number).collect::<Vec<_>>()).0
            };
            if let Some(end) = valley::end(at) {
                [to[wn], to[zeta]] = end;
            }
        }
    }

    fn bounds(&self, index: usize) -> (f64, f64) {
        self.bounds[index]
    }
}

/// The problem of one release, whose numbers are in the order of [`crate::fit::fitting::Fitted`].
pub(crate) fn problem_of_one<'a>(
    release: Release<'a>,
    structure: &Structure,
    start: &[f64],
) -> JointProblem<'a> {
    let sharing = Sharing::none(1, structure.effects.len());
    JointProblem::new(&[release], structure, &sharing, &[start.to_vec()])
}
