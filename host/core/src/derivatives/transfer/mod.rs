//! Derivatives against reduced frequency as one cause: a transfer function of the yaw angle to the wind's
//! moment, from Cn_beta and Cn_r of all springs and wind speeds at once.
//!
//! A linear moment that the past of the motion makes has one function Cn(s') of it; its two parts at the
//! springs' frequencies are the two columns. So what one column does the other must (Kramers and Kronig), and
//! a few numbers hold both.

mod cause;
mod chance;
mod fit;
#[cfg(test)]
mod tests;
mod words;

use super::at::At;
use super::computed::Computed;
use super::condition::SAME_SPEED;
use super::inputs::{uncertain, Inputs, Place, Uncertain};
use crate::quantity::Quantity;
use cause::{Cause, Motion};
use fit::{fits, Columns, Fitted};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// A straight line through two points holds anything: of reduced frequencies there have to be more.
const MIN: usize = 3;
/// Reduced frequencies of the curve.
const CURVE: usize = 24;
/// A cause that chance makes look so bad less often than this is refused: once in a thousand.
const REFUSED: f64 = 0.001;

/// Chi squared of a fit, and how often chance exceeds it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// Of both columns, with the full covariance of their errors.
    pub chi_squared: f64,
    /// Numbers in the columns less those fitted.
    pub degrees: usize,
    /// Of so large a chi squared or a larger one where the fit is the truth.
    pub probability: f64,
}

/// Cn(s') = a0 + a1 s' + a2 s' / (s' + b) + a3 s' / (s' + b2), s' = s l / V.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameters {
    /// Cn_beta of the slowest motion.
    pub a0: Quantity,
    /// Cn_r of the fastest motion.
    pub a1: Quantity,
    /// Of the first lag, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a2: Option<Quantity>,
    /// Its pole, per length of the model that the air goes; u infinite (`null`) where it lies beyond what the
    /// reduced frequencies show.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b: Option<Quantity>,
    /// Of the second lag, the quicker one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a3: Option<Quantity>,
    /// Its pole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b2: Option<Quantity>,
}

impl Parameters {
    /// Those that there are, by name.
    pub fn named(&self) -> Vec<(&'static str, Quantity)> {
        let Self { a0, a1, a2, b, a3, b2 } = *self;
        let all = [Some(a0), Some(a1), a2, b, a3, b2];
        ["a0", "a1", "a2", "b", "a3", "b2"]
            .into_iter()
            .zip(all)
            .filter_map(|(name, q)| Some((name, q?)))
            .collect()
    }

    /// a and b of each lag.
    pub fn lags(&self) -> Vec<[Quantity; 2]> {
        [(self.a2, self.b), (self.a3, self.b2)]
            .into_iter()
            .filter_map(|(a, b)| Some([a?, b?]))
            .collect()
    }
}

/// The transfer function at a reduced frequency, of a motion that does not decay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// km, as of the points; k = w l / V is twice that.
    pub reduced_frequency: f64,
    /// u by the parameters' covariance.
    pub cn_beta: Quantity,
    /// u by the parameters' covariance.
    pub cn_r: Quantity,
}

/// What the transfer function says of a point of the table, of a motion that decays as its release did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AtPoint {
    /// Name of the springs.
    pub spring: String,
    /// Mean wind speed of the wind-on releases.
    pub wind_speed_m_s: f64,
    /// km.
    pub reduced_frequency: f64,
    /// u by the parameters' covariance.
    pub cn_beta: Quantity,
    /// u by the parameters' covariance.
    pub cn_r: Quantity,
}

/// The transfer function of the points of one setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Transfer {
    /// What else they were made under.
    #[serde(skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// The fewest that further ones do not better by more than chance.
    pub lags: usize,
    /// u widened by Birge's ratio where the columns scatter more than stated by more than chance.
    pub parameters: Parameters,
    /// Without a lag: both columns constant.
    pub quasi_steady: Judged,
    /// With `lags`.
    pub chosen: Judged,
    /// Whether constant derivatives hold both columns.
    pub quasi_steady_does: bool,
    /// Whether the chosen function holds both columns; where it does not its parameters mean little.
    pub one_cause: bool,
    /// Both in words.
    pub sentences: Vec<String>,
    /// Over the reduced frequencies measured.
    pub curve: Vec<CurvePoint>,
    /// At those of the table.
    pub points: Vec<AtPoint>,
}

