//! An effect whose strength goes with the wind: made by the air, or another one at each wind speed.
//!
//! A moment over Izz that the air makes is the dynamic pressure times a dimensionless one, and an angle counts
//! as such while a rate counts in V/l: a coefficient of the unit s^-p goes with V^p, of stiffness terms with the
//! square of the speed, of terms in the rate with the speed, of `|r| r` with the wind being on; and so does each
//! other number, the rate at which a wake is forgotten with the speed.

use super::law::{Acts, Card, Equation, Law, RollTerm, Scale, Seen, Series};
use super::terms::Terms;
use super::Effect;
use crate::derivatives::condition::{is_same_speed, SAME_SPEED};
use crate::quantity::Quantity;
use crate::record::Called;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::sync::Arc;
use yawrig_expression::{Parameter, Unit};

/// Where an effect's strength comes from.
#[derive(Clone, Debug, PartialEq, Default)]
pub enum Source {
    /// The rig: it is the same whatever the wind.
    #[default]
    Mechanical,
    /// The air: none with the wind off, and a power of the wind speed by its dimension. Its numbers are those at
    /// this speed, m/s.
    Aerodynamic {
        /// Above zero.
        reference_m_s: f64,
    },
    /// A coefficient of its own at each of these wind speeds, m/s.
    EachWind {
        /// Rising; 0: wind off.
        speeds_m_s: Vec<f64>,
    },
}

impl Source {
    /// Which of the three it is.
    pub fn kind(&self) -> SourceKind {
        match self {
            Self::Mechanical => SourceKind::Mechanical,
            Self::Aerodynamic { .. } => SourceKind::Aerodynamic,
            Self::EachWind { .. } => SourceKind::EachWind,
        }
    }
}

/// A [`Source`] before it is known of which wind speeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SourceKind {
    /// The rig.
    #[default]
    Mechanical,
    /// The air, by a power of the wind speed.
    Aerodynamic,
    /// A coefficient of its own at each wind speed.
    EachWind,
}

impl SourceKind {
    /// All there are.
    pub const ALL: [Self; 3] = [Self::Mechanical, Self::Aerodynamic, Self::EachWind];

    /// As files and settings write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mechanical => "mechanical",
            Self::Aerodynamic => "aerodynamic",
            Self::EachWind => "each_wind",
        }
    }
}

/// An effect with its source, which is not mechanical.
#[derive(Debug)]
pub struct Sourced {
    pub(super) effect: Effect,
    pub(super) source: Source,
    /// Place of its strength among its numbers.
    strength: usize,
    parameters: Vec<Parameter>,
}

impl Effect {
    /// It without a source: as the library, or the user's file, has it.
    pub fn bare(&self) -> &Self {
        match self {
            Self::Sourced(sourced) => &sourced.effect,
            bare => bare,
        }
    }

    /// Where its strength comes from.
    pub fn source(&self) -> Source {
        match self {
            Self::Sourced(sourced) => sourced.source.clone(),
            _ => Source::Mechanical,
        }
    }

    /// The same from another source; `None` where the air cannot make it: what is no moment of the state in
    /// proportion to a strength, such as a change of the reading or free play, and a user's own that
    /// depends on the wind itself.
    pub fn from_source(&self, source: Source) -> Option<Self> {
        let effect = self.bare().clone();
        if source == Source::Mechanical {
            return Some(effect);
        }
        let (strength, _) = effect.law().wind_power(&[])?;
        let parameters = match &source {
            Source::EachWind { speeds_m_s } => {
                let all = effect.parameters();
                let of = &all[strength];
                let at = |speed: &f64| Parameter {
                    name: Cow::Owned(format!("{}_at_{speed}", of.name).replace('.', "_")),
                    ..of.clone()
                };
                let mut parameters: Vec<Parameter> = speeds_m_s.iter().map(at).collect();
                parameters
                    .extend((0..all.len()).filter(|k| *k != strength).map(|k| all[k].clone()));
                parameters
            }
            _ => effect.parameters().to_vec(),
        };
        Some(Self::Sourced(Arc::new(Sourced { effect, source, strength, parameters })))
    }

    /// How many of its first numbers are strengths: more than one of an effect with one for each wind speed.
    pub fn strengths(&self) -> usize {
        match self {
            Self::Sourced(sourced) => sourced.strengths(),
            _ => 1,
        }
    }

    /// The power of the wind speed with which its strength goes where the air makes it, its numbers being
    /// these; `None` where the air cannot make it.
    pub fn wind_power(&self, users: &[f64]) -> Option<f64> {
        self.bare().law().wind_power(users).map(|(_, power)| power)
    }

