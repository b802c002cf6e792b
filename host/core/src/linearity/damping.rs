//! What an error of a sensor does to a damping ratio.

use super::table::Knots;
use nalgebra::DVector;
use std::f64::consts::TAU;

/// Amplitudes and angles over which it is summed up.
const AMPLITUDES: usize = 60;
const ANGLES: usize = 2000;
/// The smallest amplitude over the largest one.
const DOWN_TO: f64 = 0.1;

/// The relative change of a damping ratio, as a weighted sum of the errors at the knots.
///
/// An error e makes an amplitude A seem A + a(A), a(A) the first harmonic of e(offset + A cos x). The slope of
/// ln A over the time, each amplitude weighted by its square as a fit to the samples does, changes by the
/// slope of a/A over ln A.
pub(super) fn weights(knots: Knots, offset_deg: f64, from_deg: f64) -> DVector<f64> {
    let log = |k: usize| DOWN_TO.ln() * k as f64 / (AMPLITUDES - 1) as f64;
    let weight = |k: usize| (2.0 * log(k)).exp();
    let sum = |f: &dyn Fn(usize) -> f64| (0..AMPLITUDES).map(f).sum::<f64>();
    let mean = sum(&|k| weight(k) * log(k)) / sum(&weight);
    let squares = sum(&|k| weight(k) * (log(k) - mean).powi(2));
    let mut weights = DVector::zeros(knots.count);
    for k in 0..AMPLITUDES {
        let amplitude_deg = from_deg * log(k).exp();
        let slope = weight(k) * (log(k) - mean) / squares;
        for angle in 0..ANGLES {
            let cos = (TAU * (angle as f64 + 0.5) / ANGLES as f64).cos();
            let (knot, beyond) = knots.place(offset_deg + amplitude_deg * cos);
            let share = slope * 2.0 * cos / amplitude_deg / ANGLES as f64;
            weights[knot] += share * (1.0 - beyond);
            weights[knot + 1] += share * beyond;
        }
    }
    weights
}
