//! The effects of a motion with their numbers, as the integration follows them.

use super::curves::Curves;
use super::memory::{Memories, Memory, Remembered};
use super::padded::{padded, MAX_NUMBERS};
use crate::record::Derivative;
use std::any::TypeId;
use std::array::from_fn;
use std::sync::Arc;
use yawrig_expression::OwnTerm;

/// Motions that are followed side by side.
pub(crate) const LANES: usize = 4;

/// Where a moment is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct State {
    pub(crate) yaw_rad: f64,
    pub(crate) rate_rad_s: f64,
    /// From the release.
    pub(crate) time_s: f64,
    /// Of the linear spring over the inertia, which a dead zone keeps from acting.
    pub(crate) spring_moment_rad_s2: f64,
}

/// The same of motions side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct States {
    pub(crate) yaw_rad: [f64; LANES],
    pub(crate) rate_rad_s: [f64; LANES],
    pub(crate) time_s: f64,
    pub(crate) spring_moment_rad_s2: [f64; LANES],
}

impl States {
    #[inline]
    fn of(&self, l: usize) -> State {
        State {
            yaw_rad: self.yaw_rad[l],
            rate_rad_s: self.rate_rad_s[l],
            time_s: self.time_s,
            spring_moment_rad_s2: self.spring_moment_rad_s2[l],
        }
    }
}

/// A smooth moment over the inertia, rad/s2.
pub(crate) trait Moment {
    fn moment(p: &[f64], state: &State) -> f64;
}

/// A change of the sensor's reading, rad.
pub(crate) trait Reading {
    fn change(p: &[f64], yaw_rad: f64, time_s: f64) -> f64;

    /// Adds the changes of all readings to `sums`: of what is `seen` at `start_s` and every `step_s` from
    /// there on.
    fn add_changes(p: &[f64], seen: &[f64], start_s: f64, step_s: f64, sums: &mut [f64]) {
        for (k, (sum, seen)) in sums.iter_mut().zip(seen).enumerate() {
            *sum += Self::change(p, *seen, start_s + k as f64 * step_s);
        }
    }
}

/// A smooth moment with its numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct SmoothMoment {
    law: TypeId,
    one: fn(&[f64], &State) -> f64,
    lanes: fn(&[[f64; LANES]; MAX_NUMBERS], &States, &mut [f64; LANES]),
    p: [f64; MAX_NUMBERS],
}

#[derive(Clone, Copy, Debug)]
struct ReadingChange {
    change: fn(&[f64], f64, f64) -> f64,
    add_changes: fn(&[f64], &[f64], f64, f64, &mut [f64]),
    p: [f64; MAX_NUMBERS],
}

fn lanes<M: Moment>(p: &[[f64; LANES]; MAX_NUMBERS], states: &States, sums: &mut [f64; LANES]) {
    let moments: [f64; LANES] = from_fn(|l| M::moment(&p.map(|p| p[l]), &states.of(l)));
    for l in 0..LANES {
        sums[l] += moments[l];
    }
}

/// Every effect of a motion: what the closed form solves, corners whose place is known, and the smooth rest.
#[derive(Clone, Debug, Default)]
pub struct Terms {
    /// Dry friction, rad/s2; the rate sticks at zero while the other moments are below it.
    pub(crate) dry_friction_rad_s2: f64,
    /// Over Izz; it moves the rest angle by itself over wn^2.
    pub constant_moment_rad_s2: f64,
    /// Half the width within which the spring does not act.
    pub(crate) dead_zone_rad: f64,
    /// Cosine and sine part of a periodic moment, rad/s2: `force[0] cos wt + force[1] sin wt`.
    force_rad_s2: [f64; 2],
    force_frequency_rad_s: f64,
    moments: Vec<SmoothMoment>,
    readings: Vec<ReadingChange>,
    /// Moments with a state of their own.
    remembered: Vec<Remembered>,
    /// The user's own effects.
    own: Vec<OwnTerm>,
    /// Of a measured law.
    curves: Option<Arc<Curves>>,
    /// For own effects that depend on it; 0: off, or not known.
    pub(crate) wind_speed_m_s: f64,
    /// What the sensor sees of the motion.
    pub(crate) observed: Derivative,
    /// Integrated by the steps that adapt themselves, as own effects are.
    pub(crate) precise: bool,
    /// Own effects that are not steep are followed by fixed steps: quicker, and less exact.
    pub(crate) swift: bool,
}

