//! A user's own effect: a moment written as an expression in a TOML file.
//!
//! ```toml
//! id = "stribeck_friction"
//! title = "Stribeck friction"
//! moment = "-c * tanh(r / 0.002) * (1 + s * exp(-abs(r) / v))"   # rad/s2
//! [parameters]
//! c = { unit = "rad/s2", start = 0.05, min = 0.0 }
//! s = { unit = "1", start = 0.5, min = 0.0 }
//! v = { unit = "rad/s", start = 0.1, min = 0.0 }
//! ```
//!
//! The moment is divided by Izz and added to b''. It may depend on the yaw angle `b` (rad), the yaw rate `r`
//! (rad/s), the time from the release `t` (s), the natural frequency `wn` (rad/s), the wind speed `wind`
//! (m/s, 0 where it is not known), its parameters, and states of its own, each with an equation of motion:
//!
//! ```toml
//! moment = "-c * z"
//! [[state]]
//! name = "z"
//! unit = "rad"
//! rate = "(b - z) / T"
//! ```
//!
//! This module is the one home of its formula: fits and the virtual rig both evaluate what is compiled here.

#![forbid(unsafe_code)]

mod channels;
mod checks;
mod document;
mod error;
mod expression;
mod file;
mod malformed;
mod naming;
mod number;
mod prepared;
mod program;
mod ready_made;
mod samples;
mod source;
mod state_file;
mod states;
mod translate;
mod units;

pub use channels::OfChannels;
pub use error::{Error, Result};
pub use file::{from_text, read};
pub use prepared::Prepared;
pub use program::{Program, State, MAX_PARAMETERS};
pub use ready_made::{all_ready_made, ready_made};
pub use states::{follow, OwnState, MAX_STATES};
pub use translate::{translate, Language};
pub use units::Unit;

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

/// One number of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: Cow<'static, str>,
    pub unit: Cow<'static, str>,
    pub min: f64,
    pub max: f64,
}

/// What is known of an effect beside its equations, each in a few words.
#[derive(Debug)]
pub struct Words {
    /// What usually brings it about on a yaw rig.
    pub cause: &'static str,
    /// What it looks like in a record.
    pub fingerprint: &'static str,
    /// What to do at the rig to see that it is this.
    pub confirm: &'static str,
    /// How to be rid of it.
    pub remove: &'static str,
    /// The release that would distinguish it from the effects it resembles.
    pub release: &'static str,
    /// The same of what has neither springs nor wind.
    pub elsewhere: Option<&'static Words>,
}

/// A definition that has passed its checks.
#[derive(Debug)]
pub struct OwnEffect {
    pub id: String,
    pub title: String,
    /// The moment as written, in one line.
    pub moment: String,
    /// As cards show it: the moment, and how its states change.
    pub formula: String,
    /// In the order of the file.
    pub parameters: Vec<Parameter>,
    /// A typical size of each, not zero.
    pub starts: Vec<f64>,
    /// It depends on time, or puts energy in: a release may never end by itself.
    pub keeps_moving: bool,
    /// In the order of the file; what its programs take behind the parameters.
    pub states: Vec<OwnState>,
    size_parameter: Option<usize>,
    /// What is not wrong but ought to be known.
    pub warnings: Vec<String>,
    pub program: Program,
    /// The whole text of its file.
    pub text: String,
    /// Of one that is there by name.
    pub words: Option<&'static Words>,
}

impl OwnEffect {
    /// The parameter to which the whole moment is in proportion, so that there is none where it is zero.
    pub fn size_parameter(&self) -> Option<usize> {
        self.size_parameter
    }

    /// Whether the sign of the yaw rate is in it: something changes where the model turns.
    pub fn has_rate_corner(&self) -> bool {
        self.programs().any(|p| p.has_rate_corner)
    }

    /// Whether the sign of the yaw angle is in it.
    pub fn has_yaw_corner(&self) -> bool {
        self.programs().any(|p| p.has_yaw_corner)
    }

    /// Whether the wind speed is in it.
    pub fn uses_wind(&self) -> bool {
        self.programs().any(Program::uses_wind)
    }

    /// Whether moment and rates of its states are linear in yaw angle, yaw rate and states.
    ///
    /// ```
    /// let lag = yawrig_expression::ready_made("first_order_lag").expect("it is there");
    /// assert!(lag.is_linear());
    /// ```
    pub fn is_linear(&self) -> bool {
        self.programs().all(|p| p.is_linear(self.parameters.len()))
    }