/// Why there is no transfer function of the points of a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refused {
    /// What else they were made under.
    #[serde(skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// What is missing, and what that does.
    pub why: String,
    /// What to do.
    pub help: String,
}

impl Computed<'_> {
    /// The transfer function about the middle axis of each setting, in the order of its first point.
    pub fn transfers(&self) -> Vec<Result<Transfer, Refused>> {
        let uncertain = uncertain(self.campaign, &self.conditions, &self.layout, &self.inputs);
        let at = |place: usize| &self.conditions[self.layout.places[place].mid.on].setting.at;
        let mut settings: Vec<(&At, Vec<usize>)> = Vec::new();
        for place in 0..self.layout.places.len() {
            match settings.iter_mut().find(|(known, _)| *known == at(place)) {
                Some((_, places)) => places.push(place),
                None => settings.push((at(place), vec![place])),
            }
        }
        let one = |(at, places): (&At, Vec<usize>)| {
            Setting { computed: self, uncertain: &uncertain, places }
                .of_known_error()
                .transfer(at)
                .map_err(|(why, help)| Refused { at: at.clone(), why, help: help.to_owned() })
        };
        settings.into_iter().map(one).collect()
    }
}

/// The places of one setting.
struct Setting<'a> {
    computed: &'a Computed<'a>,
    uncertain: &'a [Uncertain],
    places: Vec<usize>,
}