impl Terms {
    pub(crate) fn add_moment<M: Moment + 'static>(&mut self, p: &[f64]) {
        let law = TypeId::of::<M>();
        self.moments.push(SmoothMoment { law, one: M::moment, lanes: lanes::<M>, p: padded(p) });
    }

    pub(crate) fn add_reading<R: Reading>(&mut self, p: &[f64]) {
        let (change, add_changes) = (R::change, R::add_changes);
        self.readings.push(ReadingChange { change, add_changes, p: padded(p) });
    }

    pub(crate) fn add_memory<M: Memory>(&mut self, p: &[f64]) {
        self.remembered.push(Remembered::new::<M>(p));
    }

    /// What the moments with a state of their own remember at angle and rate `state`.
    pub(crate) fn memories(
        &self,
        state: [f64; 2],
        natural_frequency_rad_s: f64,
        middle_rad: f64,
        swinging: bool,
    ) -> Memories {
        Memories::begun(&self.remembered, state, natural_frequency_rad_s, middle_rad, swinging)
    }

    /// The same of a motion whose moments have these states at this angle.
    pub(crate) fn memories_at(&self, yaw_rad: f64, states: &[f64]) -> Memories {
        Memories::at(&self.remembered, yaw_rad, states)
    }

    pub(crate) fn add_curves(&mut self, curves: Curves) {
        self.curves = Some(Arc::new(curves));
    }

    pub(crate) fn add_own(&mut self, own: OwnTerm) {
        self.own.push(own);
    }

    /// Dry friction, which has corners where it is zero, too: what is derived by it is followed alike.
    pub(crate) fn rub(&mut self, dry_friction_rad_s2: f64) {
        self.dry_friction_rad_s2 += dry_friction_rad_s2.max(f64::MIN_POSITIVE);
    }

    /// A dead zone, of which the same holds.
    pub(super) fn loosen(&mut self, dead_zone_rad: f64) {
        self.dead_zone_rad += dead_zone_rad.max(f64::MIN_POSITIVE);
    }

    /// A periodic moment of this cosine and sine part.
    pub(crate) fn force(&mut self, parts_rad_s2: [f64; 2], frequency_rad_s: f64) {
        (self.force_rad_s2, self.force_frequency_rad_s) = (parts_rad_s2, frequency_rad_s);
    }

    /// No effect, at this wind speed.
    pub fn in_wind(wind_speed_m_s: f64) -> Self {
        Self { wind_speed_m_s, ..Self::default() }
    }

    /// Whether the splitting is not to be used.
    pub(crate) fn adapts_steps(&self) -> bool {
        self.precise || !self.own.is_empty()
    }

    pub(crate) fn own(&self) -> &[OwnTerm] {
        &self.own
    }

    /// The own effects that have states, and the constant moment, without all others.
    pub(crate) fn with_states_alone(&self) -> Self {
        let has_states = |own: &&OwnTerm| !own.effect.states.is_empty();
        Self {
            constant_moment_rad_s2: self.constant_moment_rad_s2,
            own: self.own.iter().filter(has_states).cloned().collect(),
            ..Self::in_wind(self.wind_speed_m_s)
        }
    }

    /// Whether the splitting follows it with no other corners than those of dry friction.
    pub(crate) fn is_smooth_between_turns(&self) -> bool {
        self.remembered.is_empty() && self.dead_zone_rad == 0.0 && !self.adapts_steps()
    }

    /// Whether something changes where the model turns.
    pub(crate) fn turns(&self) -> bool {
        self.dry_friction_rad_s2 > 0.0 || !self.remembered.is_empty()
    }

    /// The same with a sensor that shows what it sees as it is.
    pub(crate) fn unread(&self) -> Self {
        Self { readings: Vec::new(), ..self.clone() }
    }

    /// The same with a sensor that sees the yaw angle.
    pub(crate) fn of_angle(&self) -> Self {
        Self { observed: Derivative::None, ..self.clone() }
    }

    /// The same without a periodic moment, with a sensor that shows the yaw angle: what a cycle of the free
    /// motion is of.
    pub(crate) fn free(&self) -> Self {
        Self { force_rad_s2: [0.0; 2], observed: Derivative::None, ..self.unread() }
    }

    /// The periodic moment, to be followed in steps of `step_s` from `time_s` on.
    pub(crate) fn drive(&self, time_s: f64, step_s: f64) -> Rotation {
        Rotation::new(self.force_rad_s2, self.force_frequency_rad_s, 0.0, [time_s, step_s])
    }

    /// Whether there is a periodic moment.
    pub(crate) fn is_driven(&self) -> bool {
        self.force_rad_s2 != [0.0; 2]
    }

    /// The periodic moment at one instant, rad/s2.
    pub(crate) fn drive_at(&self, time_s: f64) -> f64 {
        if self.force_frequency_rad_s == 0.0 {
            return 0.0;
        }
        let (s, c) = (self.force_frequency_rad_s * time_s).sin_cos();
        self.force_rad_s2[0] * c + self.force_rad_s2[1] * s
    }

    /// The smooth moments with the periodic one, rad/s2. Friction, the dead zone and the constant moment are
    /// not among them: they have corners, or are exact in the linear solution.
    #[inline]
    pub(crate) fn smooth_moment(&self, state: &State, drive: f64) -> f64 {
        let curves =
            self.curves.as_ref().map_or(0.0, |c| c.moment(state.yaw_rad, state.rate_rad_s));
        self.moments.iter().map(|m| (m.one)(&m.p, state)).sum::<f64>() + curves + drive
    }

    /// Puts what the sensor shows in the place of what it sees, at `start_s` and every `step_s` from there
    /// on.
    pub(crate) fn read(&self, seen: &mut [f64], start_s: f64, step_s: f64) {
        let as_seen = if self.readings.is_empty() { Vec::new() } else { seen.to_vec() };
        for r in &self.readings {
            (r.add_changes)(&r.p, &as_seen, start_s, step_s, seen);
        }
    }

    /// What the sensor shows, at a time, of what it sees: of the yaw angle rad.
    #[inline]
    pub(crate) fn reading(&self, seen: f64, time_s: f64) -> f64 {
        let change = |r: &ReadingChange| (r.change)(&r.p, seen, time_s);
        seen + self.readings.iter().map(change).sum::<f64>()
    }
}

