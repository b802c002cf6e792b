//! The table from a sweep: readings beside the angles that a reference has.
//!
//! reading = x + error(x),   x = (angle - offset) / gain
//!
//! with the error straight between knots, and as little bent as the readings allow where they are few. Offset and gain
//! are the mounting's and the travel's: they change neither frequency nor damping and are no part of the table; the
//! gain is said.

use super::damping;
use super::fit::{corrections, offset_and_gain, BY_CHANCE};
use super::table::{Knots, Learned};
use crate::error::{Error, Result};
use nalgebra::{Cholesky, DMatrix, DVector};

/// Weight of a knot's bend, of the mean number of points at a knot: it bridges knots without any, and no more.
const SMOOTH: f64 = 1e-4;

/// Readings, and the angles at which they were read.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Reading and angle, deg.
    points: Vec<[f64; 2]>,
}

/// What a sweep tells.
#[derive(Clone, Debug)]
pub struct Swept {
    /// The table, and what is known of it.
    pub learned: Learned,
    /// By how much the angle rises while the reading does by 1.
    pub gain: f64,
}

/// `y` by `x`: where it is at no `x`, and the slope.
fn line(points: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let mean = |of: &dyn Fn((f64, f64)) -> f64| {
        let (sum, n) = points.clone().fold((0.0, 0.0), |(sum, n), p| (sum + of(p), n + 1.0));
        sum / n
    };
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
    (y - slope * x, slope)
}

impl Sweep {
    /// Of points, reading and angle in deg each.
    pub fn new(points: Vec<[f64; 2]>) -> Self {
        Self { points }
    }

