//! Natural frequency and damping ratio of recorded free decays.
//!
//! [`identify`] finds the free swing in a record and hands the part inside the amplitude window to each method.
//! Angles in deg, as recorded; damping ratio negative where the oscillation grows.

pub mod conventional;
pub mod damped_sinusoid;
pub mod envelope;
pub mod flag;
pub mod gaps;
pub mod least_squares;
mod lowpass;
pub mod network;
pub mod outliers;
pub mod pencil;
mod prepared;
pub mod release;
pub mod samples;
pub mod spectrum;
mod trend;
pub mod uncertainty;
pub mod windows;

use crate::error::{Error, Result};
use crate::quantity::Quantity;
use crate::record::Record;
use flag::Flag;
use serde::{Deserialize, Serialize};

pub use prepared::{prepare, Prepared, Values};

/// Fewest cycles an estimate is made from.
pub const FEWEST_CYCLES: f64 = 3.0;

/// How records are analysed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Amplitude at which the analysis starts, deg.
    pub from_deg: f64,
    /// Amplitude at which it ends, deg.
    pub to_deg: f64,
    pub conventional: conventional::Options,
}

impl Default for Settings {
    fn default() -> Self {
        Self { from_deg: 10.0, to_deg: 1.0, conventional: conventional::Options::default() }
    }
}

/// How wn and zeta are had from the swing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    LeastSquares,
    Conventional,
    Network,
}

/// Why a record gives nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    NoOscillation,
    TooFewCycles { cycles: f64 },
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
    pub flags: Vec<Flag>,
    /// Least standard deviations any unbiased method could reach in white noise of the residual's size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cramer_rao: Option<uncertainty::Bound>,
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

/// A method without an answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unavailable {
    pub method: Method,
    pub reason: String,
}

/// Applies `methods` to a record: release, hold, end and offset are found in it. See the example of the crate.
///
/// ```
/// use yawrig_core::error::Error;
/// use yawrig_core::identify::{identify, Method, Settings};
/// use yawrig_core::record::Record;
///
/// let time_s: Vec<f64> = (0..3000).map(|k| f64::from(k) / 300.0).collect();
/// let yaw_deg = time_s.iter().map(|t| 11.0 * (-0.2 * t).exp() * (8.0 * t).cos()).collect();
/// let record = Record { file: "mine".into(), time_s, yaw_deg };
/// let methods = [Method::LeastSquares, Method::Conventional];
/// let found = identify(&record, &methods, &Settings::default())?;
/// let zeta = found.estimates[0].damping_ratio.value;
/// assert!((zeta / 0.025 - 1.0).abs() < 1e-3, "{zeta}");
///
/// let flat = Record { yaw_deg: vec![1.0; 3000], ..record };
/// let refused = identify(&flat, &methods, &Settings::default());
/// assert!(matches!(refused, Err(Error::NoOscillation { .. })));
/// # Ok::<(), Error>(())
/// ```
///
/// # Errors
/// No oscillation in it, fewer than three cycles, or no method with an answer.
pub fn identify(
    record: &Record,
    methods: &[Method],
    settings: &Settings,
) -> Result<Identification> {
    let prepared = prepare(record, settings).map_err(|refusal| refusal.of(record))?;
    let mut estimates = Vec::new();
    let mut unavailable = Vec::new();
    for &method in methods {
        let answer = match method {
            Method::LeastSquares => prepared.least_squares(),
            Method::Conventional => conventional::values(&prepared),
            Method::Network => network::values(&prepared),
        };
        match answer.and_then(|values| prepared.judged(method, values)) {
            Ok(estimate) => estimates.push(estimate),
            Err(reason) => unavailable.push(Unavailable { method, reason }),
        }
    }
    if let (true, Some(first)) = (estimates.is_empty(), unavailable.first()) {
        let record = record.file.display().to_string();
        return Err(Error::NoEstimate { record, reason: first.reason.to_string() });
    }
    Ok(Identification {
        file: record.file.display().to_string(),
        release_time_s: prepared.swing.release_time_s,
        rate_hz: prepared.samples.rate_hz(),
        window: prepared.window(),
        noise_rms_deg: prepared.noise_rms_deg(),
        outliers: prepared.samples.excluded(),
        estimates,
        unavailable,
    })
}
