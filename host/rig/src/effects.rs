//! The effects a virtual rig can hide in its records: identifiers, parameters, and what is refused.
//!
//! Terms of the yaw acceleration (all torques divided by Izz, angles in rad) are computed in `moments`; the
//! last three effects change the reading and leave the motion alone. Time runs from the release. A user's own effect is
//! taken from its file; the formula compiled there is the one that fits use too.

use crate::error::{Error, Quantity, Result};
use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::{Arc, LazyLock};
use yawrig_expression::{OwnEffect, OwnTerm, MOST_OWN, MOST_PARAMETERS};
use yawrig_shared::modal::Modal;

/// One parameter of an effect and the values it may have, ends included.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: Cow<'static, str>,
    pub unit: Cow<'static, str>,
    least: f64,
    most: f64,
}

/// One effect of the library.
#[derive(Clone, Debug)]
pub struct Kind {
    pub id: Cow<'static, str>,
    /// Added to b'' = -2 zeta wn r - wn^2 b, or the reading where it says so.
    pub term: Cow<'static, str>,
    pub parameters: Vec<Parameter>,
    /// Values that show plainly in a release from some 10 deg at 7 rad/s.
    pub example: &'static str,
    /// Of a moment that is smooth while the model moves one way; the others are written out where they act.
    pub(super) smooth: Option<Smooth>,
}

/// A moment over the inertia that is smooth while the model moves one way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smooth {
    /// rad/s2, from the parameters' values, angle (rad), rate (rad/s) and the sign of the rate.
    pub moment: fn(&[f64], f64, f64, f64) -> f64,
    /// Its potential, rad2/s2, zero at no angle; `None` where it takes energy out.
    pub potential: Option<fn(&[f64], f64) -> f64>,
}

fn any(name: &'static str, unit: &'static str) -> Parameter {
    within(name, unit, f64::MIN, f64::MAX)
}

fn positive(name: &'static str, unit: &'static str) -> Parameter {
    within(name, unit, f64::MIN_POSITIVE, f64::MAX)
}

fn within(name: &'static str, unit: &'static str, least: f64, most: f64) -> Parameter {
    Parameter { name: Cow::Borrowed(name), unit: Cow::Borrowed(unit), least, most }
}

/// An effect that is written out where it acts.
fn kind(
    id: &'static str,
    term: &'static str,
    parameters: Vec<Parameter>,
    example: &'static str,
) -> Kind {
    let (id, term) = (Cow::Borrowed(id), Cow::Borrowed(term));
    Kind { id, term, parameters, example, smooth: None }
}

fn smooth(mut kind: Kind, law: Smooth) -> Kind {
    kind.smooth = Some(law);
    kind
}

/// An effect that takes energy out.
fn damping(kind: Kind, moment: fn(&[f64], f64, f64, f64) -> f64) -> Kind {
    smooth(kind, Smooth { moment, potential: None })
}

/// A restoring moment with its potential.
fn stiffness(
    kind: Kind,
    moment: fn(&[f64], f64, f64, f64) -> f64,
    potential: fn(&[f64], f64) -> f64,
) -> Kind {
    smooth(kind, Smooth { moment, potential: Some(potential) })
}

/// Fastest forcing, rad/s: beyond it the integration's steps no longer resolve a cycle.
const FASTEST_FORCING_RAD_S: f64 = 1000.0;