    /// The lowest and the highest reading.
    pub fn range_deg(&self) -> [f64; 2] {
        let readings = || self.points.iter().map(|point| point[0]);
        [readings().fold(f64::INFINITY, f64::min), readings().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// The table at these knots; what it does to a damping ratio is that of motion about `rest_deg` from the
    /// amplitude `from_deg` down.
    ///
    /// # Errors
    /// Where angles do not follow readings.
    pub fn learn(&self, knots: Knots, rest_deg: f64, from_deg: f64) -> Result<Swept> {
        let undetermined = || Error::NoTable;
        let (offset, gain) = line(self.points.iter().map(|[reading, angle]| (*reading, *angle)));
        // A reference that counts the other way round tells as much.
        if !gain.is_normal() {
            return Err(undetermined());
        }
        let n = self.points.len() as f64;
        let count = knots.count;
        let mut normal: DMatrix<f64> = DMatrix::zeros(count, count);
        let mut wanted: DVector<f64> = DVector::zeros(count);
        let mut seen = vec![0.0; count];
        // Angles as they would be read, and the errors.
        let points: Vec<(f64, f64)> = (self.points.iter())
            .map(|[reading, angle]| ((angle - offset) / gain, reading - (angle - offset) / gain))
            .collect();
        for (angle, error) in &points {
            let (knot, beyond) = knots.place(*angle);
            let at = [(knot, 1.0 - beyond), (knot + 1, beyond)];
            for (i, h) in at {
                seen[i] += h;
                wanted[i] += h * error;
                at.iter().for_each(|(j, other)| normal[(i, *j)] += h * other);
            }
        }
        let each = n / count as f64;
        for k in 1..count - 1 {
            let bend = [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)];
            for (i, a) in bend {
                bend.iter().for_each(|(j, b)| normal[(i, *j)] += SMOOTH * each * a * b);
            }
        }
        for fixed in offset_and_gain(&seen) {
            normal += &fixed * fixed.transpose();
        }
        let root = Cholesky::new(normal).ok_or_else(undetermined)?;
        let errors = root.solve(&wanted);
        let errors = errors.as_slice();
        let left_of = |(angle, error): &(f64, f64)| error - knots.between(errors, *angle);
        let before: f64 = points.iter().map(|(_, error)| error * error).sum();
        let after: f64 = points.iter().map(|point| left_of(point).powi(2)).sum();
        let left = after / (n - count as f64 - 2.0).max(1.0);
        let removed = (before - after) / n;
        let mut passed = (0..count).filter(|k| seen[*k] > 0.0);
        let first = passed.next().ok_or_else(undetermined)?;
        let last = passed.next_back().ok_or_else(undetermined)?;
        let half = 0.5 * (knots.deg(count - 1) - knots.deg(0));
        let weights = damping::weights(knots, rest_deg, from_deg.min(half));
        let learned = Learned {
            corrections_deg: corrections(errors, knots, first, last),
            seen_deg: self.range_deg(),
            removed_rms_deg: removed.max(0.0).sqrt(),
            beyond_noise: removed > BY_CHANCE * left * count as f64 / n,
            left_rms_deg: left.sqrt(),
            damping_error: weights.dot(&DVector::from_column_slice(errors)),
            damping_u: (left * weights.dot(&root.solve(&weights))).sqrt(),
            frequency_change: 0.0,
        };
        let numbers = [learned.damping_u, learned.damping_error, left];
        let finite =
            numbers.iter().chain(&learned.corrections_deg).all(|number| number.is_finite());
        finite.then_some(Swept { learned, gain }).ok_or_else(undetermined)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// What a sensor with a bend, a jump and a travel of 2 % more than said reads at an angle.
    fn reading(angle_deg: f64) -> f64 {
        let x = angle_deg / 20.0;
        let jump = if angle_deg > 3.0 { 0.1 } else { 0.0 };
        1.02 * angle_deg + 0.3 * (1.0 - x * x) + jump + 5.0
    }

    fn swept(points: usize, noise_deg: f64, knots: usize) -> (Swept, Knots) {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let point = |k: usize| {
            let angle = -20.0 + 40.0 * k as f64 / (points - 1) as f64;
            let noise: f64 = StandardNormal.sample(&mut rng);
            [reading(angle) + noise_deg * noise, angle]
        };
        let sweep = Sweep::new((0..points).map(point).collect());
        let [low, high] = sweep.range_deg();
        let step_deg = (high - low) / (knots - 1) as f64;
        let knots = Knots { first_deg: low, step_deg, count: knots };
        (sweep.learn(knots, reading(0.0), 12.0).expect("a table"), knots)
    }

    /// Corrected readings lie on a straight line, from a slow sweep and from some forty stops; and the share of a
    /// damping ratio is that of the sensor's own error.
    #[test]
    fn corrected_readings_are_straight() {
        for (points, noise_deg, count, most) in [(20_000, 0.02, 200, 0.02), (41, 0.0, 16, 0.08)] {
            let (Swept { learned, gain }, knots) = swept(points, noise_deg, count);
            assert!((gain * 1.02 - 1.0).abs() < 5e-3, "{gain}");
            assert!(learned.beyond_noise && learned.removed_rms_deg > 0.05, "{learned:?}");
            let corrections = &learned.corrections_deg;
            let corrected =
                |angle: f64| reading(angle) + knots.between(corrections, reading(angle));
            // But for the jump itself, which lies between knots.
            let angles = (-190..190).map(|k| f64::from(k) * 0.1);
            let angles = angles.filter(|a| (a - 3.0).abs() > 2.0 * knots.step_deg);
            let points = angles.map(|angle| (angle, corrected(angle)));
            let (at_none, slope) = line(points.clone());
            let worst = points.map(|(x, y)| (y - at_none - slope * x).abs()).fold(0.0, f64::max);
            println!(
                "{points} {worst:.4} deg, damping {:+.4} +- {:.4}",
                learned.damping_error,
                learned.damping_u,
                points = count
            );
            assert!(worst < most, "{worst}");
        }
    }

    /// A sensor that is straight has no table beyond its noise.
    #[test]
    fn noise_alone_is_no_table() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let point = |k: i32| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            [f64::from(k) * 0.01 + 0.02 * noise, f64::from(k) * 0.01]
        };
        let sweep = Sweep::new((-1500..1500).map(point).collect());
        let knots = Knots { first_deg: -15.5, step_deg: 0.5, count: 63 };
        let Swept { learned, .. } = sweep.learn(knots, 0.0, 10.0).expect("an answer");
        assert!(!learned.beyond_noise, "{learned:?}");
        let still = Sweep::new((0..100).map(|k| [f64::from(k), 3.0]).collect());
        assert!(still.learn(knots, 0.0, 10.0).is_err());
    }
}
