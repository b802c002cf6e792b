//! What an effect supplies: its names, sizes and starts, how it enters the motion, and its card for the user.
//!
//! An effect never integrates, fits, judges or plots. One whose size and phase belong to a line in the
//! spectrum says so with a [`LineParameters`]: the fit varies its cosine and sine part, which have no corner
//! at zero as size and phase have.

use super::lines;
use super::terms::Terms;
use crate::quantity::Quantity;
use crate::record::Called;
use std::borrow::Cow;
pub(super) use yawrig_expression::Parameter;
use yawrig_expression::Unit;

/// One effect. Moments are divided by Izz (rad/s2), angles in rad, time from the release in s.
pub(crate) trait Law: Send + Sync {
    /// As files, JSON and the command line write it.
    fn id(&self) -> &str;

    /// As users read and write them. What takes energy out, and lengths, have one sign.
    fn parameters(&self) -> &[Parameter];

    /// Sizes at which the effect rivals the spring, one for each number the fit varies.
    fn sizes(&self, scale: &Scale) -> Vec<f64>;

    /// Puts the effect with the numbers that the fit varies into the motion.
    fn write(&self, p: &[f64], terms: &mut Terms);

    /// Formula, cause, fingerprint, confirmation, remedy.
    fn card(&self) -> Card<'_>;

    /// The same in the words of another motion than that of a rig in the wind.
    fn card_in(&self, _motion: Called) -> Card<'_> {
        self.card()
    }

    /// It as text, where text can hold it.
    fn equation(&self) -> Option<Equation<'_>> {
        None
    }

    /// Where a fit begins; the first leaves the motion as it is without the effect.
    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        let size = SMALL * self.sizes(&seen.scale)[0];
        let mut starts = vec![vec![0.0], vec![size]];
        if self.parameters()[0].min < 0.0 {
            starts.push(vec![-size]);
        }
        starts
    }

    /// The line in the spectrum that it is, if it is one.
    fn line(&self) -> Option<LineParameters> {
        None
    }

    /// Whether the `number`th of what the fit varies belongs to one release alone, as a drift does.
    fn belongs_to_release(&self, number: usize) -> bool {
        self.line().is_some() && number < 2
    }

    /// What it depends on.
    fn acts_on(&self) -> Acts {
        match self.line() {
            Some(_) => Acts::Line,
            None => Acts::State,
        }
    }

    /// Whether its only number is its strength, to which all that it does is in proportion.
    fn is_proportional(&self) -> bool {
        self.parameters().len() == 1
    }

    /// Whether it is a law of an angle, of no other displacement.
    fn is_of_angle(&self) -> bool {
        false
    }

    /// Whether it moves the angle of rest and does nothing else.
    fn moves_rest(&self) -> bool {
        false
    }

    /// Whether it holds the model at rest while the other moments are small.
    fn sticks(&self) -> bool {
        false
    }

    /// Whether its strength may be negative as far as its bounds go, and takes energy out where it is not.
    fn takes_energy_out(&self) -> bool {
        false
    }

    /// Which coefficient of a roll decay its first number is, over the inertia.
    fn roll_term(&self) -> Option<RollTerm> {
        None
    }

    /// Place of its strength among its numbers, and the power of the wind speed with which that goes where the
    /// air makes it, by its dimension: not a number where others of the users' numbers decide it that are not
    /// given. `None` where it is no moment of the state in proportion to a strength.
    fn wind_power(&self, _users: &[f64]) -> Option<(usize, f64)> {
        let is_moment = matches!(self.equation(), Some(Equation::Moment(_)));
        let unit = Unit::parse(&self.parameters().first()?.unit).ok()?;
        (is_moment && self.acts_on() == Acts::State).then(|| (0, 0.0 - unit.seconds()))
    }

    /// The name of the strength as a dimensionless derivative of the yaw moment, and the sign with which it
    /// stands in the moment.
    fn derivative(&self) -> Option<(&'static str, f64)> {
        None
    }

    /// Where its moment is an odd function of the angle alone, which part of a series.
    fn series(&self) -> Option<Series> {
        None
    }

    /// Amplitude up to which it cannot be told from simpler effects, rad.
    fn distinct_from_rad(&self) -> f64 {
        0.0
    }

    /// Whether it bends to what simpler effects explain.
    fn is_flexible(&self) -> bool {
        false
    }

    /// Whether with these of the users' numbers a simpler effect has another name for it; exact ones have u =
    /// 0.
    fn is_simpler_one(&self, _users: &[Quantity], _amplitude_rad: f64) -> bool {
        false
    }
}

