//! Own effects that the fixed steps of [`super::simulate`] can follow: all that is not steep.
//!
//! A jump at r = 0 of the same size at every angle is dry friction, which is solved in closed form; the rest
//! of the moment, continuous there, is a kick as those of the library are. What changes too much within a
//! step, as tanh(r / 0.002) does, is left to `own_motion`.

use super::linear_states::Late;
use super::oscillator::Motion;
use std::cell::RefCell;
use yawrig_expression::{OwnTerm, Prepared};

/// The own effects of one motion.
pub(super) struct SmoothOwn {
    each: RefCell<Vec<Prepared>>,
    /// The jump at r = 0 as dry friction, rad/s2.
    pub(crate) friction_rad_s2: f64,
    /// What has states, all of it linear.
    late: Option<Late>,
}

impl SmoothOwn {
    /// The own effects of `motion` for steps of `step_s` from `start_s` on, where all of them can be followed so.
    pub(super) fn new(motion: &Motion, [start_s, step_s]: [f64; 2]) -> Option<Self> {
        let (terms, wn) = (&motion.terms, motion.natural_frequency_rad_s);
        let has_states = |own: &&OwnTerm| !own.effect.states.is_empty();
        let late = match terms.own().iter().any(|own| has_states(&own)) {
            // Within a dead zone the spring that the half steps have does not act.
            true if terms.dead_zone_rad > 0.0 => return None,
            true => Some(Late::new(motion, start_s, 0.5 * step_s)?),
            false => None,
        };
        let others = terms.own().iter().filter(|own| !has_states(own));
        let prepared = |own: &OwnTerm| own.prepared(wn, terms.wind_speed_m_s).0;
        let mut own =
            Self { each: RefCell::new(others.map(prepared).collect()), friction_rad_s2: 0.0, late };
        let a = motion.amplitude_rad();
        let v = wn * a;
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
        let late = self.late.as_ref().map_or(0.0, |late| late.moment(b, r));
        self.sum(b, r, t, direction, side) + self.friction_rad_s2 * direction + late
    }

    /// Half a step on from this deflection and rate about a middle.
    #[inline]
    pub(super) fn half_step(&mut self, deflection: f64, r: f64, middle: f64) {
        if let Some(late) = &mut self.late {
            late.half_step(deflection, r, middle);
        }
    }
}
