//! The fit of the table, with the releases' own parameters eliminated.

use super::damping;
use super::start::{at, legendre, Swing, DRIFT, OWN, TERMS};
use super::table::{Knots, Learned};
use crate::error::{Error, Result};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

const MAX_STEPS: usize = 25;
/// A step that moves no knot by more than this share of the largest amplitude is the last one.
const SMALL: f64 = 1e-7;
/// Errors of this share of the largest amplitude are taken for likely: where nothing was read that is all
/// that is known.
const LIKELY: f64 = 0.1;
/// Residuals beyond so many times their rms are no reading's; but a wide code's may be many times the noise.
const WILD: f64 = 20.0;
/// A knot that was passed by fewer samples was not seen.
const MIN_SAMPLES: f64 = 20.0;
/// Share of what a stiffness law's harmonics would do that stays: not each law is a cubic one.
const OTHER_LAWS: f64 = 0.1;
/// What is taken out is more than noise beyond so many times what a table takes out of noise.
pub(super) const BY_CHANCE: f64 = 4.0;
/// Rise of the corrected reading at least, over that of the reading.
const MIN_RISE: f64 = 0.1;

/// Sums of one pass over all samples.
struct Sums {
    table: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Of each release: the inverse of its own block, its coupling with the table, its gradient.
    own: Vec<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)>,
    squares: f64,
    samples: f64,
    /// Samples at each knot.
    seen: Vec<f64>,
}

/// What is being fitted.
struct State<'a> {
    swings: &'a [Swing],
    own: Vec<[f64; OWN]>,
    knots: Knots,
    errors: Vec<f64>,
    largest_deg: f64,
    /// Of each release, relative change of the frequency by the square of the amplitude.
    stiffness: Vec<f64>,
}