impl Setting<'_> {
    /// Without places at which the derivatives or their errors are no numbers.
    fn of_known_error(mut self) -> Self {
        let values = self.columns(&self.computed.inputs).values;
        let errors = self.covariance(None).diagonal();
        let is_known = |k: usize| (values[k] + errors[k]).is_finite();
        let mut known = (0..self.places.len()).map(|k| is_known(2 * k) && is_known(2 * k + 1));
        self.places.retain(|_| known.next() == Some(true));
        self
    }

    fn place(&self, index: usize) -> &Place {
        &self.computed.layout.places[self.places[index]]
    }

    fn motion(inputs: &Inputs, on: usize) -> Motion {
        let (modal, wind, model) = (inputs.modal(on), inputs.wind(on), inputs.model());
        [-modal.decay_rate_per_s(), modal.damped_frequency_rad_s()]
            .map(|rate| rate * model.length_m / wind.speed_m_s)
    }

    fn columns(&self, inputs: &Inputs) -> Columns {
        let outputs = self.computed.layout.outputs(inputs);
        let motion = |k: usize| Self::motion(inputs, self.place(k).mid.on);
        let both = self.places.iter().flat_map(|&place| {
            let of = outputs.points[place].mid;
            [of.cn_beta, of.cn_r]
        });
        Columns {
            motions: (0..self.places.len()).map(motion).collect(),
            values: DVector::from_iterator(2 * self.places.len(), both),
        }
    }

    /// Of the columns less the cause: each uncertain number moves both columns of all places that it enters,
    /// and their motions, and so what the cause has there.
    fn covariance(&self, cause: Option<&Cause>) -> DMatrix<f64> {
        let inputs = cause.map_or_else(|| self.computed.inputs.clone(), |cause| self.as_by(cause));
        let left = |by: f64, uncertain: &Uncertain| {
            let mut changed = inputs.clone();
            (uncertain.change)(&mut changed, by);
            let Columns { motions, mut values } = self.columns(&changed);
            if let Some(cause) = cause {
                for (k, motion) in motions.into_iter().enumerate() {
                    let (of_cause, _) = cause.columns(motion);
                    (0..2).for_each(|c| values[2 * k + c] -= of_cause[c]);
                }
            }
            values
        };
        let count = 2 * self.places.len();
        let mut covariance = DMatrix::zeros(count, count);
        for each in self.uncertain {
            let change = 0.5 * (left(each.u, each) - left(-each.u, each));
            covariance += &change * change.transpose();
        }
        covariance
    }

    /// The numbers with the wind-on modes that the cause makes of those without wind, so that the columns are
    /// its own.
    fn as_by(&self, cause: &Cause) -> Inputs {
        let computed = self.computed;
        let (mut inputs, inertia) = (computed.inputs.clone(), |inputs: &Inputs| {
            computed.layout.outputs(inputs).inertia_kg_m2[yawrig_shared::axis::Axis::Mid as usize]
        });
        let inertia_kg_m2 = inertia(&inputs);
        for k in 0..self.places.len() {
            let pair = self.place(k).mid;
            let ([cn_beta, cn_r], _) = cause.columns(Self::motion(&inputs, pair.on));
            let mode = yawrig_shared::derivatives::YawDerivatives { cn_beta, cn_r }.wind_on(
                &inputs.modal(pair.off),
                inertia_kg_m2,
                &inputs.wind(pair.on),
                inputs.model(),
            );
            // A cause that no spring stands is far off; the next is fitted with what was measured there.
            mode.into_iter().for_each(|mode| inputs.set_modal(pair.on, &mode));
        }
        inputs
    }

    fn transfer(&self, at: &At) -> Result<Transfer, (String, &'static str)> {
        let columns = self.columns(&self.computed.inputs);
        let mut km: Vec<f64> = columns.motions.iter().map(|[_, im]| 0.5 * im).collect();
        km.sort_by(f64::total_cmp);
        let different = km.iter().fold(Vec::new(), |mut known: Vec<f64>, km| {
            if known.last().is_none_or(|last| *km > last * (1.0 + SAME_SPEED)) {
                known.push(*km);
            }
            known
        });
        if different.len() < MIN {
            return Err(words::too_few(&different, MIN));
        }
        let covariance = |cause: Option<&Cause>| self.covariance(cause);
        let (all, chosen) = fits(&columns, &covariance).ok_or_else(|| {
            (
                "the derivatives have no errors of their own, so that there is nothing to weigh them by"
                    .to_owned(),
                "use records with the sensor's noise in them",
            )
        })?;
        Ok(self.answer(at, &all, chosen, [km[0], km[km.len() - 1]]))
    }

    fn answer(&self, at: &At, all: &[Fitted], lags: usize, [low, high]: [f64; 2]) -> Transfer {
        let chosen = &all[lags];
        let covariance = &chosen.covariance * chosen.widened().powi(2);
        let on = |motion: Motion| {
            let (values, slopes) = chosen.cause.columns(motion);
            [0, 1].map(|c| {
                let slope = DVector::from_iterator(slopes.len(), slopes.iter().map(|by| by[c]));
                Quantity::new(values[c], slope.dot(&(&covariance * &slope)).max(0.0).sqrt())
            })
        };
        let curve = |k: usize| {
            let km = low * (high / low).powf(k as f64 / (CURVE - 1) as f64);
            let [cn_beta, cn_r] = on([0.0, 2.0 * km]);
            CurvePoint { reduced_frequency: km, cn_beta, cn_r }
        };
        let point = |k: usize| {
            let index = self.place(k).mid.on;
            let motion = Self::motion(&self.computed.inputs, index);
            let setting = &self.computed.conditions[index].setting;
            let [cn_beta, cn_r] = on(motion);
            AtPoint {
                spring: setting.spring.clone(),
                wind_speed_m_s: setting.wind_speed_m_s,
                reduced_frequency: 0.5 * motion[1],
                cn_beta,
                cn_r,
            }
        };
        let one_cause = chosen.chance() >= REFUSED;
        Transfer {
            at: at.clone(),
            lags,
            parameters: parameters(chosen, &covariance),
            quasi_steady: judged(&all[0]),
            chosen: judged(chosen),
            quasi_steady_does: lags == 0 && one_cause,
            one_cause,
            sentences: words::sentences(all, lags, one_cause),
            curve: (0..CURVE).map(curve).collect(),
            points: (0..self.places.len()).map(point).collect(),
        }
    }
}

fn judged(fitted: &Fitted) -> Judged {
    let Fitted { chi_squared, degrees, .. } = *fitted;
    Judged { chi_squared, degrees, probability: fitted.chance() }
}

fn parameters(fitted: &Fitted, covariance: &DMatrix<f64>) -> Parameters {
    let u = |i: usize| covariance[(i, i)].sqrt();
    let Cause { a0, a1, lags } = &fitted.cause;
    let lag = |k: usize| {
        let [a, b] = *lags.get(k)?;
        let u_b = if fitted.at_end[2 * k + 3] { f64::INFINITY } else { b * u(2 * k + 3) };
        Some((Quantity::new(a, u(2 * k + 2)), Quantity::new(b, u_b)))
    };
    let ((a2, b), (a3, b2)) = (lag(0).unzip(), lag(1).unzip());
    Parameters { a0: Quantity::new(*a0, u(0)), a1: Quantity::new(*a1, u(1)), a2, b, a3, b2 }
}