    /// The same of each of its numbers.
    pub(crate) fn wind_powers(&self, users: &[f64]) -> Option<Vec<f64>> {
        let (strength, power) = self.bare().law().wind_power(users)?;
        let of = |(k, p): (usize, &Parameter)| match Unit::parse(&p.unit) {
            Ok(unit) if k != strength => 0.0 - unit.seconds(),
            _ => power,
        };
        Some(self.bare().parameters().iter().enumerate().map(of).collect())
    }

    /// Its dimensionless derivative where it has one with a name: a sum of powers of angle and of r l / V.
    /// The moment over Izz at unit dynamic pressure and lengths is the derivative times `sign` times the
    /// strength.
    pub fn derivative(&self) -> Option<(&'static str, f64)> {
        self.bare().law().derivative()
    }

    /// Whether its `number`th number does anything at this wind speed.
    pub(crate) fn acts_at(&self, number: usize, wind_speed_m_s: f64) -> bool {
        match self {
            Self::Sourced(sourced) => sourced.acts_at(number, wind_speed_m_s),
            _ => true,
        }
    }

    /// Whether a coefficient of it is known at this wind speed.
    pub fn is_known_at(&self, wind_speed_m_s: f64) -> bool {
        match self.source() {
            Source::EachWind { speeds_m_s } => {
                speeds_m_s.iter().any(|v| is_same_speed(*v, wind_speed_m_s))
            }
            _ => true,
        }
    }

    /// Its numbers `p` as they are at this wind speed; `None` where it is not there.
    pub(crate) fn in_wind<'a>(&self, p: &'a [f64], wind_speed_m_s: f64) -> Option<Cow<'a, [f64]>> {
        match self {
            Self::Sourced(sourced) => sourced.inner(p, wind_speed_m_s).map(Cow::Owned),
            _ => Some(Cow::Borrowed(p)),
        }
    }
}

impl Sourced {
    /// Of which speed its strength is at this one.
    fn at(&self, wind_speed_m_s: f64) -> Option<usize> {
        match &self.source {
            Source::EachWind { speeds_m_s } => {
                speeds_m_s.iter().position(|v| is_same_speed(*v, wind_speed_m_s))
            }
            _ => Some(0),
        }
    }

    /// How many strengths it has.
    fn strengths(&self) -> usize {
        1 + self.parameters.len() - self.effect.parameters().len()
    }

    /// Place of the `number`th of its numbers among the inner effect's; of one of several strengths, that of
    /// the strength.
    fn place(&self, number: usize) -> usize {
        match &self.source {
            Source::EachWind { .. } if number < self.strengths() => self.strength,
            Source::EachWind { .. } => {
                let other = number - self.strengths();
                other + usize::from(other >= self.strength)
            }
            _ => number,
        }
    }

    fn acts_at(&self, number: usize, wind_speed_m_s: f64) -> bool {
        match &self.source {
            Source::Mechanical => true,
            Source::Aerodynamic { .. } => wind_speed_m_s > 0.0,
            Source::EachWind { .. } => match self.at(wind_speed_m_s) {
                Some(at) => number >= self.strengths() || number == at,
                None => false,
            },
        }
    }

    /// The inner effect's numbers at this wind speed.
    fn inner(&self, p: &[f64], wind_speed_m_s: f64) -> Option<Vec<f64>> {
        let at = self.at(wind_speed_m_s)?;
        let mut inner = vec![0.0; self.effect.parameters().len()];
        for (number, value) in p.iter().enumerate().take(self.parameters.len()) {
            if number >= self.strengths() || number == at || self.strengths() == 1 {
                inner[self.place(number)] = *value;
            }
        }
        if let Source::Aerodynamic { reference_m_s } = self.source {
            if wind_speed_m_s <= 0.0 {
                return None;
            }
            let powers = self.effect.wind_powers(&inner)?;
            for (number, power) in inner.iter_mut().zip(powers) {
                *number *= (wind_speed_m_s / reference_m_s).powf(power);
            }
        }
        Some(inner)
    }

    /// One number for each of its own, of the inner effect's.
    fn each(&self, inner: &[f64]) -> Vec<f64> {
        (0..self.parameters.len()).map(|number| inner[self.place(number)]).collect()
    }

