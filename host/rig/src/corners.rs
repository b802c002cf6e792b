//! The equation of motion with effects, integrated piece by piece.
//!
//! Friction, drag with the square of the rate, and free play have corners. Within a step the piece in force
//! is kept, its formula continued smoothly; where the step's end lies beyond the piece, the crossing is found
//! by bisection of the step, the state put exactly on the corner, and the rest of the step taken in the next
//! piece. So the order of the method survives the corners, and sticking is exact: r = 0, not small.
//! A corner crossed and recrossed within one step is passed over.

use super::effects::Effects;
use super::moments::{Moments, Moving, Piece};
use super::runge_kutta::runge_kutta;
use crate::error::{Error, Quantity, Result};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;
use yawrig_shared::modal::Modal;

/// Halvings that bring any step to the last bit.
const BISECTIONS: u32 = 60;
/// Difference of a step and its halves, rad and rad/s, above which a user's own moments want smaller steps.
const COARSE: f64 = 1e-10;
/// Most halvings of a step: a jump that nothing locates is then within a nanosecond.
const MAX_HALVINGS: u32 = 18;
/// Points between the release and half a turn at which the model is asked whether it would come back.
const POTENTIAL_POINTS: u32 = 4000;

/// A model swinging with effects.
#[derive(Clone, Debug)]
pub(super) struct Trajectory {
    moments: Moments,
    /// From the release, s.
    pub time_s: f64,
    pub state: Moving,
    piece: Piece,
    /// Where it last turned, rad.
    turned_at: Option<f64>,
    /// Half the distance between the last two turning points, rad; infinite before there are two.
    pub swing_rad: f64,
    random: ChaCha8Rng,
}

/// Refuses a release that says nothing: held by friction where it is, or never coming back.
///
/// # Errors
/// For either, and those of the effects' frequencies.
pub(super) fn check(modal: &Modal, effects: &Effects, released_rad: f64) -> Result<()> {
    effects.check_frequencies(modal)?;
    let trajectory = Trajectory::new(Moments::new(modal, effects), released_rad, 0);
    let torque = trajectory.moments.without_friction(0.0, trajectory.state, trajectory.piece, 0.0);
    let way = trajectory.moments.leaves(0.0, trajectory.state, trajectory.piece, 0.0);
    if way == 0.0 && !effects.drive_the_model() {
        return Err(Error::wrong(Quantity::Effect, format!(
            "nothing moves the model from where it is released: friction holds {} rad/s2, the other torque is {:.4} rad/s2",
            trajectory.moments.friction_rad_s2,
            torque.abs()
        ), "take less friction or free play, or release the model from a larger angle"));
    }
    let level = trajectory.moments.potential(released_rad);
    let comes_back = (1..=POTENTIAL_POINTS).any(|point| {
        let share = f64::from(point) / f64::from(POTENTIAL_POINTS);
        let b = released_rad + share * (PI.copysign(torque) - released_rad);
        trajectory.moments.potential(b) > level
    });
    if !comes_back {
        return Err(Error::wrong(Quantity::Effect,
            "with these effects the model turns right round instead of oscillating", "take smaller cubic_stiffness, quadratic_stiffness or static_offset, or release the model from a smaller angle"));
    }
    Ok(())
}

impl Trajectory {
    /// Let go at `b_rad`. Buffeting's random numbers are those of `seed` and none of the sensor's.
    pub fn new(moments: Moments, b_rad: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(1);
        let side = if b_rad.abs() > moments.play_rad { b_rad.signum() } else { 0.0 };
        Self {
            state: moments.held(b_rad),
            moments,
            time_s: 0.0,
            piece: Piece { rate: 0.0, side },
            turned_at: None,
            swing_rad: f64::INFINITY,
            random,
        }
    }

    /// b'' without a random moment, rad/s2; none where it is stuck.
    pub fn acceleration(&self) -> f64 {
        match self.piece.rate == 0.0 {
            true => 0.0,
            false => self.moments.acceleration(self.time_s, self.state, self.piece, 0.0),
        }
    }

