//! Why there is no answer.

/// Why there is no answer. `record` is the record's own name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// Nothing was given.
    #[error("no release was given")]
    NoRelease,
    /// Nothing in the record swings.
    #[error("{record}: no oscillation found")]
    NoOscillation {
        /// Name of the record.
        record: String,
    },
    /// The free decay is too short for any method.
    #[error("{record}: {cycles:.1} cycles of free oscillation, at least {fewest:.0} are needed")]
    TooFewCycles {
        /// Name of the record.
        record: String,
        /// Cycles of free oscillation that were found.
        cycles: f64,
        /// Cycles that are needed.
        fewest: f64,
    },
    /// The angles are larger than anybody asked for: most likely the unit is another.
    #[error("{record}: the yaw angle swings to {peak_deg:.0} deg, more than half a turn")]
    BeyondHalfTurn {
        /// Name of the record.
        record: String,
        /// Largest yaw angle from the rest, if the record's unit is what it is said to be.
        peak_deg: f64,
    },
    /// The record has no three cycles between the amplitudes that were asked for.
    #[error("{record}: fewer than three cycles between the amplitudes asked for; its own go from {most_deg:.3} to {least_deg:.3} {unit}")]
    Elsewhere {
        /// Name of the record.
        record: String,
        /// Largest amplitude of the record.
        most_deg: f64,
        /// Smallest amplitude of the record.
        least_deg: f64,
        /// Of these.
        unit: String,
    },
    /// No method that was asked for has an answer.
    #[error("{record}: {reason}")]
    NoEstimate {
        /// Name of the record.
        record: String,
        /// In words, a method each.
        reason: String,
    },
    /// A spline needs more samples than there are.
    #[error("{record}: {samples} samples are too few to interpolate")]
    TooFewSamples {
        /// Name of the record.
        record: String,
        /// Samples of the record.
        samples: usize,
    },
    /// A device could not have sampled the record so slowly.
    #[error(
        "{record}: sampled at {rate_hz:.4} Hz, too slow for a device, which needs {least_hz:.0} Hz"
    )]
    TooSlow {
        /// Name of the record.
        record: String,
        /// Sampling rate of the record.
        rate_hz: f64,
        /// Slowest rate that a device takes.
        least_hz: f64,
    },
    /// Most of the record is missing.
    #[error("{record}: {samples} samples over {span_s:.0} s leave gaps that nothing can fill")]
    Gaps {
        /// Name of the record.
        record: String,
        /// Samples that there are.
        samples: usize,
        /// Time from the first sample to the last.
        span_s: f64,
    },
    /// The oscillation is too fast for the sampling rate.
    #[error("{record}: {per_cycle:.1} samples a cycle, at least {fewest} are needed")]
    TooCoarse {
        /// Name of the record.
        record: String,
        /// Samples a cycle that there are.
        per_cycle: f64,
        /// Samples a cycle that are needed.
        fewest: f64,
    },
    /// Records of different quantities, of which no number is common.
    #[error("{record} holds another quantity ({quantity} in {unit}) than {first}")]
    OtherMeasurand {
        /// Name of the record.
        record: String,
        /// What it holds.
        quantity: String,
        /// Its unit.
        unit: String,
        /// Name of the first record.
        first: String,
    },
    /// Effects that a model is said to have leave no motion that is near the record.
    #[error("the model's own effects cannot be fitted to this record")]
    NotFitted,
    /// No curve of yaw angle and yaw rate comes near the record.
    #[error("no law of yaw angle and yaw rate could be fitted to this record")]
    NoLaw,
    /// The equations for a sensor's error have no solution.
    #[error("these releases do not determine what the sensor errs by")]
    NoTable,
    /// A campaign without a wind-on release at the middle axis has no yaw moment derivatives.
    #[error("no spring was released at the middle axis with the wind on")]
    NoMiddleAxis,
    /// Somebody asked for it with a [`crate::stop::Stop`].
    #[error("interrupted")]
    Interrupted,
}

/// Of everything here that can fail.
pub type Result<T> = std::result::Result<T, Error>;
