//! The effect library: what a second-order response may lack, each as a moment or a change of the reading.
//!
//! All moments are divided by Izz (rad/s2), angles in rad, time from the release in s. All that is an
//! effect's own stands in its file, as a `Law`; a user's own effect stands beside those of the library as
//! [`Effect::Own`].

mod contact;
mod curves;
mod law;
mod lines;
mod measured;
mod memory;
mod own;
mod padded;
mod says;
mod sourced;
mod terms;

pub(crate) use curves::KNOTS;
pub use curves::{Knots, Part};
pub(crate) use law::{Acts, LineParameters, Scale, Seen, Series};
pub use law::{Card, Equation, RollTerm};
pub(crate) use lines::FASTEST;
pub use measured::{Line, MeasuredLaw, MEASURED_LAW};
pub(crate) use memory::Memories;
pub use sourced::{Source, SourceKind, Sourced};
pub use terms::Terms;
pub(crate) use terms::{Moments, States, LANES};
pub(crate) use terms::{Rotation, State};
pub use yawrig_expression::{Parameter, MAX_OWN};

use crate::record::Measurand;
use law::Law;
use serde::{Serialize, Serializer};
use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::Arc;
use yawrig_expression::OwnEffect;

/// The library: a file and a name each.
macro_rules! library {
    ($(#[doc = $card:literal] $module:ident :: $effect:ident),* $(,)?) => {
        $(mod $module;)*

        /// Every effect of the library, and the user's own. In files and JSON it is its identifier.
        ///
        /// ```
        /// use yawrig_core::effects::Effect;
        ///
        /// let friction = Effect::from_id("coulomb_friction").expect("an effect of the library");
        /// assert_eq!(friction, Effect::CoulombFriction);
        /// let c = &friction.parameters()[0];
        /// assert_eq!((&*c.name, &*c.unit, c.min), ("c", "rad/s2", 0.0));
        /// println!("{}: {}", friction.card().title, friction.card().cause);
        /// ```
        #[derive(Clone, Debug)]
        pub enum Effect {
            $(#[doc = $card] $effect,)*
            /// A moment from a user's file.
            Own(Arc<OwnEffect>),
            /// Curves estimated from releases.
            Measured(Arc<MeasuredLaw>),
            /// One of these that goes with the wind.
            Sourced(Arc<Sourced>),
        }

        impl Effect {
            /// The library, in its order, without what is measured or the user's own.
            pub const ALL: [Self; [$(stringify!($effect)),*].len()] = [$(Self::$effect),*];

            fn law(&self) -> &dyn Law {
                match self {
                    $(Self::$effect => &$module::$effect,)*
                    Self::Own(own) => own,
                    Self::Measured(law) => law,
                    Self::Sourced(sourced) => sourced,
                }
            }
        }
    };
}

library! {
    /// Dry friction: `- c sign(r)`.
    coulomb_friction::CoulombFriction,
    /// Damping with the square of the rate: `- d |r| r`.
    quadratic_damping::QuadraticDamping,
    /// Damping with the square of the angle: `- c b^2 r`.
    cubic_damping::CubicDamping,
    /// Restoring moment that hardens or softens: `- k3 b^3`.
    cubic_stiffness::CubicStiffness,
    /// Restoring moment stiffer to one side: `- k2 b^2`.
    quadratic_stiffness::QuadraticStiffness,
    /// Constant moment: `+ m`.
    static_offset::StaticOffset,
    /// Free play: the spring does not act within `+-g`.
    free_play::FreePlay,
    /// Periodic moment: `+ f cos(w t + phi)`.
    harmonic_forcing::HarmonicForcing,
    /// Stiffness drifting in time: `wn^2 (1 + e t)`.
    stiffness_drift::StiffnessDrift,
    /// Random moment of intensity q.
    buffeting::Buffeting,
    /// A second mode in the reading, which dies out by itself.
    second_mode::SecondMode,
    /// Curved sensor scale: the reading is `b + s b^2`.
    sensor_nonlinearity::SensorNonlinearity,
    /// Zero drifting in time: the reading is `b + d t`.
    baseline_drift::BaselineDrift,
    /// Restoring moment that hardens or softens late: `- k5 b^5`.
    quintic_stiffness::QuinticStiffness,
    /// Pendulum: `+ g (b - sin b)`.
    pendulum_gravity::PendulumGravity,
    /// Stiffness that falls in a straight line with amplitude: `- k |b| b`.
    odd_quadratic_stiffness::OddQuadraticStiffness,
    /// Damping with a power of the rate: `- c |r|^n sign(r)`.
    power_damping::PowerDamping,
    /// End stop: `- k (|b| - g) sign(b)` beyond g.
    end_stop::EndStop,
    /// Hysteresis of the spring: `- h z`, `z' = r - |r| z / y`.
    hysteresis::Hysteresis,
    /// Stop on one side: `- k (b - g)` beyond g, whose sign is its side.
    one_sided_stop::OneSidedStop,
    /// Stops at both ends, unlike: `- ku (b - gu)` above gu, `- kl (b + gl)` below -gl.
    two_stops::TwoStops,
    /// Stop on one side that takes energy out: `- k (b - g) (1 + a r)` beyond g, whose sign is its side.
    damped_stop::DampedStop,
    /// Stops at both ends that take energy out.
    damped_stops::DampedStops,
}

impl Effect {
    /// The effect of the library with this identifier.
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.id() == id)
    }

    /// The identifiers of the library.
    pub fn ids() -> Vec<&'static str> {
        static ALL: [Effect; Effect::ALL.len()] = Effect::ALL;
        ALL.iter().map(Self::id).collect()
    }

    /// Those with a definite course, which a simulation can follow.
    pub(crate) fn deterministic() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|e| !e.is_random())
    }

    /// As files, JSON and the command line write it.
    pub fn id(&self) -> &str {
        self.law().id()
    }

    /// Whether it comes from a user's file.
    pub fn is_own(&self) -> bool {
        matches!(self.bare(), Self::Own(_))
    }

    /// The units of its states with equations of motion of their own.
    pub fn state_units(&self) -> Vec<String> {
        match self.bare() {
            Self::Own(own) => own.states.iter().map(|s| s.unit.clone()).collect(),
            _ => Vec::new(),
        }
    }

    /// Whether something of that name is a state in its [`Self::equation`].
    pub fn is_state(&self, name: &str) -> bool {
        match self.equation() {
            Some(Equation::Remembered { states, .. }) => states.iter().any(|s| s[0] == name),
            _ => false,
        }
    }

    /// Whether there are any.
    pub(crate) fn has_states(&self) -> bool {
        !self.state_units().is_empty()
    }

    /// The curves, where it is estimated from releases.
    pub fn measured(&self) -> Option<&MeasuredLaw> {
        match self {
            Self::Measured(law) => Some(law),
            _ => None,
        }
    }

    /// Which coefficient of a roll decay its first number is, over the inertia; most are none.
    pub fn roll_term(&self) -> Option<RollTerm> {
        self.law().roll_term()
    }

    /// Name of the first of its parameters as a result has it, `effect.name`.
    pub(crate) fn first_name(&self) -> String {
        format!("{self}.{}", self.parameters()[0].name)
    }

    /// As users read and write them. Friction, drag and play have one sign: they take energy out, or are
    /// lengths.
    pub fn parameters(&self) -> &[Parameter] {
        self.law().parameters()
    }

    /// Sizes at which the effect rivals the spring, one for each number the fit varies; of a user's own, many
    /// times its starts.
    pub(crate) fn sizes(&self, scale: &Scale) -> Vec<f64> {
        self.law().sizes(scale)
    }

    /// Starting values of what the fit varies; the first leaves the motion as it is without the effect.
    pub(crate) fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        self.law().starts(seen)
    }

    /// Writes what the fit varies into the terms.
    pub fn write(&self, p: &[f64], terms: &mut Terms) {
        self.law().write(p, terms);
    }

    /// The line in the spectrum that it is, if it is one.
    pub(crate) fn line(&self) -> Option<LineParameters> {
        self.law().line()
    }

    /// Places among the users' parameters of those that the fit varies as they are: all but size and phase of
    /// a line, which it varies as cosine and sine part, in the first two places.
    fn plain_places(&self, line: &LineParameters) -> impl Iterator<Item = usize> {
        let (count, size, phase) = (self.parameters().len(), line.size, line.phase);
        (0..count).filter(move |&place| place != size && place != phase)
    }

    /// The users' numbers from what the fit varies, and the derivatives of each by what the fit varies.
    pub fn published(&self, p: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let unit = |at: usize| (0..p.len()).map(|j| f64::from(u8::from(at == j))).collect();
        let Some(line) = self.line() else {
            return (p.to_vec(), (0..p.len()).map(unit).collect());
        };
        // a cos(wt + phi) = (a cos phi) cos wt + (-a sin phi) sin wt.
        let size = p[0].hypot(p[1]).max(f64::MIN_POSITIVE);
        let mut values = vec![0.0; p.len()];
        let mut rows = vec![vec![0.0; p.len()]; p.len()];
        values[line.size] = size;
        values[line.phase] = (-p[1]).atan2(p[0]);
        rows[line.size][..2].copy_from_slice(&[p[0] / size, p[1] / size]);
        rows[line.phase][..2].copy_from_slice(&[p[1] / (size * size), -p[0] / (size * size)]);
        for (varied, place) in (2..).zip(self.plain_places(&line)) {
            values[place] = p[varied];
            rows[place] = unit(varied);
        }
        (values, rows)
    }

    /// What the fit varies, from the users' numbers: those themselves, but cosine and sine part of a line.
    pub fn varied(&self, users: &[f64]) -> Vec<f64> {
        let Some(line) = self.line() else { return users.to_vec() };
        let (s, c) = users[line.phase].sin_cos();
        let parts = [users[line.size] * c, -users[line.size] * s];
        parts.into_iter().chain(self.plain_places(&line).map(|place| users[place])).collect()
    }

    /// Which of what the fit varies is the users' parameter `index`; `None` for size and phase of a line,
    /// which it varies as cosine and sine part.
    pub fn varied_place(&self, index: usize) -> Option<usize> {
        match self.line() {
            None => Some(index),
            Some(line) => self.plain_places(&line).position(|place| place == index).map(|k| k + 2),
        }
    }

    /// What the fit varies of a line whose phase is `by_rad` further on and whose size is `growth` times as
    /// large; of anything else the same.
    pub fn turned(&self, varied: &[f64], by_rad: f64, growth: f64) -> Vec<f64> {
        let mut turned = varied.to_vec();
        if self.line().is_some() {
            let (s, c) = by_rad.sin_cos();
            turned[0] = growth * (varied[0] * c - varied[1] * s);
            turned[1] = growth * (varied[0] * s + varied[1] * c);
        }
        turned
    }

    /// Damped frequency and decay of a line, rad/s and 1/s, from what the fit varies.
    pub(crate) fn line_of(&self, varied: &[f64]) -> Option<(f64, f64)> {
        let line = self.line()?;
        let w = varied[self.varied_place(line.frequency)?];
        let zeta =
            line.damping.and_then(|place| self.varied_place(place)).map_or(0.0, |at| varied[at]);
        Some((w * (1.0 - zeta * zeta).sqrt(), zeta * w))
    }

    /// Whether it is a line in the spectrum: a periodic moment, or a second mode.
    pub fn is_line(&self) -> bool {
        self.line().is_some()
    }

    /// Whether it is a line so near to `natural_frequency_rad_s` that a periodic moment is resonance and a
    /// second mode is the first; `varied` is what the fit varies.
    pub fn resonates(&self, varied: &[f64], natural_frequency_rad_s: f64) -> bool {
        let wn = natural_frequency_rad_s;
        let place = self.line().zip(self.line_of(varied));
        place.is_some_and(|(line, (w, _))| (w - wn).abs() < line.nearest * wn)
    }

    /// Whether the `number`th of what the fit varies belongs to one release alone: phases and sizes of lines,
    /// drifts.
    pub fn belongs_to_release(&self, number: usize) -> bool {
        self.law().belongs_to_release(number)
    }

    /// Bounds of what the fit varies, with its frequency kept on the side of the yaw mode where `start` is,
    /// and where it begins near that, half as far from it at least.
    pub(crate) fn bounds(&self, start: &[f64], natural_frequency_rad_s: f64) -> Vec<(f64, f64)> {
        let own = |p: &Parameter| (p.min, p.max);
        let Some(line) = self.line() else { return self.parameters().iter().map(own).collect() };
        let wn = natural_frequency_rad_s;
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let mut bounds = vec![free, free];
        for (varied, place) in (2..).zip(self.plain_places(&line)) {
            bounds.push(if place != line.frequency {
                own(&self.parameters()[place])
            } else {
                let apart = (start[varied] - wn).abs();
                let nearest =
                    if apart < line.nearest * wn { 0.5 * apart } else { line.nearest * wn };
                match start[varied] < wn {
                    true => (line.slowest * wn, wn - nearest),
                    false => (wn + nearest, FASTEST * wn),
                }
            });
        }
        bounds
    }

    /// The effect as text, from which other languages are written; `None` where it is random.
    pub fn equation(&self) -> Option<Equation<'_>> {
        self.law().equation()
    }

    /// Rows over what the fit varies, in its sizes, whose squares are added to those of the residuals: what
    /// keeps a measured law smooth.
    pub(crate) fn penalty(&self) -> Option<nalgebra::DMatrix<f64>> {
        self.measured().map(MeasuredLaw::penalty)
    }

    /// Formula, cause, fingerprint, confirmation, remedy.
    pub fn card(&self) -> Card<'_> {
        self.law().card()
    }

    /// The same in the words of what `measurand` is of: a pendulum has no springs and no wind.
    pub fn card_in(&self, measurand: &Measurand) -> Card<'_> {
        self.law().card_in(measurand.motion())
    }
}

impl Terms {
    /// `effects` with the users' numbers.
    pub fn new<'a>(effects: impl IntoIterator<Item = (Effect, &'a [f64])>) -> Self {
        let mut terms = Self::default();
        for (effect, users) in effects {
            effect.write(&effect.varied(users), &mut terms);
        }
        terms
    }
}

/// An effect is the one its identifier says.
impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        self.id() == other.id()
    }
}

impl Eq for Effect {}

impl Effect {
    /// The library's in its order, then the user's own by name.
    fn rank(&self) -> (usize, &str) {
        let place = Self::ALL.iter().position(|e| e == self);
        (place.unwrap_or(Self::ALL.len()), self.id())
    }
}

impl PartialOrd for Effect {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Effect {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.rank().cmp(&other.rank())
    }
}

impl Hash for Effect {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.id().hash(state);
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id())
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

#[cfg(test)]
mod tests;
