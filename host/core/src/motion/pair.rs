//! The embedded Runge-Kutta pair of orders 5 and 4 (J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6,
//! 1980), and the plain model's flow to its nodes.

use super::oscillator::{Flow, Motion};

/// Where a step is looked at, of its length.
pub(super) const NODES: [f64; 5] = [1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0];
/// Weights of the slopes so far for each further state; the last row is the result of order 5.
pub(super) const WEIGHTS: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Order 5 less order 4.
pub(super) const ERROR: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// The plain model's flow to the nodes of a step, and of a unit moment back from them.
pub(super) struct Flows {
    pub(crate) step_s: f64,
    pub(crate) there: [Flow; 5],
    pub(crate) back: [[f64; 2]; 5],
}

impl Flows {
    pub(super) fn new(motion: &Motion, step_s: f64) -> Self {
        Self {
            step_s,
            there: NODES.map(|c| motion.flow(c * step_s)),
            back: NODES.map(|c| {
                let Flow([_, q, _, v]) = motion.flow(-c * step_s);
                [q, v]
            }),
        }
    }
}
