//! How far a window is from one damped oscillation.

use yawrig_shared::features::{FEATURES, SHAPE};
use yawrig_shared::window::CYCLES;

/// Phase that passes in a bin, and its cosine and sine: a window is three cycles by its crossings.
const PHASE: f32 = 0.471_238_9;
const COS: f32 = 0.891_006_5;
const SIN: f32 = 0.453_990_5;
const _: () = assert!(SHAPE == 40 && CYCLES == 3);
/// Oscillation, its change with frequency and damping, mid-line; then the shape itself.
const BASIS: usize = 5;
/// Degrees of freedom that are left.
const FREE: usize = SHAPE - BASIS;

/// Rms of what no damped oscillation near this damping ratio explains of a window's shape, over the shape's own rms.
pub fn misfit(features: &[f32; FEATURES], damping_ratio: f32) -> f32 {
    let mut columns = [[0.0_f32; SHAPE]; BASIS + 1];
    // What remains of the amplitude after a bin; enough for damping ratios of interest.
    let x = damping_ratio * PHASE;
    let decay = 1.0 - x + 0.5 * x * x;
    let (mut cos, mut sin) = (1.0_f32, 0.0_f32);
    for i in 0..SHAPE {
        let t = i as f32 / SHAPE as f32 - 0.5;
        for (column, value) in
            columns.iter_mut().zip([cos, sin, t * cos, t * sin, 1.0, features[i]])
        {
            column[i] = value;
        }
        (cos, sin) = (decay * (COS * cos - SIN * sin), decay * (SIN * cos + COS * sin));
    }
    let dot =
        |a: &[f32; SHAPE], b: &[f32; SHAPE]| -> f32 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let whole = dot(&columns[BASIS], &columns[BASIS]);
    // Gram-Schmidt: what is left of the last column is orthogonal to all before it.
    for done in 0..BASIS {
        let (before, after) = columns.split_at_mut(done + 1);
        let base = &before[done];
        let norm = dot(base, base);
        for column in after {
            let share = dot(column, base) / norm;
            for (value, base) in column.iter_mut().zip(base) {
                *value -= share * base;
            }
        }
    }
    let left = dot(&columns[BASIS], &columns[BASIS]);
    libm::sqrtf(left / whole * (SHAPE as f32 / FREE as f32))
}
