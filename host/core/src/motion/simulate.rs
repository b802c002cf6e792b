//! The yaw motion with effects, integrated with a fixed step.
//!
//! b'' = -2 zeta wn r - wn^2 b + effects. The linear part, a constant moment, dry friction between two
//! turning points and the spring beyond its dead zone are solved in closed form; the smooth rest enters as a
//! kick in the middle of each step (Strang's splitting: G. Strang, SIAM J. Numer. Anal. 5, 1968), so its
//! error is (wn h)^2 / 24 of the effect, 7e-4 at fifty steps a cycle, and none of the plain model. Turning
//! points and edges of the dead zone are located within their step, between which the smooth rest is
//! constant. A model with a user's own effects is left to `own_motion`, unless it only has to be swift.

use crate::effects::{Memories, Rotation, State};
use crate::motion::oscillator::{damped_rad_s, root, Flow, Walk};
pub use crate::motion::oscillator::{Grid, Motion};
use crate::motion::own_motion;
use crate::motion::pace::Pace;
use crate::motion::piece::Piece;
pub(crate) use crate::motion::side_by_side::readings_of_all;
use crate::motion::smooth_own::SmoothOwn;
use crate::record::Derivative;
use std::cell::Cell;

impl Motion {
    /// The reading at every instant of `grid`, rad.
    ///
    /// ```
    /// use yawrig_core::effects::{Effect, Terms};
    /// use yawrig_core::motion::simulate::{Grid, Motion};
    ///
    /// // Dry friction takes 2 c / wn^2 off the amplitude in half a cycle.
    /// let (wn, c) = (7.0, 0.3);
    /// let motion = Motion {
    ///     natural_frequency_rad_s: wn,
    ///     damping_ratio: 0.0,
    ///     yaw_rad: 0.2,
    ///     rate_rad_s: 0.0,
    ///     terms: Terms::new([(Effect::CoulombFriction, &[c][..])]),
    /// };
    /// let step_s = std::f64::consts::PI / wn / 50.0;
    /// let grid = Grid { start_s: 0.0, step_s, count: 51, mean_width_s: 0.0 };
    /// let yaw_rad = motion.readings(&grid);
    /// assert!((yaw_rad[50] + 0.2 - 2.0 * c / (wn * wn)).abs() < 1e-9);
    /// ```
    pub fn readings(&self, grid: &Grid) -> Vec<f64> {
        self.run(grid, Pace::Own, |_| {})
    }

    /// Reading, and yaw rate beside it.
    pub fn readings_and_rates(&self, grid: &Grid) -> (Vec<f64>, Vec<f64>) {
        let mut rates = Vec::with_capacity(grid.count);
        (self.run(grid, Pace::Own, |rate| rates.push(rate)), rates)
    }

    /// The readings; `store` is given each rate.
    pub(super) fn run(&self, grid: &Grid, mut pace: Pace, store: impl FnMut(f64)) -> Vec<f64> {
        let wn = self.natural_frequency_rad_s;
        let terms = &self.terms;
        let substeps = match &pace {
            Pace::Followed(steps, _) if steps.substeps > 0.0 => steps.substeps,
            _ => substeps(grid, wn),
        };
        let h = grid.step_s / substeps;
        let own = match terms.swift && !terms.precise && !terms.own().is_empty() {
            false => None,
            true => SmoothOwn::new(self, [grid.start_s, h]),
        };
        if own.is_none() && terms.adapts_steps() {
            let steps = (substeps as u64).saturating_mul(grid.count as u64);
            if let Pace::Kept(steps) = &mut pace {
                steps.substeps = substeps;
            }
            let mut walker = own_motion::Walker::new(self, h, steps, grid.start_s, pace);
            return self.follow(grid, substeps, &mut walker, store);
        }
        let mut walker = Walker::new(self, 0.5 * h, grid.start_s, own);
        self.follow(grid, substeps, &mut walker, store)
    }

