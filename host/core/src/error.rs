//! Why there is no answer.

/// Why there is no answer. `record` is the record's own name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    #[error("{record}: no oscillation found")]
    NoOscillation { record: String },
    #[error("{record}: {cycles:.1} cycles of free oscillation, at least {fewest:.0} are needed")]
    TooFewCycles { record: String, cycles: f64, fewest: f64 },
    /// No method that was asked for has an answer.
    #[error("{record}: {reason}")]
    NoEstimate { record: String, reason: String },
    #[error("{record}: {samples} samples are too few to interpolate")]
    TooFewSamples { record: String, samples: usize },
    #[error("{record}: sampled at {rate_hz:.4} Hz, outside 20 Hz to 10 kHz")]
    Rate { record: String, rate_hz: f64 },
    /// Effects that a model is said to have leave no motion that is near the record.
    #[error("the model's own effects cannot be fitted to this record")]
    NotFitted,
    #[error("no spring was released at the middle axis with the wind on")]
    NoMiddleAxis,
    /// Somebody asked for it with a [`crate::stop::Stop`].
    #[error("interrupted")]
    Interrupted,
}

pub type Result<T> = std::result::Result<T, Error>;
