//! What was found in a record, or why nothing was.

use super::cycle::Cycle;
use super::flag::Flag;
use super::settings::Method;
use super::uncertainty::{Bound, Lacking};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::record::{Record, Said};
use serde::{Deserialize, Serialize};

/// Fewest cycles an estimate is made from.
pub(crate) const MIN_CYCLES: f64 = 3.0;

/// Fewest samples of a cycle: what the fastest mode of a rig has at 20 Hz.
pub(crate) const MIN_PER_CYCLE: f64 = 4.7;

/// Why a record gives nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// Nothing swings.
    NoOscillation,
    /// The free decay is too short.
    TooFewCycles {
        /// Cycles of free oscillation that were found.
        cycles: f64,
    },
    /// Too few samples in a cycle.
    TooCoarse {
        /// Samples a cycle that there are.
        per_cycle: f64,
    },
    /// Nobody asked for amplitudes beyond half a turn: more likely the unit is another.
    BeyondHalfTurn {
        /// Largest yaw angle from the rest.
        peak_deg: f64,
    },
    /// Fewer than three cycles between the amplitudes that were asked for; those of the record.
    Elsewhere {
        /// Largest amplitude of the record.
        most_deg: f64,
        /// Smallest amplitude of the record.
        least_deg: f64,
    },
}

impl Refusal {
    /// The error for `record`.
    pub(crate) fn of(self, record: &Record) -> Error {
        let unit = record.measurand.coordinate_unit().to_owned();
        let record = record.file.display().to_string();
        match self {
            Refusal::NoOscillation => Error::NoOscillation { record },
            Refusal::TooFewCycles { cycles } => {
                Error::TooFewCycles { record, cycles, fewest: MIN_CYCLES }
            }
            Refusal::TooCoarse { per_cycle } => {
                Error::TooCoarse { record, per_cycle, fewest: MIN_PER_CYCLE }
            }
            Refusal::BeyondHalfTurn { peak_deg } => Error::BeyondHalfTurn { record, peak_deg },
            Refusal::Elsewhere { most_deg, least_deg } => {
                Error::Elsewhere { record, most_deg, least_deg, unit }
            }
        }
    }
}

/// All that was found in one record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Identification {
    /// The record's own name.
    pub file: String,
    /// What it holds, where that is no angle in deg.
    #[serde(flatten)]
    pub said: Said,
    /// Beginning of the free motion on the record's own clock; the first sample where the release came before
    /// it (flag `starts_in_mid_swing`).
    pub release_time_s: f64,
    /// How the free motion begins.
    #[serde(default)]
    pub begins: Begin,
    /// How what was analysed ends.
    #[serde(default)]
    pub ends: End,
    /// The other releases of the record, which were not used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_releases: Vec<Span>,
    /// Samples a second.
    pub rate_hz: f64,
    /// The part that was analysed.
    pub window: AmplitudeWindow,
    /// Standard deviation of the noise: of what one mode leaves of the window where it explains it, of what
    /// three-cycle fits leave where it does not.
    pub noise_rms_deg: f64,
    /// Wild samples left out.
    pub outliers: usize,
    /// In the order in which the methods were asked.
    pub estimates: Vec<Estimate>,
    /// Methods that could not say anything about this record.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unavailable: Vec<Unavailable>,
}

/// How a free motion begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Begin {
    /// Let go after it was held still.
    Held,
    /// Left to itself after it was driven.
    Driven,
    /// Behind a push or a hand.
    Pushed,
    /// The record begins in the middle of it.
    MidSwing,
    /// With the record.
    #[default]
    Record,
}

impl Begin {
    /// In words, behind a time.
    pub fn words(self) -> &'static str {
        match self {
            Self::Held => "let go from a hold",
            Self::Driven => "driven until then",
            Self::Pushed => "pushed until then",
            Self::MidSwing => "the record begins in mid swing",
            Self::Record => "the record begins there",
        }
    }
}

/// How what was analysed of a free motion ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// At the smallest amplitude that was asked for.
    Amplitude,
    /// Where it is lost in the noise.
    DiedOut,
    /// Stopped or pushed.
    Stopped,
    /// With the record.
    #[default]
    Record,
}

impl End {
    /// In words, behind a time.
    pub fn words(self) -> &'static str {
        match self {
            Self::Amplitude => "the smallest amplitude asked for",
            Self::DiedOut => "died out",
            Self::Stopped => "stopped or pushed there",
            Self::Record => "the record ends there",
        }
    }
}

/// A part of a record, on its own clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// Its beginning.
    pub from_s: f64,
    /// Its end.
    pub to_s: f64,
}

/// What was analysed: amplitudes at its ends, not those asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeWindow {
    /// Amplitude at the beginning.
    pub from_deg: f64,
    /// Amplitude at the end.
    pub to_deg: f64,
    /// Of damped oscillation, in between.
    pub cycles: f64,
    /// Beginning, on the record's clock.
    pub from_s: f64,
    /// End, on the record's clock.
    pub to_s: f64,
}

