//! The effect library: what a second-order response may lack, each as a moment or a change of the reading.
//!
//! All moments are divided by Izz (rad/s2), angles in rad, time from the release in s. An effect writes its
//! coefficients into [`Terms`]; integrating, fitting and judging are done elsewhere. A user's own effect stands beside
//! those of the library as [`Effect::Own`].

use super::cards::Card;
use crate::error::{Error, Result};
use crate::own_effect::{self, OwnEffect, OwnTerm};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::path::Path;

pub use super::terms::{Scale, Terms};
pub use crate::own_effect::{Parameter, MOST_OWN};

/// Every effect of the library, and the user's own. In files and JSON it is its identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Effect {
    CoulombFriction,
    QuadraticDamping,
    CubicDamping,
    CubicStiffness,
    QuadraticStiffness,
    StaticOffset,
    FreePlay,
    HarmonicForcing,
    StiffnessDrift,
    Buffeting,
    SecondMode,
    SensorNonlinearity,
    BaselineDrift,
    PendulumGravity,
    OddQuadraticStiffness,
    /// A moment from a user's file.
    Own(&'static OwnEffect),
}

const FREE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
const POSITIVE: (f64, f64) = (0.0, f64::INFINITY);

const fn parameter(name: &'static str, unit: &'static str, range: (f64, f64)) -> Parameter {
    Parameter { name, unit, min: range.0, max: range.1 }
}

impl Effect {
    pub const ALL: [Self; 15] = [
        Self::CoulombFriction,
        Self::QuadraticDamping,
        Self::CubicDamping,
        Self::CubicStiffness,
        Self::QuadraticStiffness,
        Self::StaticOffset,
        Self::FreePlay,
        Self::HarmonicForcing,
        Self::StiffnessDrift,
        Self::Buffeting,
        Self::SecondMode,
        Self::SensorNonlinearity,
        Self::BaselineDrift,
        Self::PendulumGravity,
        Self::OddQuadraticStiffness,
    ];

    /// An effect from the command line or a model file: an identifier, or the path of a file ending in `.toml`.
    ///
    /// # Errors
    /// Exit 2 for an identifier that there is not, with the nearest; exit 3 for a file that cannot be used.
    pub fn named(text: &str) -> Result<Self> {
        if own_effect::is_file(text) {
            return Self::load(Path::new(text));
        }
        Self::from_id(text).ok_or_else(|| {
            let ids = Self::ALL.map(Self::id);
            Error::usage(format!("there is no effect \"{text}\"")).help(
                match own_effect::nearest(text, ids) {
                    Some(near) => format!(
                        "did you mean {near}? Your own is given as the path of its .toml file"
                    ),
                    None => format!(
                        "the effects are {}, or the path of your own effect's .toml file",
                        ids.join(", ")
                    ),
                },
            )
        })
    }

    /// Reads a user's own effect.
    ///
    /// # Errors
    /// Those of [`own_effect::load`].
    pub fn load(file: &Path) -> Result<Self> {
        own_effect::load(file, &Self::ALL.map(Self::id)).map(Self::Own)
    }

    /// A user's own effect from the `text` of its definition, which stands in `file`.
    ///
    /// # Errors
    /// Those of [`own_effect::define`].
    pub fn defined(file: &Path, text: &str) -> Result<Self> {
        own_effect::define(file, text, &Self::ALL.map(Self::id)).map(Self::Own)
    }

