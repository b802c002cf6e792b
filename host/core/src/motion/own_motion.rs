//! The yaw motion with a user's own effects, which may be steep, stiff, or have corners; or wherever the
//! error of a splitting's step is not to be had ([`Terms::precise`](crate::effects::Terms::precise)).
//!
//! The plain model is solved in closed form and everything else enters through an embedded Runge-Kutta pair
//! of orders 5 and 4 in the frame that moves with it (J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6,
//! 1980; J. D. Lawson, SIAM J. Numer. Anal. 4, 1967), so that the error is one of the effects only and none
//! of the plain model. Steps are halved where the pair disagrees: at a friction of `tanh(r / 0.002)` each
//! time the model turns. Corners whose place is known, `abs` and `sign` of the yaw rate or angle, dry
//! friction and the dead zone, are located within the step, and a model whose rate is zero stays there while
//! the moments of both directions hold it.

use super::own_effects::{weighted, Own, States};
use super::pace::Pace;
use super::pair::{Flows, ERROR, NODES, WEIGHTS};
use super::piece::Piece;
use crate::effects::{Memories, State};
use crate::motion::oscillator::{root, Flow, Motion, Walk, MAX_HALVINGS};

/// A step's end: the state, the moment there besides the plain model's, and the pair's disagreement of the
/// amplitude.
#[derive(Clone, Copy)]
struct End {
    b: f64,
    r: f64,
    moment: f64,
    /// Of the own effects.
    states: States,
    error: f64,
}