    /// Reading and rate at every instant of `grid`; `walk` takes b, r and t one of `substeps` on. What has
    /// run away is no number.
    fn follow(
        &self,
        grid: &Grid,
        substeps: f64,
        walk: &mut impl Walk,
        mut store: impl FnMut(f64),
    ) -> Vec<f64> {
        let h = grid.step_s / substeps;
        let mut out = Vec::with_capacity(grid.count);
        let runaway_rad = self.runaway_rad();
        let (mut b, mut r) = (self.yaw_rad, self.rate_rad_s);
        let mut last = r;
        for k in 0..grid.count {
            let t = grid.time_s(k);
            last = r;
            out.push(match self.terms.observed {
                Derivative::None => b,
                Derivative::Rate => r,
                Derivative::Acceleration => walk.acceleration(b, r, t),
            });
            store(r);
            for i in 0..substeps as usize {
                (b, r) = walk.advance(b, r, t + i as f64 * h);
            }
            if !b.is_finite() || b.abs() > runaway_rad {
                out.resize(grid.count, f64::NAN);
                (k + 1..grid.count).for_each(|_| store(f64::NAN));
                break;
            }
        }
        self.read(grid, &mut out, [self.rate_rad_s, last]);
        out
    }

    /// What the sensor sees at every instant of `grid`, the rates at its ends being given, as it is read:
    /// means over its width.
    pub(super) fn read(&self, grid: &Grid, seen: &mut [f64], rates_rad_s: [f64; 2]) {
        let n = seen.len();
        if grid.mean_width_s > 0.0 && n > 1 {
            // A mean over a width falls short of the middle by y'' width^2 / 24.
            let share = (grid.mean_width_s / grid.step_s).powi(2) / 24.0;
            let [first, last] = match self.terms.observed {
                Derivative::None => {
                    let [first, last] = rates_rad_s.map(|r| r * grid.step_s);
                    [2.0 * (seen[1] - seen[0] - first), 2.0 * (seen[n - 2] - seen[n - 1] + last)]
                }
                _ => [curvature(seen.iter()), curvature(seen.iter().rev())],
            };
            let mut before = seen[0];
            seen[0] += share * first;
            for k in 1..n - 1 {
                let here = seen[k];
                seen[k] += share * (before - 2.0 * here + seen[k + 1]);
                before = here;
            }
            seen[n - 1] += share * last;
        }
        self.terms.read(seen, grid.start_s, grid.step_s);
    }
}

/// Steps from one instant of `grid` to the next, of a motion with this natural frequency: 48 a cycle at
/// least.
pub(super) fn substeps(grid: &Grid, natural_frequency_rad_s: f64) -> f64 {
    let steps = grid.step_s * natural_frequency_rad_s * 48.0 / std::f64::consts::TAU;
    steps.ceil().clamp(1.0, 1e4)
}

/// Second difference at the first of `values`, from a cubic through four of them; 0 with fewer.
fn curvature<'a>(mut values: impl Iterator<Item = &'a f64>) -> f64 {
    let mut next = || values.next().copied();
    match (next(), next(), next(), next()) {
        (Some(a), Some(b), Some(c), Some(d)) => 2.0 * a - 5.0 * b + 4.0 * c - d,
        _ => 0.0,
    }
}

/// The motion with the regime it is in.
pub(super) struct Walker<'a> {
    motion: &'a Motion,
    half: f64,
    pub(super) flow: Flow,
    /// Over a whole step, and the last two over another time, s: about a corner each is asked for several times.
    whole: Flow,
    others: Cell<[(f64, Flow); 2]>,
    pub(super) stiffness: f64,
    decay: f64,
    /// There is something that changes where the rate changes sign.
    pub(super) turns: bool,
    memories: Memories,
    pub(super) piece: Piece,
    /// Own effects, and dry friction with theirs, rad/s2.
    own: Option<SmoothOwn>,
    pub(super) friction: f64,
    drive: Rotation,
}

