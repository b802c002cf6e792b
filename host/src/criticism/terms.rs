//! The coefficients of all effects of a motion, and what they do to it.

use crate::own_effect::{OwnTerm, MOST_OWN};

/// The coefficients of every effect, zero where it is absent. Fields in the units of the library's table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    pub coulomb: f64,
    pub quadratic_damping: f64,
    pub cubic_damping: f64,
    pub cubic_stiffness: f64,
    pub quadratic_stiffness: f64,
    pub static_offset: f64,
    pub free_play: f64,
    /// f cos phi and -f sin phi, so that f cos(w t + phi) = `p[0] cos wt + p[1] sin wt`.
    pub forcing: [f64; 2],
    pub forcing_rad_s: f64,
    pub stiffness_drift: f64,
    /// The second mode's reading at the release, cosine and sine part, rad.
    pub mode: [f64; 2],
    pub mode_rad_s: f64,
    pub mode_damping: f64,
    pub sensor_quadratic: f64,
    pub baseline_drift: f64,
    pub gravity: f64,
    pub odd_quadratic_stiffness: f64,
    /// The user's own effects, those there are first.
    pub own: [Option<OwnTerm>; MOST_OWN],
    /// For own effects that depend on it; 0: off, or not known.
    pub wind_speed_m_s: f64,
}

impl Terms {
    pub fn own(&self) -> impl Iterator<Item = &OwnTerm> {
        self.own.iter().map_while(Option::as_ref)
    }

    /// The smooth moments at yaw angle b, yaw rate r and time t, rad/s2. Friction, the dead zone and the constant
    /// moment are not among them: they have corners, or are exact in the linear solution.
    #[inline]
    pub fn smooth_moment(&self, b: f64, r: f64, spring_moment: f64, drive: f64, t: f64) -> f64 {
        let mut moment = -self.quadratic_damping * r.abs() * r
            - b * b
                * (self.cubic_damping * r + self.cubic_stiffness * b + self.quadratic_stiffness)
            - self.odd_quadratic_stiffness * b.abs() * b
            + self.stiffness_drift * t * spring_moment
            + drive;
        if self.gravity != 0.0 {
            moment += self.gravity * (b - b.sin());
        }
        moment
    }

    /// What the sensor shows of the yaw angle b at time t, rad.
    #[inline]
    pub fn reading(&self, b: f64, t: f64) -> f64 {
        let mut y = b + self.sensor_quadratic * b * b + self.baseline_drift * t;
        if self.mode_rad_s > 0.0 {
            let damped = self.mode_rad_s * (1.0 - self.mode_damping * self.mode_damping).sqrt();
            let (s, c) = (damped * t).sin_cos();
            y += (-self.mode_damping * self.mode_rad_s * t).exp()
                * (self.mode[0] * c + self.mode[1] * s);
        }
        y
    }
}

/// The size of a swing, from which sizes of effects follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub amplitude_rad: f64,
    pub natural_frequency_rad_s: f64,
    pub duration_s: f64,
}
