//! What is asked of an effect, instead of its name.

use super::law::{Acts, Equation, Series};
use super::Effect;
use crate::quantity::Quantity;
use crate::record::Measurand;
use yawrig_expression::Unit;

impl Effect {
    /// The one that takes another course every time.
    pub(crate) fn random() -> Self {
        Self::the(Self::is_random)
    }

    /// The one that moves the angle of rest and does nothing else.
    pub fn of_rest() -> Self {
        Self::the(Self::moves_rest)
    }

    /// The one whose moment depends on where the model last turned.
    pub(crate) fn with_memory() -> Self {
        Self::the(|e| matches!(e.equation(), Some(Equation::Remembered { .. })))
    }

    fn the(is: impl Fn(&Self) -> bool) -> Self {
        Self::ALL.into_iter().find(is).expect("the library has one")
    }

    /// Whether it takes another course every time, so that no simulation can follow it.
    pub fn is_random(&self) -> bool {
        self.acts_on() == Acts::Random
    }

    /// What it depends on; a user's own is taken to depend on the state.
    pub(crate) fn acts_on(&self) -> Acts {
        self.law().acts_on()
    }

    /// Whether it is of the state and all that it does in proportion to its only number, so that pieces of a
    /// free decay show it as the whole does.
    pub(crate) fn is_strength_of_state(&self) -> bool {
        self.acts_on() == Acts::State && self.law().is_proportional()
    }

    /// Whether pieces of a free decay show it, each with a state of its own: not what follows time.
    pub(crate) fn shows_in_pieces(&self) -> bool {
        self.is_strength_of_state() || self.is_own()
    }

    /// Whether it moves the angle of rest and does nothing else, so that a sensor which was not zeroed looks
    /// the same.
    pub fn moves_rest(&self) -> bool {
        self.law().moves_rest()
    }

    /// Whether what is recorded shows it: a rate has no angle of rest, and a displacement no sine.
    pub fn is_seen_in(&self, measurand: &Measurand) -> bool {
        let of_angle = self.law().is_of_angle();
        let needs_rest = self.moves_rest() || self.is_random();
        (measurand.is_of_angle() || !of_angle) && (measurand.shows_rest() || !needs_rest)
    }

    /// The unit of its parameter of this name in a motion of this kind. Frequencies and phases of a line are
    /// none of the motion's coordinate.
    pub fn unit_in(&self, measurand: &Measurand, name: &str) -> String {
        let Some(at) = self.parameters().iter().position(|p| p.name == name) else {
            return String::new();
        };
        let unit = &self.parameters()[at].unit;
        match self.line() {
            Some(line) if at == line.phase || at == line.frequency => unit.to_string(),
            _ => measurand.parameter_unit(unit),
        }
    }

    /// The power of a second in the unit of its number at `at`, the users' numbers being these: by so many times
    /// the share by which a clock is wrong, the number is.
    pub(crate) fn seconds(&self, at: usize, users: &[f64]) -> f64 {
        match self.law().wind_power(users) {
            // The unit may depend on another number.
            Some((strength, power)) if strength == at => 0.0 - power,
            _ => Unit::parse(&self.parameters()[at].unit).map_or(0.0, |unit| unit.seconds()),
        }
    }

    /// Whether it holds the model at rest while the other moments are small, as dry friction does.
    pub(crate) fn sticks(&self) -> bool {
        self.law().sticks()
    }

    /// Whether its strength may be negative as far as its bounds go, and takes energy out where it is not.
    pub(crate) fn takes_energy_out(&self) -> bool {
        self.law().takes_energy_out()
    }

    /// Where its moment is an odd function of the angle alone, which part of a series.
    pub(crate) fn series(&self) -> Option<Series> {
        self.law().series()
    }

    /// Whether it cannot stand beside `other`: a term of a series beside a law that has all of them bends
    /// against it.
    pub(crate) fn excludes(&self, other: &Self) -> bool {
        let (Some(a), Some(b)) = (self.series(), other.series()) else { return false };
        (a == Series::Whole) != (b == Series::Whole)
    }

    /// Amplitude up to which it cannot be told from simpler effects, rad.
    pub(crate) fn distinct_from_rad(&self) -> f64 {
        self.law().distinct_from_rad()
    }

    /// Whether with these of the users' numbers a simpler effect has another name for it; exact ones have u =
    /// 0.
    pub(crate) fn is_simpler_one(&self, users: &[Quantity], amplitude_rad: f64) -> bool {
        self.law().is_simpler_one(users, amplitude_rad)
    }

    /// Whether it is a line that dies out.
    pub(crate) fn dies_out(&self) -> bool {
        self.line().is_some_and(|line| line.damping.is_some())
    }

    /// Whether it bends to what simpler effects explain, so that it is tried only where they leave more than
    /// they should.
    pub fn is_flexible(&self) -> bool {
        self.law().is_flexible()
    }
}
