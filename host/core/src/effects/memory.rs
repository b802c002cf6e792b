//! Moments with a state of their own, which follows the angle and not the time.
//!
//! Between two turning points such a state is a function of the angle, so that it needs no integration: the
//! motion says where it turns, and asks for the moment at an angle.

use super::padded::{padded, MAX_NUMBERS};

/// Half cycles at one amplitude after which a state has forgotten how the swing began.
const FORGOTTEN_AFTER: usize = 12;

/// A moment that depends on the way the angle came.
pub(crate) trait Memory {
    /// The state after the angle has moved by `by_rad` in one direction.
    fn moved(p: &[f64], state: f64, by_rad: f64) -> f64;

    /// Over the inertia, rad/s2.
    fn moment(p: &[f64], state: f64) -> f64;

    /// How fast the state changes at this yaw rate: of what [`Self::moved`] is the integral.
    fn slope(p: &[f64], state: f64, rate_rad_s: f64) -> f64;
}

/// A moment with memory, with its numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Remembered {
    moved: fn(&[f64], f64, f64) -> f64,
    moment: fn(&[f64], f64) -> f64,
    slope: fn(&[f64], f64, f64) -> f64,
    p: [f64; MAX_NUMBERS],
}

impl Remembered {
    pub(super) fn new<M: Memory>(p: &[f64]) -> Self {
        Self { moved: M::moved, moment: M::moment, slope: M::slope, p: padded(p) }
    }
}

/// The states of a motion's moments where it turned last.
#[derive(Clone, Debug)]
pub(crate) struct Memories {
    each: Vec<(Remembered, f64)>,
    turned_at_rad: f64,
}

impl Memories {
    /// Of a motion at angle and rate `state` that turned last where its amplitude says. At a release its
    /// states come from one deflection out of rest at `middle_rad`; later on, `swinging`, from many turns.
    pub(super) fn begun(
        remembered: &[Remembered],
        [yaw_rad, rate_rad_s]: [f64; 2],
        natural_frequency_rad_s: f64,
        middle_rad: f64,
        swinging: bool,
    ) -> Self {
        let amplitude = (yaw_rad - middle_rad).hypot(rate_rad_s / natural_frequency_rad_s);
        let way = if rate_rad_s == 0.0 { middle_rad - yaw_rad } else { rate_rad_s };
        let out = -amplitude.copysign(way);
        let state = |m: &Remembered| {
            let first = (m.moved)(&m.p, 0.0, out);
            let turns = if swinging { FORGOTTEN_AFTER } else { 0 };
            (0..turns).fold(first, |z, _| {
                let across = (m.moved)(&m.p, z, -2.0 * out);
                (m.moved)(&m.p, across, 2.0 * out)
            })
        };
        Self {
            each: remembered.iter().map(|m| (*m, state(m))).collect(),
            turned_at_rad: middle_rad + out,
        }
    }

    /// Of a motion at this angle with these states.
    pub(super) fn at(remembered: &[Remembered], yaw_rad: f64, states: &[f64]) -> Self {
        let each = remembered.iter().copied().zip(states.iter().copied());
        Self { each: each.collect(), turned_at_rad: yaw_rad }
    }

    /// How fast the states change where the motion turned last, at this yaw rate.
    pub(crate) fn slopes(&self, rate_rad_s: f64) -> impl Iterator<Item = f64> + '_ {
        self.each.iter().map(move |(m, z)| (m.slope)(&m.p, *z, rate_rad_s))
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.each.is_empty()
    }

    /// The moments at an angle to which the model came without turning, rad/s2.
    pub(crate) fn moment(&self, yaw_rad: f64) -> f64 {
        let by = yaw_rad - self.turned_at_rad;
        self.each.iter().map(|(m, z)| (m.moment)(&m.p, (m.moved)(&m.p, *z, by))).sum()
    }

    /// The states at an angle to which the model came without turning.
    pub(crate) fn states(&self, yaw_rad: f64) -> Vec<f64> {
        let by = yaw_rad - self.turned_at_rad;
        self.each.iter().map(|(m, z)| (m.moved)(&m.p, *z, by)).collect()
    }

    /// The model turns at this angle.
    pub(crate) fn turn(&mut self, yaw_rad: f64) {
        let by = yaw_rad - self.turned_at_rad;
        self.each.iter_mut().for_each(|(m, z)| *z = (m.moved)(&m.p, *z, by));
        self.turned_at_rad = yaw_rad;
    }
}
