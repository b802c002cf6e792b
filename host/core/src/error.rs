//! Why there is no answer.

/// Why there is no answer. `record` is the record's own name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    #[error("{record}: no oscillation found")]
    NoOscillation { record: String },
    #[error("{record}: {cycles:.1} cycles of free oscillation, at least {fewest:.0} are needed")]
    TooFewCycles { record: String, cycles: f64, fewest: f64 },
    #[error("{record}: the yaw angle swings to {peak_deg:.0} deg, more than half a turn")]
    BeyondHalfTurn { record: String, peak_deg: f64 },
    #[error("{record}: fewer than three cycles between the amplitudes asked for; its own go from {most_deg:.3} to {least_deg:.3} deg")]
    Elsewhere { record: String, most_deg: f64, least_deg: f64 },
    /// No method that was asked for has an answer.
    #[error("{record}: {reason}")]
    NoEstimate { record: String, reason: String },
    #[error("{record}: {samples} samples are too few to interpolate")]
    TooFewSamples { record: String, samples: usize },
    #[error(
        "{record}: sampled at {rate_hz:.4} Hz, too slow for a device, which needs {least_hz:.0} Hz"
    )]
    TooSlow { record: String, rate_hz: f64, least_hz: f64 },
    #[error("{record}: {samples} samples over {span_s:.0} s leave gaps that nothing can fill")]
    Gaps { record: String, samples: usize, span_s: f64 },
    #[error("{record}: {per_cycle:.1} samples a cycle, at least {fewest} are needed")]
    TooCoarse { record: String, per_cycle: f64, fewest: f64 },
    /// Effects that a model is said to have leave no motion that is near the record.
    #[error("the model's own effects cannot be fitted to this record")]
    NotFitted,
    #[error("no law of yaw angle and yaw rate could be fitted to this record")]
    NoLaw,
    #[error("no spring was released at the middle axis with the wind on")]
    NoMiddleAxis,
    /// Somebody asked for it with a [`crate::stop::Stop`].
    #[error("interrupted")]
    Interrupted,
}

pub type Result<T> = std::result::Result<T, Error>;
