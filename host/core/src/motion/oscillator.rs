//! A motion, what is read of it, and its plain part in closed form.

use crate::effects::{Memories, Terms};

/// Most halvings of a step.
pub(crate) const MAX_HALVINGS: usize = 24;

/// Even grid of instants at which the reading is wanted, time from the release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The first instant.
    pub start_s: f64,
    /// From one instant to the next.
    pub step_s: f64,
    /// How many instants.
    pub count: usize,
    /// Width over which a reading is averaged; 0 for a point sample.
    pub mean_width_s: f64,
}

impl Grid {
    /// The `k`th instant, from 0 on.
    pub fn time_s(&self, k: usize) -> f64 {
        self.start_s + k as f64 * self.step_s
    }
}

/// A motion: the plain model, the effects, and the state at the grid's first instant.
#[derive(Clone, Debug)]
pub struct Motion {
    /// wn of the linear part.
    pub natural_frequency_rad_s: f64,
    /// zeta of the linear part; negative where it drives the motion.
    pub damping_ratio: f64,
    /// b at the grid's first instant.
    pub yaw_rad: f64,
    /// r = db/dt at the grid's first instant.
    pub rate_rad_s: f64,
    /// The effects with their numbers.
    pub terms: Terms,
}

/// A motion that is followed step by step.
pub(super) trait Walk {
    /// b and r a step on from `t`.
    fn advance(&mut self, b: f64, r: f64, t: f64) -> (f64, f64);

    /// b'' there, rad/s2.
    fn acceleration(&self, b: f64, r: f64, t: f64) -> f64;
}

/// b and r after some time as a linear function of them now, about the equilibrium.
#[derive(Clone, Copy)]
pub(crate) struct Flow(pub [f64; 4]);

/// Frequency of an oscillation that decays by `decay` (1/s); of one that does not oscillate, one that hardly
/// does.
pub(crate) fn damped_rad_s(wn: f64, decay: f64) -> f64 {
    (wn * wn - decay * decay).max(1e-12 * wn * wn).sqrt()
}

impl Flow {
    /// Of the plain model with natural frequency `wn` (rad/s) and damping ratio `zeta`; one that does not
    /// oscillate is taken as one that hardly does.
    pub(crate) fn new(wn: f64, zeta: f64, time_s: f64) -> Self {
        let decay = zeta * wn;
        let damped = damped_rad_s(wn, decay);
        let e = (-decay * time_s).exp();
        let (s, c) = (damped * time_s).sin_cos();
        let (ec, es) = (e * c, e * s / damped);
        Self([ec + decay * es, es, -wn * wn * es, ec - decay * es])
    }
}

impl Motion {
    /// What its moments with a state of their own remember at the first instant of a grid that starts at
    /// `start_s`.
    pub(crate) fn memories(&self, start_s: f64) -> Memories {
        let wn = self.natural_frequency_rad_s;
        let middle = self.rest_rad();
        let swinging = start_s * wn > std::f64::consts::TAU;
        self.terms.memories([self.yaw_rad, self.rate_rad_s], wn, middle, swinging)
    }

    /// Where the linear spring holds against the constant moment.
    pub(crate) fn rest_rad(&self) -> f64 {
        self.terms.constant_moment_rad_s2 / self.natural_frequency_rad_s.powi(2)
    }

    /// The same to whose sensor the yaw angle is what it sees.
    pub fn of_angle(&self) -> Self {
        Self { terms: self.terms.of_angle(), ..self.clone() }
    }

    /// Of the plain model with this state.
    pub(super) fn amplitude_rad(&self) -> f64 {
        self.yaw_rad.hypot(self.rate_rad_s / self.natural_frequency_rad_s)
    }

    /// A yaw angle beyond which the motion has run away: a thousand times its amplitude, or radians.
    pub(super) fn runaway_rad(&self) -> f64 {
        1e3 * self.amplitude_rad().max(1.0)
    }

    pub(crate) fn flow(&self, time_s: f64) -> Flow {
        Flow::new(self.natural_frequency_rad_s, self.damping_ratio, time_s)
    }

    /// Angle and rate `time_s` after the first instant (before it where negative), effects apart.
    pub(crate) fn linear_state(&self, time_s: f64) -> (f64, f64) {
        let Flow([p, q, u, v]) = self.flow(time_s);
        let middle = self.rest_rad();
        let x = self.yaw_rad - middle;
        (middle + p * x + q * self.rate_rad_s, u * x + v * self.rate_rad_s)
    }
}

/// Where a function that is positive at first, or rises from zero, and is negative at `end` is zero: regula
/// falsi (Illinois).
pub(crate) fn root(end: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (0.0, end);
    let (mut fa, mut fb) = (f(a), f(b));
    // A model that leaves its rest or an edge, and comes back.
    for _ in 0..MAX_HALVINGS {
        if fa != 0.0 {
            break;
        }
        let x = 0.5 * b;
        let fx = f(x);
        if fx > 0.0 {
            (a, fa) = (x, fx);
        } else {
            (b, fb) = (x, fx);
        }
    }
    if fa <= 0.0 {
        return 0.0;
    }
    let mut last = 0.0;
    for _ in 0..40 {
        let x = (a * fb - b * fa) / (fb - fa);
        let fx = f(x);
        if (x - last).abs() < 1e-13 * end || fx == 0.0 {
            return x;
        }
        last = x;
        if fx > 0.0 {
            (a, fa) = (x, fx);
            fb *= 0.5;
        } else {
            (b, fb) = (x, fx);
            fa *= 0.5;
        }
    }
    last
}
