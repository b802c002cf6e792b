//! The states of a user's own effects on the way: where a motion begins, at rest, and along a given one.

use super::linear_states::{Began, Linear};
use super::oscillator::{Flow, Motion, Walk};
use super::own_effects::{Own, States};
use super::own_motion::Walker;
use super::pace::Pace;
use super::piece::Piece;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::TAU;

/// Cycles from a release within which a motion is followed back to it.
const FROM_RELEASE: f64 = 3.0;
/// Times that the beginning of a motion is looked for at most; of one that has swung for long each is a cycle, in
/// all of which a state is taken to have forgotten where it began.
const TRIES: u32 = 24;
/// Of the amplitude, and of a state, to which a beginning is found: the steps of a fit change them by much more.
const FOUND: f64 = 1e-8;
/// Rate, as a share of that at the amplitude, beyond which a motion does not begin with a release from rest.
const AT_REST: f64 = 0.5;

impl Walker<'_> {
    /// How fast the states of the own effects change at this angle and rate, per s.
    pub(super) fn state_rates(&self, [b, r]: [f64; 2], t: f64) -> States {
        let piece = Piece::at([b, r], self.motion.terms.dead_zone_rad);
        self.own.rates([b, r, t], piece, &self.states)
    }

    /// The states of the own effects `h` s after t, angle and rate going from the one end to the other.
    pub(super) fn states_along(&self, ends: [[f64; 2]; 2], [t, h]: [f64; 2]) -> States {
        let [[b, r], [next_b, next_r]] = ends;
        let piece = Piece::at([0.5 * (b + next_b), next_b - b], self.motion.terms.dead_zone_rad);
        self.own.along(self.states, [t, h], piece, &|after| {
            let x = after / h;
            let y = 1.0 - x;
            // The cubic that has both angles and rates.
            let angle = y * y * (1.0 + 2.0 * x) * b + x * x * (1.0 + 2.0 * y) * next_b;
            [angle + x * y * h * (y * r - x * next_r), y * r + x * next_r]
        })
    }

    /// The states that they have where the model is held for `wait` s.
    pub(super) fn resting(&self, b: f64, t: f64, wait: f64) -> States {
        let held = Piece { direction: 0.0, ..self.piece };
        self.own.along(self.states, [t, wait], held, &|_| [b, 0.0])
    }
}

impl Motion {
    /// The states of the own effects where the model is held at this angle.
    pub(super) fn own_states_held_at(&self, yaw_rad: f64) -> States {
        let (wn, wind) = (self.natural_frequency_rad_s, self.terms.wind_speed_m_s);
        let mut out = States::default();
        let mut from = 0;
        for own in self.terms.own().iter().filter(|own| !own.effect.states.is_empty()) {
            let count = own.effect.states.len();
            out[from..from + count].copy_from_slice(&own.begun(yaw_rad, wn, wind)[..count]);
            from += count;
        }
        out
    }

    /// The states of the own effects at the first instant of a grid that starts at `start_s`, in their order
    /// and each in its unit: those of the motion that passes its angle and rate there. Soon after a release from
    /// rest it began there in balance; later on, or where it never was at rest, it has swung for many cycles.
    pub(crate) fn own_states(&self, start_s: f64) -> Vec<f64> {
        let count = Own::new(self).count;
        self.own_states_at(start_s)[..count].to_vec()
    }

    /// `start_s`, or where there are states the first instant after it at which they are those of a model that has
    /// swung for long.
    pub(crate) fn swinging_from(&self, start_s: f64) -> f64 {
        let cycle_s = TAU / self.natural_frequency_rad_s;
        match self.terms.own().iter().any(|own| !own.effect.states.is_empty()) {
            true => start_s.max((FROM_RELEASE + 1.0) * cycle_s),
            false => start_s,
        }
    }

    pub(super) fn own_states_at(&self, start_s: f64) -> States {
        let wn = self.natural_frequency_rad_s;
        if !self.terms.own().iter().any(|own| !own.effect.states.is_empty()) {
            return States::default();
        }
        if self.amplitude_rad() == 0.0 {
            return self.own_states_held_at(self.yaw_rad);
        }
        let linear = Linear::new(self);
        if start_s * wn <= FROM_RELEASE * TAU {
            let release = Trace::new(self, start_s.max(0.0), start_s);
            let held = |began: &Self, _: Option<States>| began.own_states_held_at(began.yaw_rad);
            let held_at = |yaw_rad: f64| self.own_states_held_at(yaw_rad);
            let near = linear.as_ref().and_then(|l| l.begun(self, release.back_s, &held_at));
            let found = release.back(near, &held);
            let at_rest =
                |began: &Self| began.rate_rad_s.abs() <= AT_REST * wn * self.amplitude_rad();
            if let Some(found) = found.filter(|found| at_rest(&found.began)) {
                return found.states;
            }
        }
        // Of linear states it is known what they are in a motion that has swung for long; what else bends it shows
        // along the way from there.
        if let Some(slow) = linear.and_then(|linear| linear.slow()) {
            let way = Trace::new(self, TAU / wn, start_s);
            let found = way.back(slow.begun(self, way.back_s), &|began, _| slow.states(began));
            let found = found.filter(|found| found.ends_there);
            return found.map_or_else(|| slow.states(self), |found| found.states);
        }
        let cycle = Trace::new(self, TAU / wn, start_s);
        let middle = self.own_states_held_at(self.rest_rad());
        // Once round is where it begins again.
        let round = |_: &Self, last: Option<States>| last.unwrap_or(middle);
        cycle.back(None, &round).map_or(States::default().map(|_| f64::NAN), |found| found.states)
    }
}

