//! The options of a diagnosis, and its result for each effect alone.

use crate::effects::Effect;
use crate::fit::fitting::Structure;
use crate::stop::Stop;
use serde::Serialize;

/// How a record is judged.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The sensor's zero is not known: it is fitted, and a constant moment cannot be distinguished from it.
    pub zero_unknown: bool,
    /// The user's own effects, to compete with those of the library, which take part anyway.
    pub own: Vec<Effect>,
    /// Effects and limits of the model that is there: they stay, and what it lacks is looked for.
    pub present: Structure,
    /// On which the user's own effects may depend.
    pub wind_speed_m_s: f64,
    /// The search ends when this asks for it.
    pub stop: Stop,
}

#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    pub effect: Effect,
    pub residual_over_noise: f64,
    pub evidence: f64,
    pub converged: bool,
    /// Why it does not stand although it helps: numbers that physics forbids or that the record does not fix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}