/// Every effect there is.
///
/// Friction and drag only take energy out, so that their coefficients are positive; a negative
/// `cubic_damping` is allowed, since damping that falls with amplitude is seen on such rigs.
pub static LIBRARY: LazyLock<Vec<Kind>> = LazyLock::new(|| {
    vec![
        kind(
            "coulomb_friction",
            "- c sign(r); sticks while r = 0 and the other torque is at most c",
            vec![positive("c", "rad/s2")],
            "c=0.12",
        ),
        damping(
            kind("quadratic_damping", "- d |r| r", vec![positive("d", "1/rad")], "d=0.3"),
            |p, _, r, sign| -p[0] * sign * r * r,
        ),
        damping(
            kind("cubic_damping", "- c b^2 r", vec![any("c", "1/(rad2 s)")], "c=2"),
            |p, b, r, _| -p[0] * b * b * r,
        ),
        stiffness(
            kind("cubic_stiffness", "- k3 b^3", vec![any("k3", "1/(rad2 s2)")], "k3=40"),
            |p, b, _, _| -p[0] * b * b * b,
            |p, b| p[0] * b * b * b * b / 4.0,
        ),
        stiffness(
            kind("quadratic_stiffness", "- k2 b^2", vec![any("k2", "1/(rad s2)")], "k2=20"),
            |p, b, _, _| -p[0] * b * b,
            |p, b| p[0] * b * b * b / 3.0,
        ),
        kind("static_offset", "+ m", vec![any("m", "rad/s2")], "m=0.3"),
        kind(
            "free_play",
            "the spring term wn^2 b acts on b beyond a dead zone of +-g only",
            vec![within("g", "rad", f64::MIN_POSITIVE, std::f64::consts::PI)],
            "g=0.01",
        ),
        kind(
            "harmonic_forcing",
            "+ f cos(w t + phi), w at least 10 % of wn away from it",
            vec![
                positive("f", "rad/s2"),
                within("w", "rad/s", f64::MIN_POSITIVE, FASTEST_FORCING_RAD_S),
                any("phi", "rad"),
            ],
            "f=0.3,w=11,phi=0.5",
        ),
        kind(
            "stiffness_drift",
            "wn^2 (1 + e t) in place of wn^2",
            vec![any("e", "1/s")],
            "e=0.003",
        ),
        kind(
            "buffeting",
            "+ white random moment of intensity q",
            vec![positive("q", "rad2/s3")],
            "q=0.01",
        ),
        kind(
            "second_mode",
            "reading + amplitude exp(-zeta2 w2 t) cos(w2 sqrt(1 - zeta2^2) t + phase)",
            vec![
                positive("amplitude", "rad"),
                any("phase", "rad"),
                positive("w2", "rad/s"),
                within("zeta2", "1", 0.001, 0.99),
            ],
            "amplitude=0.01,phase=0.4,w2=19,zeta2=0.01",
        ),
        kind("sensor_nonlinearity", "reading = b + s b^2", vec![any("s", "1/rad")], "s=0.3"),
        kind("baseline_drift", "reading = b + d t", vec![any("d", "rad/s")], "d=0.001"),
        stiffness(
            kind("quintic_stiffness", "- k5 b^5", vec![any("k5", "1/(rad4 s2)")], "k5=900"),
            |p, b, _, _| -p[0] * b * b * b * b * b,
            |p, b| p[0] * b * b * b * b * b * b / 6.0,
        ),
        stiffness(
            kind("pendulum_gravity", "+ g (b - sin b)", vec![any("g", "1/s2")], "g=49"),
            |p, b, _, _| p[0] * (b - b.sin()),
            |p, b| p[0] * (1.0 - b.cos() - b * b / 2.0),
        ),
        stiffness(
            kind("odd_quadratic_stiffness", "- k |b| b", vec![any("k", "1/(rad s2)")], "k=10"),
            |p, b, _, _| -p[0] * b.abs() * b,
            |p, b| p[0] * b.abs() * b * b / 3.0,
        ),
        damping(
            kind(
                "power_damping",
                "- c |r|^n sign(r), 0 < n < 3",
                vec![positive("c", "(rad/s2)/(rad/s)^n"), within("n", "1", f64::MIN_POSITIVE, 3.0)],
                "c=0.1,n=1.5",
            ),
            // Beyond the turning point, which ends a step, the rate counts as none.
            |p, _, r, sign| -p[0] * sign * (sign * r).max(0.0).powf(p[1]),
        ),
        stiffness(
            kind(
                "end_stop",
                "- k (|b| - g) sign(b) beyond |b| > g",
                vec![positive("k", "1/s2"), positive("g", "rad")],
                "k=20,g=0.1",
            ),
            |p, b, _, _| -p[0] * (b.abs() - p[1]).max(0.0).copysign(b),
            |p, b| 0.5 * p[0] * (b.abs() - p[1]).max(0.0).powi(2),
        ),
        kind(
            "hysteresis",
            "- h z, z' = r - |r| z / y",
            vec![positive("h", "1/s2"), positive("y", "rad")],
            "h=2,y=0.05",
        ),
    ]
});

/// An effect with values for all its parameters, in physical range.
#[derive(Clone, Debug)]
pub struct Effect {
    kind: Cow<'static, Kind>,
    values: [f64; MOST_PARAMETERS],
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

    /// `id:name=value,name=value`, every parameter once, in any order; of a user's own effect, named by the path of
    /// its file, those left out are as the file starts them.
    ///
    /// # Errors
    /// Naming the ids or the parameters there are; for a file that cannot be used.
    fn from_str(text: &str) -> Result<Self> {
        let (id, given) = split(text);
        let ids = || LIBRARY.iter().map(|kind| &*kind.id);
        let own = match yawrig_expression::is_file(id) {
            true => {
                let taken: Vec<&str> = ids().collect();
                Some(Arc::new(yawrig_expression::read(Path::new(id), &taken)?))
            }
            false => None,
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
        let mut values = [None; MOST_PARAMETERS];
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
        match (*least == f64::MIN_POSITIVE, *most == f64::MAX) {
            (true, true) => format!("{name}={value} is not positive and finite"),
            (true, false) => format!("{name}={value} is not positive and at most {most:.6}"),
            (false, true) => format!("{name}={value} is not finite"),
            (false, false) => format!("{name}={value} is not from {least} to {most}"),
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
        if effects.iter().filter(|e| e.own.is_some()).count() > MOST_OWN {
            return Err(Error::wrong(
                Quantity::Effect,
                format!("more than {MOST_OWN} effects of your own"),
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
    pub(super) fn smooth(&self) -> Vec<(Smooth, [f64; MOST_PARAMETERS])> {
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
        if let Some(w) = self.value("harmonic_forcing", "w") {
            if (w - wn).abs() < 0.1 * wn {
                return Err(Error::wrong(Quantity::Effect, format!(
                    "harmonic_forcing: w = {w} rad/s is within 10 % of a release's natural frequency, {wn:.4} rad/s"
                ), format!("take w below {:.4} or above {:.4} rad/s", 0.9 * wn, 1.1 * wn)));
            }
        }
        if let Some(w2) = self.value("second_mode", "w2") {
            if (w2 - wn).abs() < 0.3 * wn || w2 < 0.3 * wn {
                return Err(Error::wrong(Quantity::Effect, format!(
                    "second_mode: w2 = {w2} rad/s is within 30 % of a release's natural frequency, {wn:.4} rad/s, or of zero"
                ), format!(
                    "take w2 from {:.4} to {:.4} or above {:.4} rad/s",
                    0.3 * wn,
                    0.7 * wn,
                    1.3 * wn
                )));
            }
        }
        Ok(())
    }
}