    /// One step of `h` s.
    ///
    /// The random moment is constant over it and has the variance q / h, so that the yaw rate wanders by q h
    /// whatever the step.
    pub fn advance(&mut self, h: f64) {
        let random = if self.moments.buffeting_rad2_s3 == 0.0 {
            0.0
        } else {
            let deviate: f64 = StandardNormal.sample(&mut self.random);
            (self.moments.buffeting_rad2_s3 / h).sqrt() * deviate
        };
        self.advance_under(h, random, 0);
    }

    /// The same under one random moment, a user's own moments resolved by halving.
    fn advance_under(&mut self, h: f64, random: f64, halvings: u32) {
        if self.moments.has_own() && halvings < MAX_HALVINGS && self.is_coarse(h, random) {
            self.advance_under(0.5 * h, random, halvings + 1);
            self.advance_under(0.5 * h, random, halvings + 1);
            return;
        }
        let mut left = h;
        while left > 0.0 {
            let (next, outside) = self.attempt(left, random);
            if !outside {
                (self.time_s, self.state) = (self.time_s + left, next);
                return;
            }
            let (mut inside_s, mut outside_s) = (0.0, left);
            for _ in 0..BISECTIONS {
                let middle_s = 0.5 * (inside_s + outside_s);
                let end =
                    if self.attempt(middle_s, random).1 { &mut outside_s } else { &mut inside_s };
                *end = middle_s;
            }
            let (next, _) = self.attempt(outside_s, random);
            (self.time_s, self.state) = (self.time_s + outside_s, next);
            left -= outside_s;
            self.turn_the_corner(random);
        }
    }

    /// The state `h` s on if the present piece holds till then, and whether that lies beyond the piece.
    fn attempt(&self, h: f64, random: f64) -> (Moving, bool) {
        if self.piece.rate == 0.0 {
            let state = match self.moments.has_own() {
                false => self.state,
                true => runge_kutta(self.state, h, |dt, state| {
                    self.moments.slope_at_rest(self.time_s + dt, state, self.piece)
                }),
            };
            let way = self.moments.leaves(self.time_s + h, state, self.piece, random);
            return (state, way != 0.0);
        }
        let next = runge_kutta(self.state, h, |dt, state| {
            self.moments.slope(self.time_s + dt, state, self.piece, random)
        });
        (next, self.has_turned(next[1]) || self.has_changed_side(next[0]))
    }

    /// Whether one step and two halves of it differ.
    fn is_coarse(&self, h: f64, random: f64) -> bool {
        if self.piece.rate == 0.0 {
            return false;
        }
        let step = |state, from: f64, h| {
            runge_kutta(state, h, |dt, state| {
                self.moments.slope(self.time_s + from + dt, state, self.piece, random)
            })
        };
        let whole = step(self.state, 0.0, h);
        let halves = step(step(self.state, 0.0, 0.5 * h), 0.5 * h, 0.5 * h);
        !((whole[0] - halves[0]).abs() < COARSE && (whole[1] - halves[1]).abs() < COARSE)
    }

    fn has_turned(&self, r: f64) -> bool {
        self.piece.rate * r < 0.0
    }

    fn has_changed_side(&self, b: f64) -> bool {
        let Self { piece: Piece { side, .. }, moments: Moments { play_rad, .. }, .. } = self;
        if *side == 0.0 {
            b.abs() > *play_rad
        } else {
            *play_rad > 0.0 && side * b < *play_rad
        }
    }

    /// Puts the state, just beyond its piece, on the corner, and picks the next piece.
    fn turn_the_corner(&mut self, random: f64) {
        if self.piece.rate != 0.0 && self.has_changed_side(self.state[0]) {
            if self.piece.side == 0.0 {
                self.piece.side = self.state[0].signum();
                self.state[0] = self.piece.side * self.moments.play_rad;
            } else {
                self.state[0] = self.piece.side * self.moments.play_rad;
                self.piece.side = 0.0;
            }
        }
        if self.piece.rate == 0.0 || self.has_turned(self.state[1]) {
            self.state[1] = 0.0;
            if let (true, Some(before)) = (self.piece.rate != 0.0, self.turned_at) {
                self.swing_rad = 0.5 * (self.state[0] - before).abs();
            }
            self.turned_at = Some(self.state[0]);
            self.piece.rate = self.moments.leaves(self.time_s, self.state, self.piece, random);
        }
    }
}

#[cfg(test)]
#[path = "corners_tests.rs"]
mod tests;
