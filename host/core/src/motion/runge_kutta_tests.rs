//! What the tests of motions integrate them by.

use super::oscillator::Motion;

/// A step of `h` s of the right-hand side by Runge and Kutta's order 4.
pub(super) fn stepped(motion: &Motion, t: f64, h: f64, state: &mut [f64]) {
    let on = |state: &[f64], slope: &[f64], h: f64| -> Vec<f64> {
        state.iter().zip(slope).map(|(x, s)| x + h * s).collect()
    };
    let first = motion.slope(t, state);
    let second = motion.slope(t + 0.5 * h, &on(state, &first, 0.5 * h));
    let third = motion.slope(t + 0.5 * h, &on(state, &second, 0.5 * h));
    let fourth = motion.slope(t + h, &on(state, &third, h));
    for (j, x) in state.iter_mut().enumerate() {
        *x += h / 6.0 * (first[j] + 2.0 * (second[j] + third[j]) + fourth[j]);
    }
}
