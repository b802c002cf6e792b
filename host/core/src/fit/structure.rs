//! What a model holds: effects, an unknown zero of the sensor, and limits on its numbers.

use crate::effects::{Effect, Terms};
use crate::fit::free_decay::{Around, FreeDecay};
use crate::motion::oscillator::Motion;

/// wn, zeta, yaw angle and yaw rate at the first instant.
pub(crate) const PLAIN: usize = 4;
/// Where each number is among those of a release: natural frequency and damping ratio; angle and rate at the
/// first instant; the sensor's zero, where it is unknown.
pub(crate) const WN: usize = 0;
pub(crate) const ZETA: usize = 1;
pub(crate) const YAW: usize = 2;
pub(crate) const RATE: usize = 3;
pub(crate) const ZERO: usize = PLAIN;

/// A number that a limit can be set on. Those of an effect are counted as the fit varies them.
#[derive(Clone, Debug, PartialEq)]
pub enum Number {
    /// wn, rad/s.
    NaturalFrequency,
    /// zeta.
    DampingRatio,
    /// The reading at no yaw, rad.
    SensorZero,
    /// A number of this effect, by its place in [`Effect::varied`].
    Of(Effect, usize),
}

/// Narrower bounds than a number's own; `low` = `high`: fixed.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// What is limited.
    pub number: Number,
    /// In the unit in which the fit varies it.
    pub low: f64,
    /// In the unit in which the fit varies it.
    pub high: f64,
}

/// Which effects a model holds, whether the sensor's zero is unknown, and what is fixed or kept within
/// limits.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Structure {
    /// Beside the second-order response, in the order in which their numbers are kept.
    pub effects: Vec<Effect>,
    /// The sensor's zero is a number of the fit.
    pub zero_unknown: bool,
    /// The other effects act about the angle of rest under a constant moment, not about the sensor's zero.
    pub about_rest: bool,
    /// One for each number that is fixed or kept within narrower bounds.
    pub limits: Vec<Limit>,
    /// Simulated without the error that the step of a splitting has: some ten times slower.
    pub precise: bool,
    /// Own effects that are not steep are followed by fixed steps: for a search among many.
    pub swift: bool,
}

impl Structure {
    /// The same with `effect` behind the others, to be simulated quickly: what is built is polished at its
    /// end.
    pub fn with(&self, effect: &Effect) -> Self {
        let mut effects = self.effects.clone();
        effects.push(effect.clone());
        Self { effects, precise: false, ..self.clone() }
    }

    pub(crate) fn without(&self, effect: &Effect) -> Self {
        let effects = self.effects.iter().filter(|&e| *e != *effect).cloned().collect();
        Self { effects, precise: false, ..self.clone() }
    }

    /// The same to be simulated precisely; without effects it is anyway.
    pub fn precisely(&self) -> Self {
        Self { precise: !self.effects.is_empty(), ..self.clone() }
    }

    /// With parameter `name` of `effect`, in the users' unit, kept from `low` to `high`. `None` where there
    /// is no such parameter, or the fit does not vary it by itself: size and phase of a line, which are fixed
    /// jointly by a [`Limit`] on each of [`Effect::varied`].
    pub fn limited(mut self, effect: &Effect, name: &str, low: f64, high: f64) -> Option<Self> {
        let index = effect.parameters().iter().position(|p| p.name == name)?;
        let number = effect.varied_place(index)?;
        self.limits.push(Limit { number: Number::Of(effect.clone(), number), low, high });
        Some(self)
    }

    /// wn, zeta, yaw, rate, and the sensor's zero where unknown.
    pub fn own_numbers(&self) -> usize {
        PLAIN + usize::from(self.zero_unknown)
    }

    /// Each effect, and where its numbers begin.
    pub(crate) fn places(&self) -> impl Iterator<Item = (&Effect, usize)> {
        let mut next = self.own_numbers();
        self.effects.iter().map(move |effect| {
            let at = next;
            next += effect.parameters().len();
            (effect, at)
        })
    }

