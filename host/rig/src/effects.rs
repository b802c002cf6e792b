//! The effects a virtual rig can hide in its records: identifiers, parameters, and what is refused.
//!
//! Terms of the yaw acceleration (all torques divided by Izz, angles in rad) are computed in `moments`; the
//! last three effects change the reading and leave the motion alone. Time runs from the release. A user's own
//! effect is taken from its file; the formula compiled there is the one that fits use too.

use crate::error::{Error, Quantity, Result};
use crate::library::{Kind, Parameter, Smooth, LIBRARY};
use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;
use yawrig_expression::{all_ready_made, ready_made, OwnEffect, OwnTerm, MAX_OWN, MAX_PARAMETERS};
use yawrig_shared::modal::Modal;

/// An effect with values for all its parameters, in physical range.
#[derive(Clone, Debug)]
pub struct Effect {
    kind: Cow<'static, Kind>,
    values: [f64; MAX_PARAMETERS],
    own: Option<Arc<OwnEffect>>,
}

/// A kind made of a user's own effect.
fn kind_of(own: &OwnEffect) -> Kind {
    let parameter = |p: &yawrig_expression::Parameter| Parameter {
        name: p.name.clone(),
        unit: p.unit.clone(),
        least: p.min.max(f64::MIN),
        most: p.max.min(f64::MAX),
    };
    Kind {
        id: Cow::Owned(own.id.clone()),
        term: Cow::Owned(own.formula.clone()),
        parameters: own.parameters.iter().map(parameter).collect(),
        example: "",
        smooth: None,
    }
}

/// Every kind that a virtual rig knows by name.
pub fn kinds() -> impl Iterator<Item = Cow<'static, Kind>> {
    let library = LIBRARY.iter().map(Cow::Borrowed);
    library.chain(all_ready_made().iter().map(|own| Cow::Owned(kind_of(own))))
}

/// Effect and the rest of `EFFECT:NAME=VALUE,...`; a path may hold colons of its own.
fn split(text: &str) -> (&str, &str) {
    const ENDING: &str = ".toml";
    match text.find(ENDING).map(|at| text.split_at(at + ENDING.len())) {
        Some((file, "")) => (file, ""),
        Some((file, rest)) if rest.starts_with(':') => (file, &rest[1..]),
        _ => text.split_once(':').unwrap_or((text, "")),
    }
}

/// The same effect of the same size.
impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        self.id() == other.id() && self.values == other.values
    }
}

impl Effect {
    pub fn id(&self) -> &str {
        &self.kind.id
    }

    /// Each parameter with its value, in the library's order and units.
    pub fn parameters(&self) -> impl Iterator<Item = (&Parameter, f64)> {
        self.kind.parameters.iter().zip(self.values)
    }
}

impl fmt::Display for Effect {
    /// As [`Effect::from_str`] reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let values: Vec<String> =
            self.parameters().map(|(p, value)| format!("{}={value}", p.name)).collect();
        write!(f, "{}:{}", self.id(), values.join(","))
    }
}

impl FromStr for Effect {
    type Err = Error;

    /// `id:name=value,name=value`, every parameter once, in any order; of a user's own effect, named by the
    /// path of its file, those left out are as the file starts them.
    ///
    /// # Errors
    /// Naming the ids or the parameters there are; for a file that cannot be used.
    fn from_str(text: &str) -> Result<Self> {
        let (id, given) = split(text);
        let in_library = || LIBRARY.iter().map(|kind| &*kind.id);
        let ids = || in_library().chain(all_ready_made().iter().map(|own| &*own.id));
        let own = match yawrig_expression::is_file(id) {
            true => {
                let taken: Vec<&str> = in_library().collect();
                Some(Arc::new(yawrig_expression::read(Path::new(id), &taken)?))
            }
            false => ready_made(id.trim()),
        };
        let kind = match &own {
            Some(own) => Cow::Owned(kind_of(own)),
            None => LIBRARY
                .iter()
                .find(|kind| kind.id == id.trim())
                .map(Cow::Borrowed)
                .ok_or_else(|| {
                    let near = yawrig_text::nearest(id.trim(), ids());
                    let near = near.map_or(String::new(), |near| format!("did you mean {near}? "));
                    let ids = ids().collect::<Vec<_>>().join(", ");
                    Error::wrong(
                        Quantity::Effect,
                        format!("{text}: there is no effect \"{}\"", id.trim()),
                        format!(
                        "{near}the effects are {ids}, or the path of your own effect's .toml file"
                    ),
                    )
                })?,
        };
        let refuse = |why: String| {
            let parameters: Vec<String> =
                kind.parameters.iter().map(|p| format!("{} ({})", p.name, p.unit)).collect();
            Error::wrong(
                Quantity::Effect,
                format!("{text}: {why}"),
                format!("{} takes {}", kind.id, parameters.join(", ")),
            )
        };
        let mut values = [None; MAX_PARAMETERS];
        for pair in given.split(',').map(str::trim).filter(|pair| !pair.is_empty()) {
            let (name, value) = pair
                .split_once('=')
                .ok_or_else(|| refuse(format!("\"{pair}\" is not name=value")))?;
            let place = kind
                .parameters
                .iter()
                .position(|p| p.name == name.trim())
                .ok_or_else(|| refuse(format!("there is no parameter \"{}\"", name.trim())))?;
            let parameter = &kind.parameters[place];
            let value: f64 = value
                .trim()
                .parse()
                .map_err(|_| refuse(format!("{} is no number", parameter.name)))?;
            if !(parameter.least..=parameter.most).contains(&value) {
                return Err(refuse(parameter.out_of_range(value)));
            }
            if values[place].replace(value).is_some() {
                return Err(refuse(format!("{} is given twice", parameter.name)));
            }
        }
        for (value, start) in values.iter_mut().zip(own.iter().flat_map(|own| &own.starts)) {
            value.get_or_insert(*start);
        }
        if let Some((missing, _)) =
            kind.parameters.iter().zip(&values).find(|(_, value)| value.is_none())
        {
            return Err(refuse(format!("{} is missing", missing.name)));
        }
        Ok(Self { kind, values: values.map(Option::unwrap_or_default), own })
    }
}