    fn programs(&self) -> impl Iterator<Item = &Program> {
        std::iter::once(&self.program).chain(self.states.iter().map(|s| &s.rate_program))
    }

    /// Root mean square of the moment over a cycle of `amplitude_rad` at `wn_rad_s`, rad/s2.
    pub fn strength(&self, parameters: &[f64], amplitude_rad: f64, wn_rad_s: f64) -> f64 {
        if !self.states.is_empty() {
            let swing = states::swing(&self.states, parameters, amplitude_rad, wn_rad_s, 0.0);
            let cycle = states::last_cycle(&swing);
            let square = |(state, z): &(State<f64>, [f64; MAX_STATES])| {
                let numbers = states::numbers(parameters, &z[..self.states.len()]);
                self.program.evaluate(state, &numbers).powi(2)
            };
            return (cycle.iter().map(square).sum::<f64>() / cycle.len() as f64).sqrt();
        }
        const POINTS: u32 = 64;
        let square = |k: u32| {
            let (s, c) = (TAU * (f64::from(k) + 0.5) / f64::from(POINTS)).sin_cos();
            let state = State {
                yaw_rad: amplitude_rad * c,
                rate_rad_s: -amplitude_rad * wn_rad_s * s,
                time_s: 0.0,
                natural_frequency_rad_s: wn_rad_s,
                wind_speed_m_s: 0.0,
                rate_sign: -s.signum(),
                yaw_sign: c.signum(),
            };
            self.program.evaluate(&state, parameters).powi(2)
        };
        ((0..POINTS).map(square).sum::<f64>() / f64::from(POINTS)).sqrt()
    }
}

/// Most own effects in one model.
pub const MAX_OWN: usize = 4;

/// An own effect with its numbers; those beyond its parameters are zero.
#[derive(Clone, Debug)]
pub struct OwnTerm {
    pub effect: Arc<OwnEffect>,
    pub values: [f64; MAX_PARAMETERS],
}

impl OwnTerm {
    pub fn new(effect: &Arc<OwnEffect>, numbers: &[f64]) -> Self {
        let n = effect.parameters.len();
        let mut values = [0.0; MAX_PARAMETERS];
        values[..n].copy_from_slice(&numbers[..n]);
        Self { effect: effect.clone(), values }
    }

    /// Moment and rates of the states for the many evaluations of one simulation.
    pub fn prepared(
        &self,
        natural_frequency_rad_s: f64,
        wind_speed_m_s: f64,
    ) -> (Prepared, Vec<Prepared>) {
        let of = |program: &Program| {
            Prepared::new(program, self.parameters(), natural_frequency_rad_s, wind_speed_m_s)
        };
        let rates = self.effect.states.iter().map(|s| of(&s.rate_program)).collect();
        (of(&self.effect.program), rates)
    }

    fn parameters(&self) -> &[f64] {
        &self.values[..self.effect.parameters.len()]
    }

    /// The moment over Izz, rad/s2, with the states `z`.
    #[inline]
    pub fn moment(&self, state: &State<f64>, z: &[f64]) -> f64 {
        self.effect.program.evaluate(state, &states::numbers(self.parameters(), z))
    }

    /// How fast its states `z` change, per s.
    #[inline]
    pub fn rates(&self, state: &State<f64>, z: &[f64]) -> [f64; MAX_STATES] {
        states::rates(&self.effect.states, self.parameters(), state, z)
    }

    /// Its states at a release from this angle; not numbers where they have no balance there.
    pub fn begun(
        &self,
        yaw_rad: f64,
        natural_frequency_rad_s: f64,
        wind_speed_m_s: f64,
    ) -> [f64; MAX_STATES] {
        let held = State {
            yaw_rad,
            rate_rad_s: 0.0,
            time_s: 0.0,
            natural_frequency_rad_s,
            wind_speed_m_s,
            // As it is let go, towards the middle.
            rate_sign: if yaw_rad > 0.0 { -1.0 } else { 1.0 },
            yaw_sign: if yaw_rad < 0.0 { -1.0 } else { 1.0 },
        };
        states::begun(&self.effect.states, self.parameters(), &held)
    }
}

/// Whether an argument names a file and not an identifier.
pub fn is_file(text: &str) -> bool {
    Path::new(text).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

#[cfg(test)]
mod error_tests;
#[cfg(test)]
mod state_tests;
#[cfg(test)]
mod tests;
