//! A white random moment behind an oscillator: the Kalman filter's steps, and the whitening of what the moment
//! adds to readings.

use crate::motion::oscillator::Flow;

/// State transition over `h` (s), none where the model does not oscillate, and the covariance (bb, br, rr)
/// that a moment of intensity `q` adds, the step being short against the period.
pub(crate) fn transition(
    h: f64,
    wn: f64,
    zeta: f64,
    intensity: f64,
) -> Option<([[f64; 2]; 2], [f64; 3])> {
    if zeta.abs() >= 1.0 || zeta.is_nan() {
        return None;
    }
    let Flow([p, q, u, v]) = Flow::new(wn, zeta, h);
    let added = [intensity * h.powi(3) / 3.0, intensity * h * h / 2.0, intensity * h];
    Some(([[p, q], [u, v]], added))
}

/// Covariance after a reading with `gain`.
pub(crate) fn updated(p: [f64; 3], gain: [f64; 2]) -> [f64; 3] {
    [p[0] - gain[0] * p[0], p[1] - gain[0] * p[1], p[2] - gain[1] * p[1]]
}

/// Covariance one step on.
pub(crate) fn predicted(f: &[[f64; 2]; 2], p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    let a = [
        [f[0][0] * p[0] + f[0][1] * p[1], f[0][0] * p[1] + f[0][1] * p[2]],
        [f[1][0] * p[0] + f[1][1] * p[1], f[1][0] * p[1] + f[1][1] * p[2]],
    ];
    [
        a[0][0] * f[0][0] + a[0][1] * f[0][1] + q[0],
        a[0][0] * f[1][0] + a[0][1] * f[1][1] + q[1],
        a[1][0] * f[1][0] + a[1][1] * f[1][1] + q[2],
    ]
}

/// Turns what a model leaves into white innovations of unit size in units of the noise: the filter's gains
/// for a start that is known, the model having its own.
pub(crate) struct Whitener {
    transition: [[f64; 2]; 2],
    gains: Vec<[f64; 2]>,
    roots: Vec<f64>,
}

impl Whitener {
    /// `ratio`: intensity over the noise's variance.
    pub(crate) fn new(step_s: f64, wn: f64, zeta: f64, ratio: f64, count: usize) -> Option<Self> {
        let (transition, q) = transition(step_s, wn, zeta, ratio)?;
        let mut p = [0.0_f64; 3];
        let (mut gains, mut roots) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for _ in 0..count {
            let variance = p[0] + 1.0;
            let gain = [p[0] / variance, p[1] / variance];
            gains.push(gain);
            roots.push(variance.sqrt());
            p = predicted(&transition, updated(p, gain), q);
        }
        Some(Self { transition, gains, roots })
    }

    pub(crate) fn whiten(&self, series: &mut [f64]) {
        let f = &self.transition;
        let mut x = [0.0; 2];
        for ((y, gain), root) in series.iter_mut().zip(&self.gains).zip(&self.roots) {
            let innovation = *y - x[0];
            *y = innovation / root;
            x = [x[0] + gain[0] * innovation, x[1] + gain[1] * innovation];
            x = [f[0][0] * x[0] + f[0][1] * x[1], f[1][0] * x[0] + f[1][1] * x[1]];
        }
    }
}
