//! How far a window is from one damped oscillation.

use crate::features::{FEATURES, SHAPE};
use crate::window::CYCLES;

/// Neighbouring bins are averaged: half the work, and what disturbs an oscillation is slower still.
const PAIRS: usize = SHAPE / 2;
/// Phase that passes in a pair, and its cosine and sine: a window is three cycles by its crossings.
const PHASE: f32 = 0.942_477_8;
const COS: f32 = 0.587_785_25;
const SIN: f32 = 0.809_017;
const _: () = assert!(PAIRS == 20 && CYCLES == 3);
/// Oscillation, its change with frequency and damping, mid-line.
const BASIS: usize = 5;
/// Degrees of freedom that are left.
const FREE: usize = PAIRS - BASIS;

/// Calls `each` with the basis and the shape in each pair.
#[inline(always)]
fn pairs(shape: &[f32], damping_ratio: f32, mut each: impl FnMut([f32; BASIS], f32)) {
    // What remains of the amplitude after a pair; enough for damping ratios of interest.
    let x = damping_ratio * PHASE;
    let decay = 1.0 - x + 0.5 * x * x;
    let (turn_cos, turn_sin) = (decay * COS, decay * SIN);
    let (mut cos, mut sin, mut t) = (1.0_f32, 0.0_f32, -0.5_f32);
    for pair in shape.chunks_exact(2) {
        each([cos, sin, t * cos, t * sin, 1.0], pair[0] + pair[1]);
        (cos, sin) = (turn_cos * cos - turn_sin * sin, turn_sin * cos + turn_cos * sin);
        t += 1.0 / PAIRS as f32;
    }
}

/// Rms of what no damped oscillation near this damping ratio explains of a window's shape, over the shape's
/// own rms: of noise in the bins its share, of anything slower one and a half times it. Without either it is
/// below 3e-4; not a number where the shape is nothing.
pub fn misfit(features: &[f32; FEATURES], damping_ratio: f32) -> f32 {
    let shape = &features[..SHAPE];
    let mut a = nalgebra::SMatrix::<f32, BASIS, BASIS>::zeros();
    let mut right = nalgebra::SVector::<f32, BASIS>::zeros();
    let mut whole = 0.0_f32;
    pairs(shape, damping_ratio, |row, value| {
        let row = nalgebra::SVector::from(row);
        a += row * row.transpose();
        right += row * value;
        whole += value * value;
    });
    let Some(factor) = nalgebra::Cholesky::new(a) else { return f32::NAN };
    let share = factor.solve(&right);
    // Summed anew: as the difference of large numbers it would be lost.
    let mut left = 0.0_f32;
    pairs(shape, damping_ratio, |row, value| {
        let mut rest = value;
        for i in 0..BASIS {
            rest -= share[i] * row[i];
        }
        left += rest * rest;
    });
    // Pairs hold twice the square of the bins' noise, and four times that of the shape.
    libm::sqrtf(left / whole * (SHAPE as f32 / FREE as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A window of its own frequency, damping ratio and offset, in bins.
    fn window(
        damping_ratio: f64,
        cycles: f64,
        offset: f64,
        extra: impl Fn(f64) -> f64,
    ) -> [f32; FEATURES] {
        let mut features = [0.0; FEATURES];
        for (i, value) in features[..SHAPE].iter_mut().enumerate() {
            let phase = core::f64::consts::TAU * cycles * (i as f64 + 0.5) / SHAPE as f64;
            let decay = libm::exp(-damping_ratio * phase);
            *value = (decay * libm::sin(phase) + offset + extra(i as f64 / SHAPE as f64)) as f32;
        }
        features
    }

    #[test]
    fn a_damped_oscillation_leaves_nothing_and_anything_else_its_size() {
        for zeta in [-0.02, 0.001, 0.01, 0.05, 0.1] {
            // The window's length and the network's damping ratio are a little out.
            for (cycles, near) in [(3.0, zeta), (3.002, zeta + 3e-4), (2.998, zeta - 3e-4)] {
                let plain = misfit(&window(zeta, cycles, 0.05, |_| 0.0), near as f32);
                assert!(plain < 3e-4, "zeta {zeta} near {near}: {plain}");
            }
            // A step of a tenth of the amplitude in the middle.
            let step =
                misfit(&window(zeta, 3.0, 0.0, |t| if t < 0.5 { 0.0 } else { 0.1 }), zeta as f32);
            assert!((0.02..0.3).contains(&step), "zeta {zeta}: {step}");
        }
        assert!(misfit(&[0.0; FEATURES], 0.01).is_nan());
    }
}
