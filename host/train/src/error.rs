//! Why a network could not be trained.

use std::fmt;
use yawrig_base::error::{Error, Exit};

/// A training set or a set of options that cannot lead to a network.
#[derive(Clone, Debug, PartialEq)]
pub enum TrainError {
    /// A length that does not follow from `n`, `d`, `k` or the topology.
    Shape { what: &'static str, expected: usize, found: usize },
    /// No samples, inputs, outputs, nodes of a hidden layer, epochs or restarts.
    Empty { what: &'static str },
    /// NaN or infinity; `sample` counts from 0, `column` within inputs or targets.
    NotFinite { what: &'static str, sample: usize, column: usize },
    /// A value far outside [-1, 1], for which neither the start nor the prior means anything.
    NotScaled { what: &'static str, sample: usize, column: usize, value: f64 },
    /// An output whose target never changes: nothing to learn, and no scale.
    ConstantTarget { column: usize },
    /// More parameters than the targets could ever determine.
    TooManyParameters { parameters: usize, target_values: usize },
    /// A numeric option out of its range.
    Option { what: &'static str, value: f64 },
    /// No start led to a finite network; `restarts` were tried.
    Diverged { restarts: usize },
}

impl TrainError {
    /// One thing to do about it.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Shape { .. } => "pass n*d inputs, n*k targets and the weights of this topology",
            Self::Empty { .. } => "ask for at least one",
            Self::NotFinite { .. } => "drop the sample or repair what it was made from",
            Self::NotScaled { .. } => "scale inputs and targets to [-1, 1] first",
            Self::ConstantTarget { .. } => "widen the range this target is drawn from",
            Self::TooManyParameters { .. } => "take more samples or fewer hidden nodes",
            Self::Option { .. } => "give a positive, finite value",
            Self::Diverged { .. } => "check the scaling of the inputs, or try another seed",
        }
    }
}

impl fmt::Display for TrainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shape { what, expected, found } => {
                write!(f, "training: {what}: {found} numbers where {expected} belong")
            }
            Self::Empty { what } => write!(f, "training: no {what}"),
            Self::NotFinite { what, sample, column } => {
                write!(f, "training: {what} of sample {sample}, column {column}, is not a number")
            }
            Self::NotScaled { what, sample, column, value } => write!(
                f,
                "training: {what} of sample {sample}, column {column}, is {value:e}, far outside [-1, 1]"
            ),
            Self::ConstantTarget { column } => {
                write!(f, "training: target {column} is the same in every sample")
            }
            Self::TooManyParameters { parameters, target_values } => write!(
                f,
                "training: {parameters} parameters cannot be determined from {target_values} target values"
            ),
            Self::Option { what, value } => write!(f, "training: {what} cannot be {value}"),
            Self::Diverged { restarts } => {
                write!(f, "training: none of {restarts} start(s) led to a finite network")
            }
        }
    }
}

impl std::error::Error for TrainError {}

impl From<TrainError> for Error {
    fn from(e: TrainError) -> Self {
        let exit = match e {
            // The settings were sound, what came of them is not.
            TrainError::Diverged { .. } => Exit::Quality,
            TrainError::Empty { .. }
            | TrainError::ConstantTarget { .. }
            | TrainError::TooManyParameters { .. }
            | TrainError::Option { .. } => Exit::Usage,
            TrainError::Shape { .. }
            | TrainError::NotFinite { .. }
            | TrainError::NotScaled { .. } => Exit::Data,
        };
        Error::new(exit, e.to_string()).help(e.help())
    }
}