impl State<'_> {
    fn sums(&self, wild_deg: f64) -> Option<Sums> {
        let count = self.knots.count;
        let mut sums = Sums {
            table: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
            own: Vec::new(),
            squares: 0.0,
            samples: 0.0,
            seen: vec![0.0; count],
        };
        for ((swing, own), e) in self.swings.iter().zip(&self.own).zip(&self.stiffness) {
            let mut block = DMatrix::zeros(OWN, OWN);
            let mut coupling = DMatrix::zeros(OWN, count);
            let mut gradient = DVector::zeros(OWN);
            for (tau, reading) in &swing.samples {
                let polynomials = legendre(*tau);
                let [offset, amplitude, phase] = at(own, &polynomials);
                let (sin, cos) = phase.sin_cos();
                let third = e / 12.0 * amplitude.powi(3) * (4.0 * cos * cos - 3.0) * cos;
                let angle = offset + amplitude * cos + third;
                let (knot, beyond) = self.knots.place(angle);
                let (below, above) = (self.errors[knot], self.errors[knot + 1]);
                let residual = reading - angle - below * (1.0 - beyond) - above * beyond;
                if residual.abs() > wild_deg {
                    continue;
                }
                let rise = 1.0 + (above - below) / self.knots.step_deg;
                let mut d = [0.0; OWN];
                for (k, polynomial) in polynomials.iter().enumerate() {
                    if k < DRIFT {
                        d[k] = rise * polynomial;
                    }
                    d[DRIFT + k] = rise * amplitude * cos * polynomial;
                    d[DRIFT + TERMS + k] = -rise * amplitude * sin * polynomial;
                }
                let at_knots = [(knot, 1.0 - beyond), (knot + 1, beyond)];
                for (i, h) in at_knots {
                    sums.seen[i] += h;
                    sums.gradient[i] += h * residual;
                    for (j, other) in at_knots {
                        sums.table[(i, j)] += h * other;
                    }
                    for (l, d) in d.iter().enumerate() {
                        coupling[(l, i)] += d * h;
                    }
                }
                for l in 0..OWN {
                    gradient[l] += d[l] * residual;
                    for m in 0..OWN {
                        block[(l, m)] += d[l] * d[m];
                    }
                }
                sums.squares += residual * residual;
                sums.samples += 1.0;
            }
            sums.own.push((block.try_inverse()?, coupling, gradient));
        }
        Some(sums)
    }

    fn step_own(&mut self, sums: &Sums, table: &DVector<f64>) {
        for (own, (inverse, coupling, gradient)) in self.own.iter_mut().zip(&sums.own) {
            let step = inverse * (gradient - coupling * table);
            own.iter_mut().zip(step.iter()).for_each(|(own, step)| *own += step);
        }
    }

    /// The table's normal equations with the releases' own parameters eliminated, what is likely, and neither
    /// an offset nor a gain.
    fn reduced(&self, sums: &Sums) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let (mut normal, mut gradient) = (sums.table.clone(), sums.gradient.clone());
        for (inverse, coupling, own) in &sums.own {
            let through = coupling.transpose() * inverse;
            normal -= &through * coupling;
            gradient -= &through * own;
        }
        let errors = DVector::from_column_slice(&self.errors);
        let likely = (LIKELY * self.largest_deg).powi(2);
        let prior = sums.squares / sums.samples / likely;
        for k in 0..self.knots.count {
            normal[(k, k)] += prior;
        }
        gradient -= prior * &errors;
        for fixed in offset_and_gain(&sums.seen) {
            normal += &fixed * fixed.transpose();
            gradient -= &fixed * fixed.dot(&errors);
        }
        Some((Cholesky::new(normal)?, gradient))
    }

    /// A stiffness law shows in how the frequency follows the amplitude.
    fn see_stiffness(&mut self) {
        for (own, stiffness) in self.own.iter().zip(&mut self.stiffness) {
            let n = 200;
            let point = |k: usize| {
                let tau = -1.0 + 2.0 * (k as f64 + 0.5) / f64::from(n);
                let step = 1e-3;
                let [_, amplitude, phase] = at(own, &legendre(tau));
                let [.., later] = at(own, &legendre(tau + step));
                (amplitude * amplitude, (later - phase) / step)
            };
            let points: Vec<_> = (0..n as usize).map(point).collect();
            // Frequency over amplitude squared, each weighted by that.
            let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0, p.1)).sum::<f64>();
            let (w, x, y) = (sum(&|a, _| a), sum(&|a, _| a * a), sum(&|a, f| a * f));
            let (xx, xy) = (sum(&|a, _| a * a * a), sum(&|a, f| a * a * f));
            let slope = (w * xy - x * y) / (w * xx - x * x);
            *stiffness = slope / ((y - slope * x) / w);
        }
    }
}

/// An offset and a gain of the errors at knots that were passed so often, which a table has not: as firmly as the best
/// seen knots are known.
pub(super) fn offset_and_gain(seen: &[f64]) -> [DVector<f64>; 2] {
    let all: f64 = seen.iter().sum();
    let middle = seen.iter().enumerate().map(|(k, seen)| seen * k as f64).sum::<f64>() / all;
    [false, true].map(|gain| {
        let shape = |k: usize| seen[k] * if gain { k as f64 - middle } else { 1.0 };
        let fixed = DVector::from_fn(seen.len(), |k, _| shape(k)).normalize();
        fixed * (30.0 * all / seen.len() as f64).sqrt()
    })
}