/// What is known of the way by which a motion came to its angle and rate.
struct Found {
    /// The states at its end.
    states: States,
    /// Where it began.
    began: Motion,
    /// Whether it ends at that angle and rate.
    ends_there: bool,
}

/// The way by which a motion came to its angle and rate.
struct Trace<'a> {
    motion: &'a Motion,
    back_s: f64,
    start_s: f64,
}

impl<'a> Trace<'a> {
    fn new(motion: &'a Motion, back_s: f64, start_s: f64) -> Self {
        Self { motion, back_s, start_s }
    }

    /// The way with the states that `first` gives for its beginning and for those at the end of the last try; none
    /// where no way leads here. From angle and rate `near` where it began, with how these depend on the end, or
    /// from those of the plain model.
    fn back(
        &self,
        near: Option<Began>,
        first: &dyn Fn(&Motion, Option<States>) -> States,
    ) -> Option<Found> {
        let motion = self.motion;
        let wn = motion.natural_frequency_rad_s;
        // The dependence is then as is seen of it (C. G. Broyden, Math. Comput. 19, 1965).
        let ([yaw_rad, rate_rad_s], mut inverse) = near.unwrap_or_else(|| {
            let (b, r) = motion.linear_state(-self.back_s);
            let Flow([p, q, u, v]) = motion.flow(-self.back_s);
            ([b, r], Matrix2::new(p, q * wn, u / wn, v))
        });
        let mut began = Motion { yaw_rad, rate_rad_s, ..motion.clone() };
        began.terms.precise = true;
        if self.back_s == 0.0 {
            return Some(Found { states: first(&began, None), began, ends_there: true });
        }
        let (mut last, mut before): (Option<States>, Option<[Vector2<f64>; 2]>) = (None, None);
        for _ in 0..TRIES {
            let z = first(&began, last);
            let (end, [b, r]) = self.walked(&began, z);
            let off = Vector2::new(motion.yaw_rad - b, (motion.rate_rad_s - r) / wn);
            if !off.norm().is_finite() {
                return None;
            }
            let is_found = off.norm() <= FOUND * motion.amplitude_rad();
            let apart = |(a, b): (&f64, &f64)| (a - b).abs() > FOUND * a.abs().max(b.abs());
            let is_settled = last.is_some_and(|last| !end.iter().zip(&last).any(apart));
            // What does not depend on the last try has nothing to settle.
            if is_found && (is_settled || first(&began, Some(end)) == z) {
                return Some(Found { states: end, began, ends_there: true });
            }
            if let Some([moved, was]) = before {
                // Friction holds it, or all bends too much.
                if near.is_some() && off.norm() >= was.norm() {
                    break;
                }
                let change = inverse * (was - off);
                let size = moved.dot(&change);
                if size != 0.0 {
                    inverse += (moved - change) * (moved.transpose() * inverse) / size;
                }
            }
            let moved = inverse * off;
            (began.yaw_rad, began.rate_rad_s) =
                (began.yaw_rad + moved.x, began.rate_rad_s + wn * moved.y);
            (before, last) = (Some([moved, off]), Some(end));
        }
        // Where friction holds it many ways end here, one as good as another.
        last.map(|states| Found { states, began, ends_there: false })
    }

    /// The states, angle and rate at the end of the way from `began` with `first`.
    fn walked(&self, began: &Motion, first: States) -> (States, [f64; 2]) {
        let steps = (self.back_s * began.natural_frequency_rad_s * 48.0 / TAU).ceil().max(1.0);
        let (h, from_s) = (self.back_s / steps, self.start_s - self.back_s);
        let mut walker = Walker::from(began, [h, from_s], steps as u64, Pace::Own, first);
        let (mut b, mut r) = (began.yaw_rad, began.rate_rad_s);
        for k in 0..steps as usize {
            (b, r) = walker.advance(b, r, from_s + k as f64 * h);
        }
        (walker.states, [b, r])
    }
}

#[cfg(test)]
#[path = "own_states_tests.rs"]
mod tests;