/// The motion under way.
pub(crate) struct Walker<'a> {
    pub(super) motion: &'a Motion,
    step_s: f64,
    stiffness: f64,
    amplitude: f64,
    /// Disagreement of the pair in one step, of the amplitude, above which the step is halved.
    tolerance: f64,
    pub(super) piece: Piece,
    pub(super) own: Own,
    /// Of the own effects, now.
    pub(super) states: States,
    /// The largest each has been.
    largest: States,
    pub(super) memories: Memories,
    /// There is something that changes where the rate changes sign, or where the angle does.
    turns: bool,
    crosses: bool,
    /// Flows of the step and of its halvings, as far as they were needed.
    halved: Vec<Flows>,
    level: usize,
    attempts_left: u64,
    pace: Pace<'a>,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(
        motion: &'a Motion,
        step_s: f64,
        steps: u64,
        start_s: f64,
        pace: Pace<'a>,
    ) -> Self {
        let states = motion.own_states_at(start_s);
        Self::from(motion, [step_s, start_s], steps, pace, states)
    }

    /// From these states of the own effects.
    pub(super) fn from(
        motion: &'a Motion,
        [step_s, start_s]: [f64; 2],
        steps: u64,
        pace: Pace<'a>,
        states: States,
    ) -> Self {
        let terms = &motion.terms;
        let corner = |of: fn(&yawrig_expression::OwnEffect) -> bool| {
            terms.own().iter().any(|own| of(&own.effect))
        };
        let (b, r) = (motion.yaw_rad, motion.rate_rad_s);
        let turns = terms.turns() || corner(|own| own.has_rate_corner());
        Self {
            motion,
            step_s,
            stiffness: motion.natural_frequency_rad_s.powi(2),
            amplitude: motion.amplitude_rad(),
            tolerance: if terms.precise { 1e-10 } else { 5e-8 },
            piece: Piece::at([b, r], terms.dead_zone_rad),
            own: Own::new(motion),
            states,
            largest: states.map(f64::abs),
            memories: motion.memories(start_s),
            turns,
            crosses: corner(|own| own.has_yaw_corner()),
            halved: vec![Flows::new(motion, step_s)],
            level: 0,
            // More are a sign of what no step is short enough for.
            attempts_left: 20_000 + 50 * steps,
            pace,
        }
    }

    /// Everything but the plain model and what is constant in a piece, rad/s2.
    fn moment(&self, b: f64, r: f64, t: f64, piece: Piece, z: &States) -> f64 {
        let terms = &self.motion.terms;
        let inside = terms.dead_zone_rad > 0.0 && piece.side == 0.0;
        let spring = -self.stiffness * (b - piece.slack(terms.dead_zone_rad));
        // Within the dead zone the flow's spring is taken back.
        let (spring, taken_back) = if inside { (0.0, self.stiffness * b) } else { (spring, 0.0) };
        let state = State { yaw_rad: b, rate_rad_s: r, time_s: t, spring_moment_rad_s2: spring };
        terms.smooth_moment(&state, terms.drive_at(t))
            + self.own.moment([b, r, t], piece, z)
            + self.memories.moment(b)
            + taken_back
    }

    /// Where the plain model with the piece's constant moments would rest.
    fn middle(&self, piece: Piece) -> f64 {
        let terms = &self.motion.terms;
        piece.slack(terms.dead_zone_rad)
            + (terms.constant_moment_rad_s2 - terms.dry_friction_rad_s2 * piece.direction)
                / self.stiffness
    }

    /// One attempt over the step of `flows` from b, r at t, the moment there being `first`.
    fn attempt(&self, b: f64, r: f64, t: f64, first: f64, flows: &Flows) -> End {
        let h = flows.step_s;
        let middle = self.middle(self.piece);
        // Slopes in the frame of the plain motion: the flow back applied to (0, moment).
        let mut slopes = [[0.0; 2]; 7];
        slopes[0] = [0.0, first];
        let (mut end, mut last) = ([b, r], first);
        let mut rates = [States::default(); 7];
        let mut states = self.states;
        if self.own.count > 0 {
            rates[0] = self.own.rates([b, r, t], self.piece, &states);
        }
        for (k, weights) in WEIGHTS.iter().enumerate() {
            let mut x = [b - middle, r];
            for (weight, slope) in weights.iter().zip(&slopes).take(k + 1) {
                x[0] += h * weight * slope[0];
                x[1] += h * weight * slope[1];
            }
            let node = k.min(4);
            let Flow([p, q, u, v]) = flows.there[node];
            end = [middle + p * x[0] + q * x[1], u * x[0] + v * x[1]];
            let time_s = t + NODES[node] * h;
            if self.own.count > 0 {
                states = weighted(self.states, h, weights, &rates);
                rates[k + 1] = self.own.rates([end[0], end[1], time_s], self.piece, &states);
            }
            last = self.moment(end[0], end[1], time_s, self.piece, &states);
            slopes[k + 1] = flows.back[node].map(|back| back * last);
        }
        let mut error = [0.0; 2];
        for (weight, slope) in ERROR.iter().zip(&slopes) {
            error[0] += h * weight * slope[0];
            error[1] += h * weight * slope[1];
        }
        let wn = self.motion.natural_frequency_rad_s;
        let mut size = error[0].hypot(error[1] / wn) / self.amplitude;
        if self.own.count > 0 {
            let apart = weighted(States::default(), h, &ERROR, &rates);
            for (k, apart) in apart.iter().enumerate().filter(|(_, apart)| **apart != 0.0) {
                size += apart.abs() / self.largest[k].max(states[k].abs());
            }
        }
        End { b: end[0], r: end[1], moment: last, states, error: size }
    }

    fn attempt_of(&self, b: f64, r: f64, t: f64, first: f64, step_s: f64) -> End {
        self.attempt(b, r, t, first, &Flows::new(self.motion, step_s))
    }

    /// b'' at angle and rate `state`, rad/s2.
    pub(super) fn acceleration_at(&self, state: [f64; 2], t: f64) -> f64 {
        let piece = Piece::at(state, self.motion.terms.dead_zone_rad);
        self.acceleration_within(state[0], state[1], t, piece)
    }

    /// b'' on this piece, rad/s2.
    fn acceleration_within(&self, b: f64, r: f64, t: f64, piece: Piece) -> f64 {
        let motion = self.motion;
        let damping = 2.0 * motion.damping_ratio * motion.natural_frequency_rad_s;
        let linear = -damping * r - self.stiffness * (b - self.middle(piece));
        linear + self.moment(b, r, t, piece, &self.states)
    }

    /// Sees to it that there are flows of the step halved so often.
    fn halve(&mut self, level: usize) {
        self.level = level.min(MAX_HALVINGS);
        while self.halved.len() <= self.level {
            let half = 0.5 * self.halved[self.halved.len() - 1].step_s;
            self.halved.push(Flows::new(self.motion, half));
        }
    }

    fn walk(&mut self, mut b: f64, mut r: f64, t: f64) -> (f64, f64) {
        let mut at = 0.0;
        let mut first = None;
        while self.step_s - at > 1e-12 * self.step_s {
            let left = self.step_s - at;
            if self.attempts_left == 0 {
                return (f64::NAN, f64::NAN);
            }
            self.attempts_left -= 1;
            if self.turns && self.piece.direction == 0.0 {
                self.piece.direction = self.leaves(b, t + at, &self.states);
                if self.piece.direction == 0.0 {
                    let wait = self.held(b, t + at, left);
                    self.states = self.resting(b, t + at, wait.unwrap_or(left));
                    let Some(wait) = wait else { return (b, 0.0) };
                    at += wait;
                    continue;
                }
                first = None;
            }
            let moment =
                *first.get_or_insert_with(|| self.moment(b, r, t + at, self.piece, &self.states));
            if !moment.is_finite() {
                return (f64::NAN, f64::NAN);
            }
            let followed = self.pace.next();
            if let Some(level) = followed {
                self.halve(level);
            }
            let whole = self.step_s * 0.5f64.powi(self.level as i32);
            let end = if whole <= left {
                self.attempt(b, r, t + at, moment, &self.halved[self.level])
            } else {
                self.attempt_of(b, r, t + at, moment, left)
            };
            let step_s = whole.min(left);
            // The steps of another motion are followed up to eight tolerances.
            let bearable = followed.map_or(1.0, |_| 8.0) * self.tolerance;
            let good = end.error <= bearable;
            if !good && self.level < MAX_HALVINGS {
                // Halving a step divides the pair's disagreement by two to its order.
                let needed = ((end.error / self.tolerance).log2() / 5.0).ceil();
                let more = if needed.is_finite() { needed.clamp(1.0, 4.0) } else { 1.0 };
                self.halve(self.level + more as usize);
                continue;
            }
            if !end.error.is_finite() {
                return (f64::NAN, f64::NAN);
            }
            self.pace.keep(self.level);
            // One that does so much better is followed by one of twice the size.
            if end.error < self.tolerance / 64.0 {
                self.level = self.level.saturating_sub(1);
            }
            if self.is_within(end.b, end.r) {
                (b, r, first) = (end.b, end.r, Some(end.moment));
                self.take(end.states);
                at += step_s;
                continue;
            }
            let corner_s;
            (b, r, corner_s) = self.turn_the_corner(b, r, t + at, moment, step_s);
            // Finding it took about ten attempts.
            self.attempts_left = self.attempts_left.saturating_sub(10);
            // Where the model leaves its rest and is back at once, that takes the shortest step.
            at += corner_s.max(self.step_s * 0.5f64.powi(MAX_HALVINGS as i32));
            first = None;
        }
        (b, r)
    }

    /// Whether the state is still in its piece.
    fn is_within(&self, b: f64, r: f64) -> bool {
        let turned = self.turns && r * self.piece.direction < 0.0;
        let crossed = self.crosses && b * self.piece.half < 0.0;
        !turned && !crossed && self.piece.edge(b, self.motion.terms.dead_zone_rad).is_none()
    }

    /// Goes to the first corner within the step, into the next piece; how long that takes, s.
    fn turn_the_corner(
        &mut self,
        b: f64,
        r: f64,
        t: f64,
        first: f64,
        step_s: f64,
    ) -> (f64, f64, f64) {
        let end = self.attempt_of(b, r, t, first, step_s);
        let Piece { direction, half, .. } = self.piece;
        let turned = self.turns && end.r * direction < 0.0;
        let crossed = self.crosses && end.b * half < 0.0;
        let edge = self.piece.edge(end.b, self.motion.terms.dead_zone_rad);
        let go = |tau: f64| self.attempt_of(b, r, t, first, tau);
        let turn_s = if turned { root(step_s, |tau| go(tau).r * direction) } else { f64::INFINITY };
        let cross_s = if crossed { root(step_s, |tau| go(tau).b * half) } else { f64::INFINITY };
        let edge_s = edge.map_or(f64::INFINITY, |edge| {
            let from = (end.b - edge).signum();
            root(step_s, |tau| -from * (go(tau).b - edge))
        });
        let first_s = turn_s.min(cross_s).min(edge_s);
        let mut there = go(first_s);
        self.take(there.states);
        if first_s == edge_s {
            there.b = edge.unwrap_or(there.b);
            self.piece.pass(there.b);
        } else if first_s == cross_s {
            there.b = 0.0;
            self.piece.half = -half;
        } else {
            there.r = 0.0;
            self.piece.direction = 0.0;
            self.memories.turn(there.b);
        }
        (there.b, there.r, first_s)
    }

    /// The own effects have these states now.
    fn take(&mut self, states: States) {
        self.states = states;
        for (largest, state) in self.largest.iter_mut().zip(states) {
            *largest = largest.max(state.abs());
        }
    }

    /// Which way the model leaves where it rests with the states `z`; 0: neither moment moves it.
    fn leaves(&self, b: f64, t: f64, z: &States) -> f64 {
        let pull = |direction: f64| {
            let piece = Piece { direction, ..self.piece };
            self.stiffness * (self.middle(piece) - b) + self.moment(b, 0.0, t, piece, z)
        };
        let (up, down) = (pull(1.0), pull(-1.0));
        if up > 0.0 && up >= -down {
            1.0
        } else if down < 0.0 {
            -1.0
        } else {
            0.0
        }
    }

    /// How long the model stays held, if not for the `left` s to come.
    fn held(&self, b: f64, t: f64, left: f64) -> Option<f64> {
        let (mut from, mut to) = (0.0, left);
        let stays = |after: f64| self.leaves(b, t + after, &self.resting(b, t, after)) == 0.0;
        if stays(to) {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (from + to);
            if stays(middle) {
                from = middle;
            } else {
                to = middle;
            }
        }
        Some(to)
    }
}

impl Walk for Walker<'_> {
    /// NaN where a moment is not finite, or where a step takes too many attempts.
    fn advance(&mut self, b: f64, r: f64, t: f64) -> (f64, f64) {
        let end = self.walk(b, r, t);
        self.pace.end();
        end
    }

    fn acceleration(&self, b: f64, r: f64, t: f64) -> f64 {
        let mut piece = self.piece;
        if self.turns && piece.direction == 0.0 {
            piece.direction = self.leaves(b, t, &self.states);
            if piece.direction == 0.0 {
                return 0.0;
            }
        }
        self.acceleration_within(b, r, t, piece)
    }
}