/// What an effect depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Acts {
    /// Angle and rate.
    State,
    /// Time alone, or the spring over time.
    Time,
    /// It is a line of the spectrum beside the yaw mode.
    Line,
    /// The reading, not the motion.
    Sensor,
    /// Chance: it takes another course every time.
    Random,
}

/// Which coefficient of a roll decay ([`crate::roll`]) an effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RollTerm {
    /// B0 sign(p).
    Friction,
    /// B2 abs(p) p.
    Quadratic,
    /// Damping phi^2 p, which takes out of a cycle what B3 p^3 does where B3 = c A44 / (3 wn^2).
    AngleSquared,
    /// C3 phi^3.
    StiffnessCubed,
    /// C5 phi^5.
    StiffnessFifth,
}

/// A restoring moment that is odd in the angle, as a series in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Series {
    /// Its first term.
    Term,
    /// One beyond the first, which bends to what that leaves.
    HigherTerm,
    /// A law with all of its terms.
    Whole,
}

/// Sizes tried, of that at which an effect rivals the spring.
pub(super) const SMALL: f64 = 0.02;

/// Which of an effect's parameters say what of its line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LineParameters {
    pub(crate) size: usize,
    pub(crate) phase: usize,
    pub(crate) frequency: usize,
    /// Of a line that dies out.
    pub(crate) damping: Option<usize>,
    /// Nearest to the natural frequency, as a share of it.
    pub(crate) nearest: f64,
    /// Slowest, in natural frequencies.
    pub(crate) slowest: f64,
}

/// What a start is estimated from: what the model without the effect leaves of the record.
pub(crate) struct Seen<'a> {
    /// Whether the amplitude rises again after it has fallen, as beats do.
    pub(crate) beats: bool,
    pub(crate) scale: Scale,
    /// Model less record, rad, at every `step_s`.
    pub(crate) residuals_rad: &'a [f64],
    pub(crate) step_s: f64,
    /// Residuals in a cycle.
    pub(crate) per_cycle: f64,
    /// Of the model.
    pub(crate) natural_frequency_rad_s: f64,
}

impl Seen<'_> {
    /// Frequencies of the strongest lines below and above the natural frequency in each of `parts`, rad/s,
    /// none twice: from `slowest` natural frequencies on, `nearest` of it away.
    pub(crate) fn lines(&self, parts: &[&[f64]], slowest: f64, nearest: f64) -> Vec<f64> {
        let wn = self.natural_frequency_rad_s;
        let all =
            parts.iter().flat_map(|part| lines::peaks(part, self.step_s, wn, slowest, nearest));
        lines::distinct(all.collect())
    }
}

/// The size of a free decay, from which sizes of effects follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    /// Of the motion.
    pub(crate) amplitude_rad: f64,
    /// Of what is read of it.
    pub(crate) reading_rad: f64,
    pub(crate) natural_frequency_rad_s: f64,
    pub(crate) duration_s: f64,
}

impl Scale {
    /// Of the spring over the inertia, 1/s2.
    pub(crate) fn stiffness(&self) -> f64 {
        self.natural_frequency_rad_s * self.natural_frequency_rad_s
    }
}