impl Walk for Walker<'_> {
    fn advance(&mut self, b: f64, r: f64, t: f64) -> (f64, f64) {
        let middle = t + self.half;
        let drive = self.drive.step();
        if self.turns && self.piece.direction == 0.0 {
            // As it is held.
            self.remember(b, 0.0, b);
            let end = self.with_corners(b, r, middle, drive);
            self.remember(b, 0.0, b);
            return end;
        }
        let moment =
            self.motion.terms.constant_moment_rad_s2 - self.friction * self.piece.direction;
        let rest = moment / self.stiffness;
        let (half_b, half_r) = self.travel(b, r, moment, self.half);
        self.remember(b, r, rest);
        let kicked = self.kick(half_b, half_r, middle, drive);
        let (next_b, next_r) = self.travel(half_b, kicked, moment, self.half);
        let is_smooth =
            !self.turned(next_r) && self.edge(half_b).is_none() && self.edge(next_b).is_none();
        let end = match is_smooth {
            true => (next_b, next_r),
            false => self.with_corners(b, r, middle, drive),
        };
        self.remember(half_b, kicked, rest);
        end
    }

    fn acceleration(&self, b: f64, r: f64, t: f64) -> f64 {
        let smooth = self.smooth(b, r, t, self.motion.terms.drive_at(t));
        let moment = self.spring_moment(b) + self.motion.terms.constant_moment_rad_s2 + smooth;
        let direction = match self.turns && self.piece.direction == 0.0 {
            true if moment.abs() <= self.friction => return 0.0,
            true => moment.signum(),
            false => self.piece.direction,
        };
        moment - 2.0 * self.decay * r - self.friction * direction
    }
}

impl<'a> Walker<'a> {
    pub(super) fn new(motion: &'a Motion, half: f64, start_s: f64, own: Option<SmoothOwn>) -> Self {
        let friction =
            motion.terms.dry_friction_rad_s2 + own.as_ref().map_or(0.0, |own| own.friction_rad_s2);
        let state = [motion.yaw_rad, motion.rate_rad_s];
        let whole = motion.flow(2.0 * half);
        Self {
            motion,
            half,
            flow: motion.flow(half),
            whole,
            others: Cell::new([(2.0 * half, whole); 2]),
            stiffness: motion.natural_frequency_rad_s.powi(2),
            decay: motion.damping_ratio * motion.natural_frequency_rad_s,
            turns: friction > 0.0 || motion.terms.turns(),
            memories: motion.memories(start_s),
            piece: Piece::at(state, motion.terms.dead_zone_rad),
            own,
            friction,
            drive: motion.terms.drive(start_s + half, 2.0 * half),
        }
    }

    /// Own effects that have states, half a step on from there, the middle of the motion being `rest`.
    #[inline]
    fn remember(&mut self, b: f64, r: f64, rest: f64) {
        if let Some(own) = &mut self.own {
            own.half_step(b - rest, r, rest);
        }
    }

    fn spring_moment(&self, b: f64) -> f64 {
        let g = self.motion.terms.dead_zone_rad;
        let deflection = if g > 0.0 { b - b.clamp(-g, g) } else { b };
        -self.stiffness * deflection
    }

    fn smooth(&self, b: f64, r: f64, t: f64, drive: f64) -> f64 {
        let state = State {
            yaw_rad: b,
            rate_rad_s: r,
            time_s: t,
            spring_moment_rad_s2: self.spring_moment(b),
        };
        let own = self.own.as_ref().map_or(0.0, |own| own.moment(b, r, t));
        let smooth = self.motion.terms.smooth_moment(&state, drive) + own;
        if self.memories.is_empty() {
            return smooth;
        }
        smooth + self.memories.moment(b)
    }

    fn kick(&self, b: f64, r: f64, t: f64, drive: f64) -> f64 {
        let middle = r + self.half * self.smooth(b, r, t, drive);
        r + 2.0 * self.half * self.smooth(b, middle, t, drive)
    }

    /// Whether the rate `r` is against the direction.
    fn turned(&self, r: f64) -> bool {
        self.turns && r * self.piece.direction < 0.0
    }

    fn edge(&self, b: f64) -> Option<f64> {
        self.piece.edge(b, self.motion.terms.dead_zone_rad)
    }

