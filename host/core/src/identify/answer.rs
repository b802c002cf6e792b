//! What was found in a record, or why nothing was.

use super::flag::Flag;
use super::settings::Method;
use super::uncertainty::Bound;
use crate::error::Error;
use crate::quantity::Quantity;
use crate::record::Record;
use serde::{Deserialize, Serialize};

/// Fewest cycles an estimate is made from.
pub(crate) const FEWEST_CYCLES: f64 = 3.0;

/// Fewest samples of a cycle: what the fastest mode of a rig has at 20 Hz.
pub(crate) const FEWEST_PER_CYCLE: f64 = 4.7;

/// Why a record gives nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    NoOscillation,
    TooFewCycles {
        cycles: f64,
    },
    TooCoarse {
        per_cycle: f64,
    },
    /// Nobody asked for amplitudes beyond half a turn: more likely the unit is another.
    BeyondHalfTurn {
        peak_deg: f64,
    },
    /// Fewer than three cycles between the amplitudes that were asked for; those of the record.
    Elsewhere {
        most_deg: f64,
        least_deg: f64,
    },
}

impl Refusal {
    /// The error for `record`.
    pub fn of(self, record: &Record) -> Error {
        let record = record.file.display().to_string();
        match self {
            Refusal::NoOscillation => Error::NoOscillation { record },
            Refusal::TooFewCycles { cycles } => {
                Error::TooFewCycles { record, cycles, fewest: FEWEST_CYCLES }
            }
            Refusal::TooCoarse { per_cycle } => {
                Error::TooCoarse { record, per_cycle, fewest: FEWEST_PER_CYCLE }
            }
            Refusal::BeyondHalfTurn { peak_deg } => Error::BeyondHalfTurn { record, peak_deg },
            Refusal::Elsewhere { most_deg, least_deg } => {
                Error::Elsewhere { record, most_deg, least_deg }
            }
        }
    }
}

/// All that was found in one record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Identification {
    pub file: String,
    /// Beginning of the free motion on the record's own clock; the first sample where the release came before it
    /// (flag `starts_in_mid_swing`).
    pub release_time_s: f64,
    pub rate_hz: f64,
    pub window: AmplitudeWindow,
    /// Standard deviation of the noise: of what one mode leaves of the window where it explains it, of what three-cycle
    /// fits leave where it does not.
    pub noise_rms_deg: f64,
    /// Wild samples left out.
    pub outliers: usize,
    pub estimates: Vec<Estimate>,
    /// Methods that could not say anything about this record.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unavailable: Vec<Unavailable>,
}

/// What was analysed: amplitudes at its ends, not those asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeWindow {
    pub from_deg: f64,
    pub to_deg: f64,
    pub cycles: f64,
    pub from_s: f64,
    pub to_s: f64,
}

/// One method's answer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Estimate {
    pub method: Method,
    pub natural_frequency_rad_s: Quantity,
    pub damping_ratio: Quantity,
    /// Raw rms of record minus the mode with these two values, amplitude, phase and offset fitted.
    pub residual_rms_deg: f64,
    /// Three cycles each, in order of time.
    pub windows: Vec<WindowEstimate>,
    /// By least squares, from the largest amplitude of the windows to the smallest; of other methods none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at_amplitude: Vec<AtAmplitude>,
    pub flags: Vec<Flag>,
    /// Least standard deviations any unbiased method could reach in white noise of the residual's size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cramer_rao: Option<Bound>,
}

/// wn and zeta over three cycles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowEstimate {
    /// Middle of the window.
    pub time_s: f64,
    /// Envelope there.
    pub amplitude_deg: f64,
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
}

/// wn and zeta at one amplitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtAmplitude {
    pub amplitude_deg: f64,
    /// 2 pi over the period of a cycle begun there.
    pub natural_frequency_rad_s: Quantity,
    /// ln(A0/A1)/(2 pi) of the amplitudes at its ends.
    pub damping_ratio: Quantity,
}

/// Amplitudes at which wn and zeta are given.
const AMPLITUDES: usize = 7;

impl AtAmplitude {
    /// Amplitudes from the `first` to the `last` at which they are given: geometric, both among them.
    pub(crate) fn amplitudes(first: f64, last: f64) -> impl Iterator<Item = f64> {
        (0..AMPLITUDES)
            .map(move |k| first * (last / first).powf(k as f64 / (AMPLITUDES - 1) as f64))
    }
}

/// A method without an answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unavailable {
    pub method: Method,
    pub reason: String,
}