/// A line followed step by step, its angle turned on by one step each time: a periodic moment, or a decaying
/// part of the reading.
#[derive(Clone, Copy)]
pub(crate) struct Rotation {
    /// Cosine and sine part.
    parts: [f64; 2],
    now: (f64, f64),
    turn: (f64, f64),
}

impl Rotation {
    /// From `time_s` on in steps of `step_s`.
    pub(super) fn new(
        parts: [f64; 2],
        frequency_rad_s: f64,
        decay_per_s: f64,
        [time_s, step_s]: [f64; 2],
    ) -> Self {
        let after = |time_s: f64| {
            let size = (-decay_per_s * time_s).exp();
            let (sin, cos) = (frequency_rad_s * time_s).sin_cos();
            (size * sin, size * cos)
        };
        Self { parts, now: after(time_s), turn: after(step_s) }
    }

    /// Its value now, and one step on.
    #[inline]
    pub(crate) fn step(&mut self) -> f64 {
        let ((sin, cos), (turn_sin, turn_cos)) = (self.now, self.turn);
        self.now = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
        self.parts[0] * cos + self.parts[1] * sin
    }
}

/// The smooth moments of four motions of the same effects.
pub(crate) struct Moments {
    each: Vec<(SmoothMoment, [[f64; LANES]; MAX_NUMBERS])>,
    curves: [Option<Arc<Curves>>; LANES],
}

impl Moments {
    /// `None` where the motions have not the same effects.
    pub(crate) fn new(terms: [&Terms; LANES]) -> Option<Self> {
        let [first, others @ ..] = terms;
        let laws = |t: &Terms| t.moments.iter().map(|m| m.law).collect::<Vec<_>>();
        if others.iter().any(|other| laws(other) != laws(first)) {
            return None;
        }
        let lanes = |k: usize| from_fn(|i| terms.map(|t| t.moments[k].p[i]));
        let each = first.moments.iter().enumerate().map(|(k, m)| (*m, lanes(k))).collect();
        Some(Self { each, curves: terms.map(|t| t.curves.clone()) })
    }

    /// Adds the moments in each of `states` to `sums`, rad/s2.
    #[inline]
    pub(crate) fn add(&self, states: &States, sums: &mut [f64; LANES]) {
        for (moment, p) in &self.each {
            (moment.lanes)(p, states, sums);
        }
        for (l, curves) in self.curves.iter().enumerate() {
            let Some(curves) = curves else { continue };
            sums[l] += curves.moment(states.yaw_rad[l], states.rate_rad_s[l]);
        }
    }
}
