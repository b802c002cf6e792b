//! What the effects add: torques divided by the inertia (rad/s2), and what the sensor makes of the angle
//! (rad).
//!
//! Base equation: Ramli 2008, chapter 3, b'' = -2 zeta wn r - wn^2 b, with the yaw angle b in rad and the
//! yaw rate r in rad/s. wn^2 and 2 zeta wn are those of the release, the wind's share included.

use super::effects::Effects;
use super::library::Smooth;
use yawrig_expression::{OwnTerm, State, MAX_OWN, MAX_PARAMETERS, MAX_STATES};
use yawrig_shared::modal::Modal;

/// What the equation of motion is of: yaw angle in rad, yaw rate in rad/s, deflection of the spring that
/// yields, rad, and the states of the user's own effects; those beyond what there are stay zero.
pub(super) type Moving = [f64; OWN + MAX_OWN * MAX_STATES];
/// Where the states of the user's own effects begin.
const OWN: usize = 3;

/// A piece of the equation of motion within which it is smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Sign of the yaw rate; 0: at rest, held by friction or by nothing pulling at it.
    pub rate: f64,
    /// -1 below the dead zone of the spring, 0 in it, 1 above. Without play always 1, with an edge at 0.
    pub side: f64,
}

/// Coefficients of every torque, zero for an absent effect.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// wn^2, rad2/s2.
    stiffness_rad2_s2: f64,
    /// 2 zeta wn, rad/s.
    damping_rad_s: f64,
    /// c, rad/s2: Coulomb's friction of the bearing, also the most it holds at rest.
    pub friction_rad_s2: f64,
    /// Moments that are smooth while the model moves one way, with their values.
    smooth: Vec<(Smooth, [f64; MAX_PARAMETERS])>,
    /// m, rad/s2: crooked flow or a bent spring.
    offset_rad_s2: f64,
    /// g, rad: half the dead zone.
    pub play_rad: f64,
    /// f in rad/s2, w in rad/s, phi in rad of f cos(w t + phi).
    forcing: [f64; 3],
    /// e, 1/s.
    stiffness_drift_per_s: f64,
    /// q, rad2/s3: over a time h the yaw rate wanders by a normal deviate of variance q h (two-sided: the
    /// moment's covariance is q delta(t - t')).
    pub buffeting_rad2_s3: f64,
    /// h in 1/s2 and y in rad of the spring that yields.
    hysteresis: [f64; 2],
    /// The user's own, and what they may depend on.
    own: Vec<OwnTerm>,
    natural_frequency_rad_s: f64,
    wind_speed_m_s: f64,
}

impl Moments {
    pub fn new(modal: &Modal, effects: &Effects) -> Self {
        let value = |id, name| effects.value(id, name).unwrap_or(0.0);
        Self {
            stiffness_rad2_s2: modal.stiffness_rad2_s2(),
            damping_rad_s: modal.damping_rad_s(),
            friction_rad_s2: value("coulomb_friction", "c"),
            smooth: effects.smooth(),
            offset_rad_s2: value("static_offset", "m"),
            play_rad: value("free_play", "g"),
            forcing: ["f", "w", "phi"].map(|name| value("harmonic_forcing", name)),
            stiffness_drift_per_s: value("stiffness_drift", "e"),
            buffeting_rad2_s3: value("buffeting", "q"),
            hysteresis: ["h", "y"].map(|name| value("hysteresis", name)),
            own: effects.own(),
            natural_frequency_rad_s: modal.natural_frequency_rad_s,
            wind_speed_m_s: effects.wind_speed_m_s(),
        }
    }

    /// The yielding spring's deflection once it has been pulled from no angle to b, rad.
    pub fn yielded(&self, b: f64) -> f64 {
        let [h, y] = self.hysteresis;
        if h == 0.0 {
            0.0
        } else {
            -(y * (-b.abs() / y).exp_m1()).copysign(-b)
        }
    }

    /// The model held at the angle b, rad.
    pub fn held(&self, b: f64) -> Moving {
        let mut state = [0.0; _];
        (state[0], state[2]) = (b, self.yielded(b));
        let mut from = OWN;
        for own in self.own.iter().filter(|own| !own.effect.states.is_empty()) {
            let begun = own.begun(b, self.natural_frequency_rad_s, self.wind_speed_m_s);
            let count = own.effect.states.len();
            state[from..from + count].copy_from_slice(&begun[..count]);
            from += count;
        }
        state
    }

    /// Rates of change of the state while the model moves.
    pub fn slope(&self, t: f64, state: Moving, piece: Piece, random: f64) -> Moving {
        let [b, r, z, ..] = state;
        let [h, y] = self.hysteresis;
        let mut slope = [0.0; _];
        slope[0] = r;
        slope[1] = self.acceleration(t, state, piece, random);
        slope[2] = if h == 0.0 { 0.0 } else { r - piece.rate * r * z / y };
        if self.has_own() {
            self.add_own_rates(t, [b, r], &state[OWN..], piece, &mut slope[OWN..]);
        }
        slope
    }

    /// The same while it rests: only the states of the user's own effects go on.
    pub fn slope_at_rest(&self, t: f64, state: Moving, piece: Piece) -> Moving {
        let mut slope = [0.0; _];
        self.add_own_rates(t, [state[0], 0.0], &state[OWN..], piece, &mut slope[OWN..]);
        slope
    }