impl Parameter {
    fn out_of_range(&self, value: f64) -> String {
        let Self { name, least, most, .. } = self;
        match (*least, *most == f64::MAX) {
            (f64::MIN_POSITIVE, true) => format!("{name}={value} is not positive and finite"),
            (f64::MIN_POSITIVE, false) => {
                format!("{name}={value} is not positive and at most {most:.6}")
            }
            (f64::MIN, true) => format!("{name}={value} is not finite"),
            (_, true) => format!("{name}={value} is not finite and at least {least}"),
            (_, false) => format!("{name}={value} is not from {least} to {most}"),
        }
    }
}

/// The effects of one rig, each at most once; none by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    list: Vec<Effect>,
    /// For own effects that depend on it.
    wind_speed_m_s: f64,
}

impl Effects {
    /// # Errors
    /// For an effect given twice, or too many of the user's own.
    pub fn new(effects: Vec<Effect>) -> Result<Self> {
        for (place, effect) in effects.iter().enumerate() {
            if effects[..place].iter().any(|other| other.id() == effect.id()) {
                return Err(Error::wrong(
                    Quantity::Effect,
                    format!("{effect}: {} twice", effect.id()),
                    "give each effect once",
                ));
            }
        }
        if effects.iter().filter(|e| e.own.is_some()).count() > MAX_OWN {
            return Err(Error::wrong(
                Quantity::Effect,
                format!("more than {MAX_OWN} effects of your own"),
                "take fewer at a time",
            ));
        }
        Ok(Self { list: effects, wind_speed_m_s: 0.0 })
    }

    /// The same at another wind speed, 0 at first.
    #[must_use]
    pub fn in_wind(mut self, speed_m_s: f64) -> Self {
        self.wind_speed_m_s = speed_m_s;
        self
    }

    pub(super) fn wind_speed_m_s(&self) -> f64 {
        self.wind_speed_m_s
    }

    /// The smooth moments with their values, in the library's order.
    pub(super) fn smooth(&self) -> Vec<(Smooth, [f64; MAX_PARAMETERS])> {
        let values = |id| self.list.iter().find(|e| e.id() == id).map(|e| e.values);
        LIBRARY.iter().filter_map(|kind| Some((kind.smooth?, values(&kind.id)?))).collect()
    }

    /// The user's own.
    pub(super) fn own(&self) -> Vec<OwnTerm> {
        self.iter().filter_map(|e| Some(OwnTerm::new(e.own.as_ref()?, &e.values))).collect()
    }

    pub fn iter(&self) -> impl Iterator<Item = &Effect> {
        self.list.iter()
    }

    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether something keeps the model moving for ever.
    pub fn drive_the_model(&self) -> bool {
        let drives = |e: &Effect| matches!(e.id(), "harmonic_forcing" | "buffeting");
        self.iter().any(|e| drives(e) || e.own.as_ref().is_some_and(|own| own.keeps_moving))
    }

    /// Value of a parameter; `None` where the effect is absent.
    pub(super) fn value(&self, id: &str, name: &str) -> Option<f64> {
        let effect = self.list.iter().find(|effect| effect.id() == id)?;
        effect.parameters().find(|(p, _)| p.name == name).map(|(_, value)| value)
    }

    /// Refuses frequencies that would imitate the yaw mode, a slow drift, or resonance.
    ///
    /// # Errors
    /// Naming the effect, its frequency and the mode's.
    pub(super) fn check_frequencies(&self, modal: &Modal) -> Result<()> {
        let wn = modal.natural_frequency_rad_s;
        if let Some(w) = self.value("harmonic_forcing", "w")
            && (w - wn).abs() < 0.1 * wn
        {
            return Err(Error::wrong(Quantity::Effect, format!(
                    "harmonic_forcing: w = {w} rad/s is within 10 % of a release's natural frequency, {wn:.4} rad/s"
                ), format!("take w below {:.4} or above {:.4} rad/s", 0.9 * wn, 1.1 * wn)));
        }
        if let Some(w2) = self.value("second_mode", "w2")
            && ((w2 - wn).abs() < 0.3 * wn || w2 < 0.3 * wn)
        {
            return Err(Error::wrong(Quantity::Effect, format!(
                    "second_mode: w2 = {w2} rad/s is within 30 % of a release's natural frequency, {wn:.4} rad/s, or of zero"
                ), format!(
                    "take w2 from {:.4} to {:.4} or above {:.4} rad/s",
                    0.3 * wn,
                    0.7 * wn,
                    1.3 * wn
                )));
        }
        Ok(())
    }
}