    /// Those with a definite course, which a simulation can follow.
    pub fn deterministic() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|e| *e != Self::Buffeting)
    }

    /// As files, JSON and the command line write it.
    pub fn id(self) -> &'static str {
        match self {
            Self::CoulombFriction => "coulomb_friction",
            Self::QuadraticDamping => "quadratic_damping",
            Self::CubicDamping => "cubic_damping",
            Self::CubicStiffness => "cubic_stiffness",
            Self::QuadraticStiffness => "quadratic_stiffness",
            Self::StaticOffset => "static_offset",
            Self::FreePlay => "free_play",
            Self::HarmonicForcing => "harmonic_forcing",
            Self::StiffnessDrift => "stiffness_drift",
            Self::Buffeting => "buffeting",
            Self::SecondMode => "second_mode",
            Self::SensorNonlinearity => "sensor_nonlinearity",
            Self::BaselineDrift => "baseline_drift",
            Self::PendulumGravity => "pendulum_gravity",
            Self::OddQuadraticStiffness => "odd_quadratic_stiffness",
            Self::Own(own) => &own.id,
        }
    }

    /// Of the library, or of a file read before.
    pub fn from_id(id: &str) -> Option<Self> {
        let own = || own_effect::find(id).map(Self::Own);
        Self::ALL.into_iter().find(|e| e.id() == id).or_else(own)
    }

    /// As users read and write them. Friction, drag and play have one sign: they take energy out, or are lengths.
    pub fn parameters(self) -> &'static [Parameter] {
        const COULOMB: [Parameter; 1] = [parameter("c", "rad/s2", POSITIVE)];
        const QUADRATIC: [Parameter; 1] = [parameter("d", "1/rad", POSITIVE)];
        const CUBIC: [Parameter; 1] = [parameter("c", "1/(rad2 s)", FREE)];
        const K3: [Parameter; 1] = [parameter("k3", "1/(rad2 s2)", FREE)];
        const K2: [Parameter; 1] = [parameter("k2", "1/(rad s2)", FREE)];
        const OFFSET: [Parameter; 1] = [parameter("m", "rad/s2", FREE)];
        const PLAY: [Parameter; 1] = [parameter("g", "rad", POSITIVE)];
        const FORCING: [Parameter; 3] = [
            parameter("f", "rad/s2", POSITIVE),
            parameter("w", "rad/s", POSITIVE),
            parameter("phi", "rad", FREE),
        ];
        const DRIFT: [Parameter; 1] = [parameter("e", "1/s", FREE)];
        const BUFFETING: [Parameter; 1] = [parameter("q", "rad2/s3", POSITIVE)];
        const MODE: [Parameter; 4] = [
            parameter("amplitude", "rad", POSITIVE),
            parameter("phase", "rad", FREE),
            parameter("w2", "rad/s", POSITIVE),
            parameter("zeta2", "1", (LEAST_MODE_DAMPING, MOST_MODE_DAMPING)),
        ];
        const SENSOR: [Parameter; 1] = [parameter("s", "1/rad", FREE)];
        const BASELINE: [Parameter; 1] = [parameter("d", "rad/s", FREE)];
        const GRAVITY: [Parameter; 1] = [parameter("g", "1/s2", FREE)];
        const ODD: [Parameter; 1] = [parameter("k", "1/(rad s2)", FREE)];
        match self {
            Self::CoulombFriction => &COULOMB,
            Self::QuadraticDamping => &QUADRATIC,
            Self::CubicDamping => &CUBIC,
            Self::CubicStiffness => &K3,
            Self::QuadraticStiffness => &K2,
            Self::StaticOffset => &OFFSET,
            Self::FreePlay => &PLAY,
            Self::HarmonicForcing => &FORCING,
            Self::StiffnessDrift => &DRIFT,
            Self::Buffeting => &BUFFETING,
            Self::SecondMode => &MODE,
            Self::SensorNonlinearity => &SENSOR,
            Self::BaselineDrift => &BASELINE,
            Self::PendulumGravity => &GRAVITY,
            Self::OddQuadraticStiffness => &ODD,
            Self::Own(own) => &own.parameters,
        }
    }

    /// Sizes at which the effect rivals the spring, one for each number the fit varies; of a user's own, many times its starts. The
    /// fit varies forcing and second mode by cosine and sine parts, which have no corner at nought as amplitude and
    /// phase have.
    pub fn sizes(self, scale: &Scale) -> Vec<f64> {
        let (a, wn, t) = (scale.amplitude_rad, scale.natural_frequency_rad_s, scale.duration_s);
        match self {
            Self::CoulombFriction | Self::StaticOffset => vec![wn * wn * a],
            Self::QuadraticDamping | Self::SensorNonlinearity => vec![1.0 / a],
            Self::CubicDamping => vec![wn / (a * a)],
            Self::CubicStiffness => vec![wn * wn / (a * a)],
            Self::QuadraticStiffness => vec![wn * wn / a],
            Self::FreePlay => vec![a],
            Self::HarmonicForcing => vec![wn * wn * a, wn * wn * a, 1.0 / t],
            Self::StiffnessDrift => vec![1.0 / t],
            Self::Buffeting => vec![wn.powi(3) * a * a],
            Self::SecondMode => vec![a, a, 1.0 / t, 0.1],
            Self::BaselineDrift => vec![a / t],
            Self::PendulumGravity => vec![6.0 * wn * wn / (a * a).min(1.0)],
            Self::OddQuadraticStiffness => vec![wn * wn / a],
            Self::Own(own) => own.starts.iter().map(|s| OWN_SIZE * s.abs()).collect(),
        }
    }

    /// Writes what the fit varies into the terms.
    pub fn write(self, p: &[f64], terms: &mut Terms) {
        match self {
            Self::CoulombFriction => terms.coulomb = p[0],
            Self::QuadraticDamping => terms.quadratic_damping = p[0],
            Self::CubicDamping => terms.cubic_damping = p[0],
            Self::CubicStiffness => terms.cubic_stiffness = p[0],
            Self::QuadraticStiffness => terms.quadratic_stiffness = p[0],
            Self::StaticOffset => terms.static_offset = p[0],
            Self::FreePlay => terms.free_play = p[0],
            Self::HarmonicForcing => {
                terms.forcing = [p[0], p[1]];
                terms.forcing_rad_s = p[2];
            }
            Self::StiffnessDrift => terms.stiffness_drift = p[0],
            Self::Buffeting => {}
            Self::SecondMode => {
                terms.mode = [p[0], p[1]];
                terms.mode_rad_s = p[2];
                terms.mode_damping = p[3];
            }
            Self::SensorNonlinearity => terms.sensor_quadratic = p[0],
            Self::BaselineDrift => terms.baseline_drift = p[0],
            Self::PendulumGravity => terms.gravity = p[0],
            Self::OddQuadraticStiffness => terms.odd_quadratic_stiffness = p[0],
            Self::Own(effect) => {
                let free = terms.own.iter_mut().find(|o| o.is_none_or(|o| o.effect == effect));
                *free.expect("at most MOST_OWN own effects in a model") =
                    Some(OwnTerm::new(effect, p));
            }
        }
    }

    /// The users' numbers from what the fit varies, and the rows of d users'/d varied.
    pub fn published(self, p: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let polar = matches!(self, Self::HarmonicForcing | Self::SecondMode);
        let unit = |i: usize| (0..p.len()).map(|j| f64::from(u8::from(i == j))).collect();
        let mut values = p.to_vec();
        let mut rows: Vec<Vec<f64>> = (0..p.len()).map(unit).collect();
        if polar {
            // a cos(wt + phi) = (a cos phi) cos wt + (-a sin phi) sin wt.
            let size = p[0].hypot(p[1]).max(f64::MIN_POSITIVE);
            let phase = (-p[1]).atan2(p[0]);
            let by_size = [p[0] / size, p[1] / size];
            let by_phase = [p[1] / (size * size), -p[0] / (size * size)];
            let at = |i: usize| if self == Self::HarmonicForcing { [0, 2, 1][i] } else { i };
            let mut out = vec![0.0; p.len()];
            let mut jacobian = vec![vec![0.0; p.len()]; p.len()];
            out[at(0)] = size;
            out[at(1)] = phase;
            jacobian[at(0)][..2].copy_from_slice(&by_size);
            jacobian[at(1)][..2].copy_from_slice(&by_phase);
            for i in 2..p.len() {
                out[at(i)] = p[i];
                jacobian[at(i)][i] = 1.0;
            }
            (values, rows) = (out, jacobian);
        }
        (values, rows)
    }

    /// What the fit varies from the users' numbers.
    pub fn varied(self, users: &[f64]) -> Vec<f64> {
        match self {
            Self::HarmonicForcing => {
                let (s, c) = users[2].sin_cos();
                vec![users[0] * c, -users[0] * s, users[1]]
            }
            Self::SecondMode => {
                let (s, c) = users[1].sin_cos();
                vec![users[0] * c, -users[0] * s, users[2], users[3]]
            }
            _ => users.to_vec(),
        }
    }

    /// Which of what the fit varies is the users' parameter `index`; `None` for size and phase of a line, which it
    /// varies as cosine and sine part.
    pub fn varied_place(self, index: usize) -> Option<usize> {
        let p: Vec<f64> = (0..self.parameters().len()).map(|i| 0.3 + 0.1 * i as f64).collect();
        let (_, rows) = self.published(&p);
        let parts: Vec<usize> = (0..p.len()).filter(|&j| rows[index][j] != 0.0).collect();
        match parts[..] {
            [one] => Some(one),
            _ => None,
        }
    }

    /// Whether the `number`th of what the fit varies belongs to one release alone: phases and sizes of lines, drifts.
    pub fn belongs_to_release(self, number: usize) -> bool {
        match self {
            Self::StiffnessDrift | Self::BaselineDrift => true,
            Self::HarmonicForcing | Self::SecondMode => number < 2,
            _ => false,
        }
    }

    /// Bounds of what the fit varies, with its frequency kept on the side of the yaw mode where `start` is.
    pub fn bounds(self, start: &[f64], natural_frequency_rad_s: f64) -> Vec<(f64, f64)> {
        let wn = natural_frequency_rad_s;
        let beside = |w: f64, least: f64, gap: f64| {
            if w < wn {
                (least * wn, (1.0 - gap) * wn)
            } else {
                ((1.0 + gap) * wn, FASTEST * wn)
            }
        };
        match self {
            Self::HarmonicForcing => vec![FREE, FREE, beside(start[2], 0.05, FORCING_GAP)],
            Self::SecondMode => vec![
                FREE,
                FREE,
                beside(start[2], MODE_GAP, MODE_GAP),
                (LEAST_MODE_DAMPING, MOST_MODE_DAMPING),
            ],
            _ => self.parameters().iter().map(|p| (p.min, p.max)).collect(),
        }
    }

    /// Formula, cause, fingerprint, confirmation, remedy.
    pub fn card(self) -> Card {
        super::cards::of(self)
    }
}