    /// The units of the states of own effects that act at this wind speed, in the order of a motion's state.
    pub fn own_state_units(&self, wind_speed_m_s: f64) -> Vec<String> {
        let acting = self.effects.iter().filter(|effect| effect.acts_at(0, wind_speed_m_s));
        acting.flat_map(Effect::state_units).collect()
    }

    /// Where the numbers of `effect` begin; none where the model has it not.
    pub(crate) fn place(&self, effect: &Effect) -> Option<usize> {
        self.places().find(|(e, _)| *e == effect).map(|(_, at)| at)
    }

    /// The size of each number in which the fit steps.
    pub(crate) fn sizes(&self, decay: &FreeDecay) -> Vec<f64> {
        let scale = decay.scale();
        let (wn, a) = (decay.frequency_rad_s, scale.amplitude_rad);
        let mut sizes = vec![wn * 0.1, 1.0, a, wn * a, scale.reading_rad];
        sizes.truncate(self.own_numbers());
        sizes.extend(self.effects.iter().flat_map(|e| e.sizes(&scale)));
        sizes
    }

    /// Bounds of each number for a fit that begins at `start`.
    pub(crate) fn bounds(&self, decay: &FreeDecay, start: &[f64]) -> Vec<(f64, f64)> {
        let wn = decay.frequency_rad_s;
        let mut bounds = vec![(0.2 * wn, 5.0 * wn), (-0.5, 0.7)];
        bounds.resize(self.own_numbers(), (f64::NEG_INFINITY, f64::INFINITY));
        for (effect, at) in self.places() {
            bounds.extend(effect.bounds(&start[at..], start[WN]));
        }
        for limit in &self.limits {
            let place = match &limit.number {
                Number::NaturalFrequency => Some(WN),
                Number::DampingRatio => Some(ZETA),
                Number::SensorZero => self.zero_unknown.then_some(ZERO),
                Number::Of(effect, number) => self.place(effect).map(|at| at + number),
            };
            let Some(bound) = place.map(|at| &mut bounds[at]) else { continue };
            let within = (bound.0.max(limit.low), bound.1.min(limit.high));
            let fixed = limit.low == limit.high || within.0 > within.1;
            *bound = if fixed { (limit.low, limit.high) } else { within };
        }
        bounds
    }

    /// Of each number, whether it does anything at this wind speed.
    pub(crate) fn acting(&self, wind_speed_m_s: f64) -> Vec<bool> {
        let mut acting = vec![true; self.own_numbers()];
        for effect in &self.effects {
            let numbers = 0..effect.parameters().len();
            acting.extend(numbers.map(|number| effect.acts_at(number, wind_speed_m_s)));
        }
        acting
    }

    /// Whether a measured law is among the effects.
    pub(crate) fn has_law(&self) -> bool {
        self.effects.iter().any(|e| e.measured().is_some())
    }

    pub(crate) fn limits_effect(&self, effect: &Effect) -> bool {
        self.limits.iter().any(|l| matches!(&l.number, Number::Of(e, _) if e == effect))
    }

    /// The motion of a model with the numbers `p`, and the sensor's zero, rad.
    pub(crate) fn motion(&self, p: &[f64], around: Around) -> (Motion, f64) {
        let mut terms = Terms::in_wind(around.wind_speed_m_s);
        terms.observed = around.observed;
        terms.precise = self.precise;
        terms.swift = self.swift;
        let mut zero = if self.zero_unknown { p[ZERO] } else { 0.0 };
        for (effect, at) in self.places() {
            match self.about_rest && effect.moves_rest() {
                true => {
                    let moment = effect.in_wind(&p[at..], around.wind_speed_m_s);
                    zero += moment.map_or(0.0, |p_in_wind| p_in_wind[0]) / p[WN].powi(2);
                }
                false => effect.write(&p[at..], &mut terms),
            }
        }
        let motion = Motion {
            natural_frequency_rad_s: p[WN],
            damping_ratio: p[ZETA],
            yaw_rad: p[YAW],
            rate_rad_s: p[RATE],
            terms,
        };
        (motion, zero)
    }
}
