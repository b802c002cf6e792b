//! Own effects that the fixed steps of [`super::simulate`] can follow: all that is not steep.
//!
//! A jump at r = 0 of the same size at every angle is dry friction, which is solved in closed form; the rest
//! of the moment, continuous there, is a kick as those of the library are. What changes too much within a
//! step, as tanh(r / 0.002) does, is left to `own_motion`.

use crate::effects::Terms;
use std::cell::RefCell;
use yawrig_expression::Prepared;

/// The own effects of one motion.
pub(super) struct SmoothOwn {
    each: RefCell<Vec<Prepared>>,
    /// The jump at r = 0 as dry friction, rad/s2.
    pub(crate) friction_rad_s2: f64,
}

impl SmoothOwn {
    /// The own effects of `terms` for steps of `step_s`, where all of them can be followed so.
    /// `amplitude_rad`, at `wn` in rad/s: how far the motion goes.
    pub(super) fn of(terms: &Terms, wn: f64, amplitude_rad: f64, step_s: f64) -> Option<Self> {
        // States take steps of their own.
        if terms.own().iter().any(|own| !own.effect.states.is_empty()) {
            return None;
        }
        let prepared = |own: &yawrig_expression::OwnTerm| own.prepared(wn, terms.wind_speed_m_s).0;
        let mut own = Self {
            each: RefCell::new(terms.own().iter().map(prepared).collect()),
            friction_rad_s2: 0.0,
        };
        let (a, v) = (amplitude_rad, wn * amplitude_rad);
        let sign = |x: f64| if x == 0.0 { 1.0 } else { x.signum() };
        let at = |b: f64, r: f64| own.sum(b * a, r * v, 0.0, sign(r), sign(b));
        // Angles and rates, of the amplitude, at which the moment is looked at.
        let looked_at = [-1.0, -0.7, -0.4, -0.1, 0.02, 0.1, 0.4, 0.7, 1.0];
        let largest = looked_at
            .iter()
            .flat_map(|b| looked_at.map(|r| at(*b, r).abs()))
            .fold(f64::MIN_POSITIVE, f64::max);
        // Half the step at r = 0, and the moment half-way.
        let jump = |b: f64| {
            let [up, down] = [1.0, -1.0].map(|s| own.sum(b * a, 0.0, 0.0, s, sign(b)));
            (0.5 * (down - up), 0.5 * (up + down))
        };
        let (friction, _) = jump(looked_at[0]);
        let same = |x: f64, y: f64| (x - y).abs() <= 1e-9 * largest;
        if !largest.is_finite()
            || friction < 0.0
            || !looked_at.iter().all(|b| same(jump(*b).0, friction))
        {
            return None;
        }
        let within = step_s * wn;
        // A kick follows a change within a step of up to so much.
        let is_gentle = |change: f64| change.abs() <= 0.8 * largest;
        let gentle_in_rate = |b: f64| {
            let rest = |s: f64| at(b, s * within) + s * friction - jump(b).1;
            [1.0, -1.0].iter().all(|s| is_gentle(rest(*s)))
        };
        let gentle_in_yaw =
            |r: f64| [1.0, -1.0].iter().all(|s| is_gentle(at(s * within, r) - at(0.0, r)));
        let continuous = |r: f64| {
            let [up, down] = [1.0, -1.0].map(|s| own.sum(0.0, r * v, 0.0, sign(r), s));
            same(up, down)
        };
        let tame =
            looked_at.iter().all(|x| gentle_in_rate(*x) && gentle_in_yaw(*x) && continuous(*x));
        own.friction_rad_s2 = friction;
        tame.then_some(own)
    }

    fn sum(&self, b: f64, r: f64, t: f64, direction: f64, side: f64) -> f64 {
        self.each
            .borrow_mut()
            .iter_mut()
            .map(|own| own.evaluate([b, r, t, direction, side], &[]))
            .sum()
    }

    /// The moment without its jump, rad/s2.
    #[inline]
    pub(super) fn moment(&self, b: f64, r: f64, t: f64) -> f64 {
        let direction = if r < 0.0 { -1.0 } else { 1.0 };
        let side = if b < 0.0 { -1.0 } else { 1.0 };
        self.sum(b, r, t, direction, side) + self.friction_rad_s2 * direction
    }
}