/// An effect as text of the language of a user's own effects: of `b`, `r`, `t`, `wn`, `wind` as there, of
/// `spring`, the moment of the linear spring (-wn^2 b beyond any dead zone), and of the users' numbers by
/// their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Equation<'a> {
    /// Added to b'', a term of a sum on each line; its `sign(r)` holds the model at r = 0 while the other
    /// moments are below it.
    Moment(Cow<'a, str>),
    /// The angle up to which the spring does not act.
    DeadZone(&'a str),
    /// Added to the reading.
    Reading(&'a str),
    /// Added to b'', with states of its own.
    Remembered {
        /// The moment, of the states besides what all equations are of.
        moment: Cow<'a, str>,
        /// Name and rate of each.
        states: Vec<[Cow<'a, str>; 2]>,
    },
}

impl<'a> Equation<'a> {
    pub(crate) const fn moment(text: &'a str) -> Self {
        Self::Moment(Cow::Borrowed(text))
    }
}

/// A moment written once: as it is computed, and as its [`Equation`]. Its formula is of yaw angle, yaw rate,
/// time and the spring's moment, in that order, and reads the same in Rust and as an expression.
macro_rules! moment {
    ($law:ident, [$($number:ident),*], |$b:pat_param, $r:pat_param, $t:pat_param, $spring:pat_param| $formula:expr) => {
        impl crate::effects::terms::Moment for $law {
            #[inline]
            fn moment(p: &[f64], s: &crate::effects::terms::State) -> f64 {
                let [$($number),*] = crate::effects::law::numbers(p);
                let ($b, $r, $t, $spring) =
                    (s.yaw_rad, s.rate_rad_s, s.time_s, s.spring_moment_rad_s2);
                $formula
            }
        }

        impl $law {
            const EQUATION: crate::effects::law::Equation<'static> =
                crate::effects::law::Equation::moment(stringify!($formula));
        }
    };
}
pub(super) use moment;

/// The same for a change of the reading, of yaw angle and time.
macro_rules! reading {
    ($law:ident, [$($number:ident),*], |$b:pat_param, $t:pat_param| $formula:expr) => {
        impl crate::effects::terms::Reading for $law {
            #[inline]
            fn change(p: &[f64], $b: f64, $t: f64) -> f64 {
                let [$($number),*] = crate::effects::law::numbers(p);
                $formula
            }
        }

        impl $law {
            const EQUATION: crate::effects::law::Equation<'static> =
                crate::effects::law::Equation::Reading(stringify!($formula));
        }
    };
}
pub(super) use reading;

/// How a [`Law`] enters the motion that is one [`moment!`] or [`reading!`] of all its numbers, and its
/// equation.
macro_rules! enters {
    (moment) => {
        crate::effects::law::enters!(add_moment);
    };
    (reading) => {
        crate::effects::law::enters!(add_reading);
    };
    ($add:ident) => {
        fn write(&self, p: &[f64], terms: &mut crate::effects::terms::Terms) {
            terms.$add::<Self>(p);
        }

        fn equation(&self) -> Option<crate::effects::law::Equation<'_>> {
            Some(Self::EQUATION)
        }
    };
}
pub(super) use enters;

/// As an expression has it.
#[inline]
pub(super) fn abs(x: f64) -> f64 {
    x.abs()
}

/// As an expression has it.
#[inline]
pub(super) fn sin(x: f64) -> f64 {
    x.sin()
}

/// Formula, usual cause on a yaw rig, fingerprint, how to confirm it, how to remove it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Card<'a> {
    /// The effect in a few words.
    pub title: &'a str,
    /// What it adds to b'', or makes of the reading.
    pub formula: &'a str,
    /// What usually brings it about on a yaw rig.
    pub cause: &'a str,
    /// What it looks like in a record.
    pub fingerprint: &'a str,
    /// What to do at the rig to see that it is this.
    pub confirm: &'a str,
    /// How to be rid of it.
    pub remove: &'a str,
    /// The release that would distinguish it from the effects it resembles.
    pub release: &'a str,
}

/// A parameter of any sign.
pub(super) const fn any(name: &'static str, unit: &'static str) -> Parameter {
    within(name, unit, f64::NEG_INFINITY, f64::INFINITY)
}

/// A parameter that takes energy out, or is a length.
pub(super) const fn not_negative(name: &'static str, unit: &'static str) -> Parameter {
    within(name, unit, 0.0, f64::INFINITY)
}

/// A stiffness that falls.
pub(super) const fn not_positive(name: &'static str, unit: &'static str) -> Parameter {
    within(name, unit, f64::NEG_INFINITY, 0.0)
}

pub(super) const fn within(
    name: &'static str,
    unit: &'static str,
    min: f64,
    max: f64,
) -> Parameter {
    Parameter { name: Cow::Borrowed(name), unit: Cow::Borrowed(unit), min, max }
}

/// Starts of a strength and a length: none of the one, these shares of the amplitude of the other.
pub(super) fn at_shares(shares: &[f64], seen: &Seen) -> Vec<Vec<f64>> {
    shares.iter().map(|share| vec![0.0, share * seen.scale.amplitude_rad]).collect()
}

/// The first `N` numbers, to be named.
#[inline]
pub(super) fn numbers<const N: usize>(p: &[f64]) -> [f64; N] {
    std::array::from_fn(|i| p[i])
}

#[cfg(test)]
pub(super) mod testing {
    use super::super::terms::State;

    /// A state at rest of the spring's own moment.
    pub(crate) fn at(yaw_rad: f64, rate_rad_s: f64) -> State {
        State { yaw_rad, rate_rad_s, time_s: 0.0, spring_moment_rad_s2: 0.0 }
    }
}