    /// b'' in rad/s2, friction left out, at time t (s), angle b, rate r, in one piece of the equation; the
    /// yielding spring is deflected by z.
    pub fn without_friction(&self, t: f64, state: Moving, piece: Piece, random: f64) -> f64 {
        let [b, r, z, ..] = state;
        let stretch = if piece.side == 0.0 { 0.0 } else { b - piece.side * self.play_rad };
        let [f, w, phi] = self.forcing;
        let forcing = if f == 0.0 { 0.0 } else { f * (w * t + phi).cos() };
        let linear = -self.stiffness_rad2_s2 * (1.0 + self.stiffness_drift_per_s * t) * stretch
            - self.damping_rad_s * r;
        let smooth = |sum, (law, p): &(Smooth, [f64; MAX_PARAMETERS])| {
            sum + (law.moment)(p, b, r, piece.rate)
        };
        self.smooth.iter().fold(linear, smooth) + self.offset_rad_s2 + forcing + random
            - self.hysteresis[0] * z
            + if self.has_own() { self.own_moment(t, [b, r], &state[OWN..], piece) } else { 0.0 }
    }

    /// Whether there are moments that may be steep at any place.
    pub fn has_own(&self) -> bool {
        !self.own.is_empty()
    }

    fn own_state(&self, t: f64, [b, r]: [f64; 2], piece: Piece) -> State<f64> {
        State {
            yaw_rad: b,
            rate_rad_s: r,
            time_s: t,
            natural_frequency_rad_s: self.natural_frequency_rad_s,
            wind_speed_m_s: self.wind_speed_m_s,
            rate_sign: piece.rate,
            yaw_sign: if b < 0.0 { -1.0 } else { 1.0 },
        }
    }

    fn own_moment(&self, t: f64, at: [f64; 2], z: &[f64], piece: Piece) -> f64 {
        let state = self.own_state(t, at, piece);
        let mut from = 0;
        let moment = |own: &OwnTerm| {
            let states = from..from + own.effect.states.len();
            from = states.end;
            own.moment(&state, &z[states])
        };
        self.own.iter().map(moment).sum()
    }

    fn add_own_rates(&self, t: f64, at: [f64; 2], z: &[f64], piece: Piece, out: &mut [f64]) {
        let state = self.own_state(t, at, piece);
        let mut from = 0;
        for own in &self.own {
            let count = own.effect.states.len();
            let rates = own.rates(&state, &z[from..from + count]);
            out[from..from + count].copy_from_slice(&rates[..count]);
            from += count;
        }
    }

    /// Which way the model moves from rest in a state, -1 or 1; 0: friction holds it, or nothing pulls at it.
    pub fn leaves(&self, t: f64, mut state: Moving, piece: Piece, random: f64) -> f64 {
        state[1] = 0.0;
        let pull = |rate: f64| self.acceleration(t, state, Piece { rate, ..piece }, random);
        let (up, down) = (pull(1.0), pull(-1.0));
        if up > 0.0 && up >= -down {
            1.0
        } else if down < 0.0 {
            -1.0
        } else {
            0.0
        }
    }

    /// b'' in rad/s2 while the model moves.
    pub fn acceleration(&self, t: f64, state: Moving, piece: Piece, random: f64) -> f64 {
        self.without_friction(t, state, piece, random) - self.friction_rad_s2 * piece.rate
    }

    /// Potential energy over the inertia at the release, rad2/s2, forcing left out; zero at b = 0.
    pub fn potential(&self, b: f64) -> f64 {
        let stretch = (b.abs() - self.play_rad).max(0.0);
        let smooth = self.smooth.iter().map(|(law, p)| law.potential.map_or(0.0, |of| of(p, b)));
        0.5 * self.stiffness_rad2_s2 * stretch * stretch + smooth.sum::<f64>()
            - self.offset_rad_s2 * b
    }
}

/// How the reading differs from the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distortion {
    /// amplitude (rad), phase (rad), w2 (rad/s), zeta2.
    second_mode: [f64; 4],
    /// s, 1/rad.
    nonlinearity_per_rad: f64,
    /// d, rad/s.
    drift_rad_s: f64,
}

impl Distortion {
    pub fn new(effects: &Effects) -> Self {
        let value = |id, name| effects.value(id, name).unwrap_or(0.0);
        Self {
            second_mode: ["amplitude", "phase", "w2", "zeta2"]
                .map(|name| value("second_mode", name)),
            nonlinearity_per_rad: value("sensor_nonlinearity", "s"),
            drift_rad_s: value("baseline_drift", "d"),
        }
    }

    /// What the sensor shows of what it sees (b, of the angle rad) at t (s). The second mode rings from the
    /// release on.
    pub fn reading(&self, t: f64, b: f64) -> f64 {
        let [amplitude, phase, w2, zeta2] = self.second_mode;
        let ringing = if amplitude == 0.0 || t < 0.0 {
            0.0
        } else {
            let wd2 = w2 * (1.0 - zeta2 * zeta2).sqrt();
            amplitude * (-zeta2 * w2 * t).exp() * (wd2 * t + phase).cos()
        };
        b + self.nonlinearity_per_rad * b * b + self.drift_rad_s * t + ringing
    }
}