/// Of the start of a user's own parameter: its size, so that the fit's differences stand out of what a step size that
/// adapts itself leaves uncertain.
const OWN_SIZE: f64 = 30.0;
/// Forcing nearer to the natural frequency than this share cannot be told from the swing.
const FORCING_GAP: f64 = 0.1;
/// A second mode nearer than this share to the yaw mode, or to standing still, imitates whatever varies slowly.
const MODE_GAP: f64 = 0.3;
const LEAST_MODE_DAMPING: f64 = 0.001;
const MOST_MODE_DAMPING: f64 = 0.3;
/// Highest frequency looked for, in natural frequencies: half a dozen block means a cycle.
pub const FASTEST: f64 = 8.0;

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id())
    }
}

impl<'de> Deserialize<'de> for Effect {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let id = String::deserialize(deserializer)?;
        Self::from_id(&id)
            .ok_or_else(|| serde::de::Error::custom(format!("there is no effect \"{id}\"")))
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_those_of_files_and_command_line() {
        for effect in Effect::ALL {
            assert_eq!(serde_json::to_string(&effect).unwrap(), format!("\"{}\"", effect.id()));
            assert_eq!(Effect::from_id(effect.id()), Some(effect));
        }
    }

    #[test]
    fn users_numbers_and_fitted_ones_are_the_same_motion() {
        for (effect, users) in [
            (Effect::HarmonicForcing, vec![0.3, 5.0, 0.7]),
            (Effect::SecondMode, vec![0.01, -1.2, 30.0, 0.02]),
            (Effect::CoulombFriction, vec![0.1]),
        ] {
            let varied = effect.varied(&users);
            let (back, jacobian) = effect.published(&varied);
            for (a, b) in users.iter().zip(&back) {
                assert!((a - b).abs() < 1e-12);
            }
            for j in 0..varied.len() {
                let mut moved = varied.clone();
                moved[j] += 1e-7;
                let (there, _) = effect.published(&moved);
                for i in 0..users.len() {
                    let slope = (there[i] - back[i]) / 1e-7;
                    assert!((slope - jacobian[i][j]).abs() < 1e-3 * (1.0 + slope.abs()));
                }
            }
        }
        // f cos(w t + phi) at t = 0.4.
        let [p, q, w] = Effect::HarmonicForcing.varied(&[0.3, 5.0, 0.7])[..] else { panic!() };
        let t = 0.4_f64;
        let sum = p * (w * t).cos() + q * (w * t).sin();
        assert!((sum - 0.3 * (5.0 * t + 0.7).cos()).abs() < 1e-12);
    }
}
