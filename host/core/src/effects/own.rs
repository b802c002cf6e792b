//! A user's own effect as one of the library.

use super::law::{Card, Equation, Law, Scale, Seen, SMALL};
use super::terms::Terms;
use crate::record::Called;
use std::borrow::Cow;
use std::sync::Arc;
use yawrig_expression::{OwnEffect, OwnTerm, Parameter, Unit, Words};

/// Of the start of a parameter: its size, so that the fit's differences stand out of what a step size that
/// adapts itself leaves uncertain.
const SIZE: f64 = 30.0;
/// Of a user's own, of which no more is known.
const USERS: Words = Words {
    cause: "whoever wrote it knows: an effect from a file of your own",
    fingerprint:
        "where its moment is large: compare residuals over the phase plane with and without it",
    confirm:
        "fit it to releases of other sizes, on other springs, with the wind off: its numbers stay",
    remove: "depends on what it stands for",
    release: "another amplitude, another spring, wind off: whichever moves the two moments apart",
    elsewhere: Some(&Words {
        cause: "whoever wrote it knows: an effect from a file of your own",
        fingerprint:
            "where its moment is large: compare residuals over the phase plane with and without it",
        confirm: "fit it to releases of other sizes: its numbers stay",
        remove: "depends on what it stands for",
        release:
            "another amplitude, another natural frequency: whichever moves the two moments apart",
        elsewhere: None,
    }),
};

fn card<'a>(own: &'a OwnEffect, words: &Words) -> Card<'a> {
    let Words { cause, fingerprint, confirm, remove, release, .. } = *words;
    Card { title: &own.title, formula: &own.formula, cause, fingerprint, confirm, remove, release }
}

impl Law for Arc<OwnEffect> {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Many times its starts.
    fn sizes(&self, _: &Scale) -> Vec<f64> {
        self.starts.iter().map(|s| SIZE * s.abs()).collect()
    }

    /// Without it where one of its parameters is its size, then at its own starts, at the size which would
    /// show in this record, and with each other parameter three times smaller and larger.
    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        let (wn, amplitude) = (seen.natural_frequency_rad_s, seen.scale.amplitude_rad);
        let own = self;
        let with = |from: &[f64], k: usize, value: f64| {
            let p = &own.parameters[k];
            let mut other = from.to_vec();
            other[k] = value.clamp(p.min, p.max);
            other
        };
        let around = |from: &[f64], k: usize| [1.0 / 3.0, 3.0].map(|f| with(from, k, f * from[k]));
        let signed = &own.starts;
        let Some(size) = own.size_parameter() else {
            let all = (0..signed.len()).flat_map(|k| around(signed, k));
            return std::iter::once(signed.clone()).chain(all).collect();
        };
        let strength = own.strength(signed, amplitude, wn) / (wn * wn * amplitude);
        let visible = signed[size] * SMALL / strength.max(f64::MIN_POSITIVE);
        let seen = with(signed, size, if visible.is_finite() { visible } else { signed[size] });
        let mut out = vec![with(signed, size, 0.0), signed.clone(), seen.clone()];
        if own.parameters[size].min < 0.0 && own.parameters[size].max > 0.0 {
            out.push(with(&seen, size, -seen[size]));
        }
        out.extend((0..signed.len()).filter(|k| *k != size).flat_map(|k| around(&seen, k)));
        out
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_own(OwnTerm::new(self, p));
    }

    /// Where its whole moment is in proportion to one parameter and it does not say itself how it goes with
    /// the wind.
    fn wind_power(&self, _: &[f64]) -> Option<(usize, f64)> {
        let place = self.size_parameter().filter(|_| !self.uses_wind())?;
        let unit = Unit::parse(&self.parameters[place].unit).ok()?;
        Some((place, 0.0 - unit.seconds()))
    }

    /// What its parameters are is the user's.
    fn is_proportional(&self) -> bool {
        false
    }

    fn equation(&self) -> Option<Equation<'_>> {
        let moment = self.moment.as_str();
        Some(match self.states.as_slice() {
            [] => Equation::moment(moment),
            states => {
                let states = states.iter();
                let states =
                    states.map(|s| [s.name.clone(), s.rate.clone()].map(Cow::Owned)).collect();
                Equation::Remembered { moment: moment.into(), states }
            }
        })
    }

    fn card(&self) -> Card<'_> {
        card(self, self.words.unwrap_or(&USERS))
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let words = self.words.unwrap_or(&USERS);
        match motion {
            Called::Yaw | Called::Pitch => card(self, words),
            _ => card(self, words.elsewhere.unwrap_or(words)),
        }
    }
}
