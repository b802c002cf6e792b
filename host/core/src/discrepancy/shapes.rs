//! Shapes of a smooth moment beside the model, and what each does to the readings.

use crate::effects::{Moment, State};
use crate::motion::simulate::{readings_of_all, Grid, Motion};

/// Shapes of the restoring moment, then of the dissipation.
pub(crate) const SHAPES: usize = STIFFNESS_SHAPES + 4;
pub(super) const STIFFNESS_SHAPES: usize = 5;

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
    // In any case: motions whose moments are alike are followed side by side.
    motion.terms.add_moment::<Shape>(&numbers);
    // Dry friction is no smooth moment: it has its place among what turns.
    if which == SHAPES - 1 {
        motion.terms.rub(strength_rad_s2);
    }
}

/// Of the angle Legendre's polynomials less their tangent at zero, and abs(b) b; of the rate Chebyshev's less
/// theirs, abs(r) r, and dry friction.
fn shape(which: usize, angle: f64, rate: f64) -> f64 {
    // Shapes end where the record does: beyond it they are held.
    let [u, v] = [angle, rate].map(|x| x.clamp(-1.2, 1.2));
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
        _ => 0.0,
    }
}

/// How much smaller each shape is expected to be than the first: rougher ones less likely.
pub(super) fn order(which: usize) -> f64 {
    [1.0, 1.0, 2.0, 1.0, 4.0, 1.0, 2.0, 1.0, 1.0][which]
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
    let mut readings = readings_of_all(&motions, grid);
    let mut changed = readings.split_off(1);
    for y in &mut changed {
        y.iter_mut().zip(&readings[0]).for_each(|(y, plain)| *y = (*y - plain) / step);
    }
    changed
}