    /// A step with corners in it, `t` half-way. From one to the next what is smooth counts as it is between
    /// them: whether the model is held, and where it turns, is a matter of all moments together, which a kick
    /// would miss.
    pub(super) fn with_corners(
        &mut self,
        mut b: f64,
        mut r: f64,
        t: f64,
        drive: f64,
    ) -> (f64, f64) {
        let constant = self.motion.terms.constant_moment_rad_s2;
        let mut left = 2.0 * self.half;
        // More corners within one step are chatter.
        for _ in 0..16 {
            if self.turns && self.piece.direction == 0.0 {
                let moment = self.spring_moment(b) + constant + self.smooth(b, 0.0, t, drive);
                if moment.abs() <= self.friction {
                    return (b, 0.0);
                }
                self.piece.direction = moment.signum();
            }
            let plain = constant - self.friction * self.piece.direction;
            let here = plain + self.smooth(b, r, t, drive);
            let until = self.corner(b, r, here, left).map_or(left, |corner| corner.0);
            let (middle_b, middle_r) = self.travel(b, r, here, 0.5 * until);
            let moment = plain + self.smooth(middle_b, middle_r, t, drive);
            let Some((after, edge)) = self.corner(b, r, moment, left) else {
                return self.travel(b, r, moment, left);
            };
            (b, r) = self.travel(b, r, moment, after);
            left -= after;
            match edge {
                Some(edge) => {
                    b = edge;
                    self.piece.pass(b);
                }
                None => {
                    r = 0.0;
                    self.piece.direction = 0.0;
                    self.memories.turn(b);
                }
            }
            if left <= 0.0 {
                break;
            }
        }
        (b, r)
    }

    /// When, within `left` under the constant `moment`, the next corner is reached; its edge, where it is
    /// one.
    fn corner(&self, b: f64, r: f64, moment: f64, left: f64) -> Option<(f64, Option<f64>)> {
        let (b1, r1) = self.travel(b, r, moment, left);
        let turn = self.turned(r1).then(|| (self.turning(b, r, moment, left), None));
        let edge = self.edge(b1).map(|edge| {
            let from = (b1 - edge).signum();
            let at = |tau| -from * (self.travel(b, r, moment, tau).0 - edge);
            (root(left, at), Some(edge))
        });
        [edge, turn].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// When, at most `left` from now, the rate is zero under the constant `moment`.
    fn turning(&self, b: f64, r: f64, moment: f64, left: f64) -> f64 {
        let (g, Piece { direction, side, .. }) = (self.motion.terms.dead_zone_rad, self.piece);
        if r * direction <= 0.0 || g > 0.0 && side == 0.0 {
            return root(left, |tau| self.travel(b, r, moment, tau).1 * direction);
        }
        let damped = damped_rad_s(self.motion.natural_frequency_rad_s, self.decay);
        let deflection = b - self.piece.slack(g);
        let opposing = self.stiffness * deflection - moment + self.decay * r;
        ((damped * r * direction).atan2(opposing * direction) / damped).min(left)
    }

    /// The plain model's over `tau`.
    #[inline]
    fn flow_of(&self, tau: f64) -> Flow {
        if tau == self.half {
            return self.flow;
        }
        if tau == 2.0 * self.half {
            return self.whole;
        }
        let [last, before] = self.others.get();
        if let Some((_, known)) = [last, before].into_iter().find(|(known_s, _)| *known_s == tau) {
            return known;
        }
        let flow = self.motion.flow(tau);
        self.others.set([(tau, flow), last]);
        flow
    }

    /// b and r after `tau` under the constant `moment` and the spring of this side.
    fn travel(&self, b: f64, r: f64, moment: f64, tau: f64) -> (f64, f64) {
        let g = self.motion.terms.dead_zone_rad;
        if g > 0.0 && self.piece.side == 0.0 {
            let rate = 2.0 * self.decay;
            let x = rate * tau;
            let (run, fall) = if x.abs() < 1e-4 {
                (tau * (1.0 - 0.5 * x), tau * tau * (0.5 - x / 6.0))
            } else {
                let run = -(-x).exp_m1() / rate;
                (run, (tau - run) / rate)
            };
            return (b + r * run + moment * fall, r * (-x).exp() + moment * run);
        }
        let Flow([p, q, u, v]) = self.flow_of(tau);
        let middle = self.piece.slack(g) + moment / self.stiffness;
        let x = b - middle;
        (middle + p * x + q * r, u * x + v * r)
    }
}

#[cfg(test)]
#[path = "simulate_tests.rs"]
mod tests;
