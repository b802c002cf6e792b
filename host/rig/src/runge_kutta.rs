//! One step of the integration.

/// One step of the classical fourth-order Runge-Kutta method from `state` over `h` s; `slope` gives the
/// state's rate of change at a time from the step's beginning, s, and a state.
pub fn runge_kutta<const N: usize>(
    state: [f64; N],
    h: f64,
    slope: impl Fn(f64, [f64; N]) -> [f64; N],
) -> [f64; N] {
    let at = |w: f64, k: &[f64; N]| std::array::from_fn(|i| state[i] + w * k[i]);
    let k1 = slope(0.0, state);
    let k2 = slope(0.5 * h, at(0.5 * h, &k1));
    let k3 = slope(0.5 * h, at(0.5 * h, &k2));
    let k4 = slope(h, at(h, &k3));
    std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}