pub(super) fn learn(swings: &[Swing], knots: Knots, from_deg: f64) -> Result<Learned> {
    let undetermined = || Error::NoTable;
    let largest_deg = swings.iter().map(Swing::amplitude_deg).fold(0.0, f64::max);
    let mut state = State {
        swings,
        own: swings.iter().map(|swing| swing.own).collect(),
        knots,
        errors: vec![0.0; knots.count],
        largest_deg,
        stiffness: vec![0.0; swings.len()],
    };
    let rms = |sums: &Sums| (sums.squares / sums.samples).sqrt();
    let none = DVector::zeros(knots.count);
    let mut before = 0.0;
    for _ in 0..4 {
        let sums = state.sums(f64::INFINITY).ok_or_else(undetermined)?;
        before = rms(&sums);
        state.step_own(&sums, &none);
    }
    let mut wild_deg = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        state.see_stiffness();
        let sums = state.sums(wild_deg).ok_or_else(undetermined)?;
        let (normal, gradient) = state.reduced(&sums).ok_or_else(undetermined)?;
        let step = normal.solve(&gradient);
        state.errors.iter_mut().zip(step.iter()).for_each(|(error, step)| *error += step);
        state.step_own(&sums, &step);
        wild_deg = WILD * rms(&sums);
        if step.amax() < SMALL * largest_deg {
            break;
        }
    }
    let sums = state.sums(wild_deg).ok_or_else(undetermined)?;
    let (normal, _) = state.reduced(&sums).ok_or_else(undetermined)?;
    let offset_deg = state.own.iter().map(|own| own[0]).sum::<f64>() / swings.len() as f64;
    let weights = damping::weights(knots, offset_deg, from_deg.min(largest_deg));
    let by_noise = rms(&sums) * weights.dot(&normal.solve(&weights)).sqrt();
    let of_largest = |(swing, e): (&Swing, &f64)| (e * swing.amplitude_deg().powi(2)).abs();
    let frequency_change = swings.iter().zip(&state.stiffness).map(of_largest).fold(0.0, f64::max);
    let by_stiffness = OTHER_LAWS * frequency_change / 4.0;
    let damping_error = weights.dot(&DVector::from_column_slice(&state.errors));
    let seen: Vec<usize> = (0..knots.count).filter(|k| sums.seen[*k] >= MIN_SAMPLES).collect();
    let (Some(&first), Some(&last)) = (seen.first(), seen.last()) else {
        return Err(undetermined());
    };
    let left = rms(&sums);
    let removed = (before * before - left * left).max(0.0);
    let by_chance = left * left * knots.count as f64 / sums.samples;
    let learned = Learned {
        corrections_deg: corrections(&state.errors, knots, first, last),
        seen_deg: [knots.deg(first), knots.deg(last)],
        removed_rms_deg: removed.sqrt(),
        beyond_noise: removed > BY_CHANCE * by_chance,
        left_rms_deg: left,
        damping_error,
        damping_u: by_noise.hypot(by_stiffness),
        frequency_change,
    };
    let numbers = [learned.damping_u, learned.damping_error, left];
    let finite = numbers.iter().chain(&learned.corrections_deg).all(|number| number.is_finite());
    finite.then_some(learned).ok_or_else(undetermined)
}

/// What is to be added to the reading of each knot: the angle that has it, less the reading.
pub(super) fn corrections(errors: &[f64], knots: Knots, first: usize, last: usize) -> Vec<f64> {
    let step = knots.step_deg;
    // Readings at the knots' angles, beyond what was seen by the error at the end of that; rising.
    let mut readings: Vec<f64> = Vec::with_capacity(knots.count);
    for k in 0..knots.count {
        let reading = knots.deg(k) + errors[k.clamp(first, last)];
        let least = readings.last().map_or(f64::NEG_INFINITY, |before| before + 1e-3 * step);
        readings.push(reading.max(least));
    }
    let angle = |reading: f64| {
        let above = readings.partition_point(|r| *r < reading).clamp(1, knots.count - 1);
        let (from, to) = (readings[above - 1], readings[above]);
        knots.deg(above - 1) + step * (reading - from) / (to - from)
    };
    let mut corrected = f64::NEG_INFINITY;
    (0..knots.count)
        .map(|k| {
            let reading = knots.deg(k);
            let (low, high) = (readings[0], readings[knots.count - 1]);
            // Beyond the ends the correction stays.
            let inside = reading.clamp(low, high);
            corrected = (angle(inside) + reading - inside).max(corrected + MIN_RISE * step);
            corrected - reading
        })
        .collect()
}