/// One method's answer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Estimate {
    /// The method whose answer it is.
    pub method: Method,
    /// Undamped; where it changes over the window that of its mean cycle.
    pub natural_frequency_rad_s: Quantity,
    /// Negative where the oscillation grows; where it changes over the window that of its mean cycle.
    pub damping_ratio: Quantity,
    /// Lowest and highest over the window, by a smooth curve; twice the value where nothing changes.
    #[serde(default)]
    pub natural_frequency_range_rad_s: [f64; 2],
    /// Lowest and highest over the window, by a smooth curve; twice the value where nothing changes.
    #[serde(default)]
    pub damping_ratio_range: [f64; 2],
    /// The same in the words of other fields.
    #[serde(flatten)]
    pub cycle: Cycle,
    /// Raw rms of record minus the mode with these two values, amplitude, phase and offset fitted.
    pub residual_rms_deg: f64,
    /// Three cycles each, in order of time.
    pub windows: Vec<WindowEstimate>,
    /// By least squares, from the largest amplitude of the windows to the smallest; of other methods none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at_amplitude: Vec<AtAmplitude>,
    /// What a reader must know besides.
    pub flags: Vec<Flag>,
    /// Least standard deviations any unbiased method could reach in white noise of the residual's size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cramer_rao: Option<Bound>,
    /// wn and zeta of every three cycles by least squares, in order of time; not stored.
    #[serde(skip)]
    pub by_window: Vec<AtAmplitude>,
    /// What one mode is over all of the window; not stored.
    #[serde(skip)]
    pub one_mode: Option<OneMode>,
}

/// A method's one mode over all of the window, with uncertainties that hold how far wn and zeta change over
/// it: of a linear model, whatever it lacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneMode {
    /// Undamped.
    pub natural_frequency_rad_s: Quantity,
    /// Negative where the oscillation grows.
    pub damping_ratio: Quantity,
    /// What of the uncertainties is for a law that one mode lacks.
    pub lacking: Lacking,
}

/// Cycles in which an oscillation that decays at all is seen to.
const MANY_CYCLES: f64 = 20.0;
/// Share of the frequency's variance from which on its clock is named.
const OF_CLOCK: f64 = 0.1;

impl Estimate {
    /// Whether no decay shows in so many cycles: none is a damping ratio within twice its uncertainty.
    pub(crate) fn lasts(&self, cycles: f64) -> bool {
        cycles > MANY_CYCLES && self.damping_ratio.value.abs() <= 2.0 * self.damping_ratio.u
    }

    /// Whether a rate with this relative standard uncertainty makes a good part of the frequency's.
    pub(crate) fn is_of_coarse_clock(&self, rate_u: f64) -> bool {
        let wn = self.natural_frequency_rad_s;
        (wn.value * rate_u).powi(2) > OF_CLOCK * (wn.u.powi(2) + (wn.value * rate_u).powi(2))
    }

    /// The same of a record whose rate has this relative standard uncertainty: all of its frequencies have.
    pub(crate) fn on_clock(mut self, rate_u: f64) -> Self {
        let widen = |wn: &mut Quantity| *wn = wn.on_clock(rate_u, -1.0);
        widen(&mut self.natural_frequency_rad_s);
        self.at_amplitude.iter_mut().for_each(|at| widen(&mut at.natural_frequency_rad_s));
        self.cycle = Cycle::new(self.natural_frequency_rad_s, self.damping_ratio);
        self
    }
}

/// wn and zeta over three cycles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowEstimate {
    /// Middle of the window.
    pub time_s: f64,
    /// Envelope there.
    pub amplitude_deg: f64,
    /// Undamped.
    pub natural_frequency_rad_s: f64,
    /// Negative where the oscillation grows.
    pub damping_ratio: f64,
}

/// wn and zeta at one amplitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtAmplitude {
    /// At the beginning of the cycle.
    pub amplitude_deg: f64,
    /// 2 pi over the period of a cycle begun there.
    pub natural_frequency_rad_s: Quantity,
    /// ln(A0/A1)/(2 pi) of the amplitudes at its ends.
    pub damping_ratio: Quantity,
}

/// Amplitudes at which wn and zeta are given.
const AMPLITUDES_GIVEN: usize = 7;

impl AtAmplitude {
    /// Amplitudes from the `first` to the `last` at which they are given: geometric, both among them.
    pub(crate) fn amplitudes(first: f64, last: f64) -> impl Iterator<Item = f64> {
        (0..AMPLITUDES_GIVEN)
            .map(move |k| first * (last / first).powf(k as f64 / (AMPLITUDES_GIVEN - 1) as f64))
    }

    /// At `amplitude_deg`, in proportion to its logarithm between the two nearest of `all`, whose amplitudes
    /// fall; `None` beyond them.
    pub fn between(all: &[Self], amplitude_deg: f64) -> Option<Self> {
        let inside = |pair: &&[Self]| {
            (pair[1].amplitude_deg..=pair[0].amplitude_deg).contains(&amplitude_deg)
        };
        let pair = all.windows(2).find(inside)?;
        let ln = |a: &Self| a.amplitude_deg.ln();
        let share = (ln(&pair[0]) - amplitude_deg.ln()) / (ln(&pair[0]) - ln(&pair[1]));
        let mean = |of: fn(&Self) -> Quantity| {
            let (a, b) = (of(&pair[0]), of(&pair[1]));
            let value = a.value + share * (b.value - a.value);
            Quantity::new(value, ((1.0 - share) * a.u).hypot(share * b.u))
        };
        Some(Self {
            amplitude_deg,
            natural_frequency_rad_s: mean(|a| a.natural_frequency_rad_s),
            damping_ratio: mean(|a| a.damping_ratio),
        })
    }
}

/// A method without an answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unavailable {
    /// The method that has no answer.
    pub method: Method,
    /// Why it has none, in words.
    pub reason: String,
}