    /// `text` with each number but the strength as it is in the wind, in the language of own effects.
    fn in_wind(&self, text: &str) -> String {
        let Source::Aerodynamic { reference_m_s } = &self.source else { return text.to_owned() };
        let powers = self.effect.wind_powers(&[]).unwrap_or_default();
        let others = self.effect.parameters().iter().zip(powers).enumerate();
        let others = others.filter(|(k, (_, power))| *k != self.strength && *power != 0.0);
        others.fold(text.to_owned(), |text, (_, (p, power))| {
            // With the wind off the moment is none, whatever this is; but it has to be a number.
            let wind = if power < 0.0 { "(wind + 1 - sign(wind))" } else { "wind" };
            let by = format!("({} * ({wind} / {reference_m_s:?})^{power})", p.name);
            replaced(&text, &p.name, &by)
        })
    }

    /// What the strength is multiplied with, or stands in its place, in the language of own effects.
    fn term(&self, text: &str) -> String {
        let name = &self.effect.parameters()[self.strength].name;
        let text = &self.in_wind(text);
        match &self.source {
            Source::Mechanical => text.to_owned(),
            // By its dimension: a moment is what has none but 1/s2.
            Source::Aerodynamic { reference_m_s } => {
                let power = match self.effect.law().wind_power(&[]) {
                    Some((_, power)) if power.is_finite() => power.to_string(),
                    _ => "(2 - n)".to_owned(),
                };
                format!("sign(wind) * (wind / {reference_m_s:?})^{power} * ({text})")
            }
            Source::EachWind { speeds_m_s } => {
                let at = speeds_m_s.iter().zip(&self.parameters).map(|(v, p)| {
                    let width = (SAME_SPEED * v).max(1e-9);
                    format!("{} * max(0, sign({width:?} - abs(wind - {v:?})))", p.name)
                });
                let sum = format!("({})", at.collect::<Vec<_>>().join(" + "));
                replaced(text, name, &sum)
            }
        }
    }
}

/// `text` with the word `name` replaced.
fn replaced(text: &str, name: &str, by: &str) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = String::new();
    let mut word = String::new();
    for c in text.chars().chain(['\n']) {
        if is_word(c) {
            word.push(c);
            continue;
        }
        out += if word == name { by } else { &word };
        word.clear();
        out.push(c);
    }
    out.pop();
    out
}

impl Law for Arc<Sourced> {
    fn id(&self) -> &str {
        self.effect.id()
    }
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }
    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        self.each(&self.effect.sizes(scale))
    }
    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        self.effect.starts(seen).iter().map(|start| self.each(start)).collect()
    }
    fn write(&self, p: &[f64], terms: &mut Terms) {
        if let Some(inner) = self.inner(p, terms.wind_speed_m_s) {
            self.effect.write(&inner, terms);
        }
    }
    fn equation(&self) -> Option<Equation<'_>> {
        match self.effect.equation()? {
            Equation::Moment(text) => {
                let terms: Vec<String> = text.lines().map(|line| self.term(line)).collect();
                Some(Equation::Moment(terms.join("\n").into()))
            }
            Equation::Remembered { moment, states } => {
                let rate = |[name, rate]: [Cow<str>; 2]| {
                    [name.into_owned(), self.in_wind(&rate)].map(Cow::Owned)
                };
                Some(Equation::Remembered {
                    moment: self.term(&moment).into(),
                    states: states.into_iter().map(rate).collect(),
                })
            }
            other => Some(other),
        }
    }
    fn card(&self) -> Card<'_> {
        self.effect.card()
    }
    fn card_in(&self, motion: Called) -> Card<'_> {
        self.effect.law().card_in(motion)
    }
    fn acts_on(&self) -> Acts {
        self.effect.acts_on()
    }
    fn is_proportional(&self) -> bool {
        self.parameters.len() == 1 && self.effect.law().is_proportional()
    }
    fn is_of_angle(&self) -> bool {
        self.effect.law().is_of_angle()
    }
    fn moves_rest(&self) -> bool {
        self.effect.moves_rest()
    }
    fn sticks(&self) -> bool {
        self.effect.sticks()
    }
    fn takes_energy_out(&self) -> bool {
        self.effect.takes_energy_out()
    }
    fn roll_term(&self) -> Option<RollTerm> {
        self.effect.roll_term()
    }
    fn series(&self) -> Option<Series> {
        self.effect.series()
    }
    fn distinct_from_rad(&self) -> f64 {
        self.effect.distinct_from_rad()
    }
    fn is_flexible(&self) -> bool {
        self.effect.is_flexible()
    }
    fn is_simpler_one(&self, users: &[Quantity], amplitude_rad: f64) -> bool {
        let inner: Vec<Quantity> = (0..self.effect.parameters().len())
            .filter_map(|k| (0..users.len()).find(|n| self.place(*n) == k).map(|n| users[n]))
            .collect();
        self.effect.is_simpler_one(&inner, amplitude_rad)
    }
}

#[cfg(test)]
#[path = "sourced_tests.rs"]
mod tests;
