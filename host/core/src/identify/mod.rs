//! Natural frequency and damping ratio of recorded free decays.
//!
//! [`identify`] finds the free decay in a record and hands the part inside the amplitude window to each
//! method. Angles in deg, as recorded; damping ratio negative where the oscillation grows.

mod answer;
pub mod conventional;
pub mod cycle;
pub mod damped_sinusoid;
mod driven;
mod ends;
pub(crate) mod envelope;
pub mod flag;
mod free_motion;
pub mod gaps;
pub mod least_squares;
mod lowpass;
pub(crate) mod network;
mod onset;
mod oscillation;
pub(crate) mod outliers;
mod over_window;
pub(crate) mod pencil;
mod prepared;
pub(crate) mod release;
pub mod samples;
mod settings;
pub mod several;
mod smooth;
pub mod steady_line;
mod trend;
pub mod uncertainty;
pub(crate) mod windows;

use crate::error::{Error, Result};
use crate::record::Record;

pub(crate) use answer::MIN_CYCLES;
pub use answer::{
    AmplitudeWindow, AtAmplitude, Begin, End, Estimate, Identification, OneMode, Refusal, Span,
    Unavailable, WindowEstimate,
};
pub(crate) use prepared::{prepare, Prepared, Values};
pub use settings::{Method, Settings};

/// Applies `methods` to a record: release, hold, end and offset are found in it. See the example of the
/// crate.
///
/// ```
/// use yawrig_core::error::Error;
/// use yawrig_core::identify::{identify, Method, Settings};
/// use yawrig_core::record::Record;
///
/// let time_s: Vec<f64> = (0..3000).map(|k| f64::from(k) / 300.0).collect();
/// let yaw_deg = time_s.iter().map(|t| 11.0 * (-0.2 * t).exp() * (8.0 * t).cos()).collect();
/// let record = Record::new("mine", time_s, yaw_deg);
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
    let other_releases = several::beside(&prepared);
    let mut estimates = Vec::new();
    let mut unavailable = Vec::new();
    for &method in methods {
        let answer = match method {
            Method::LeastSquares => prepared.least_squares(),
            Method::Conventional => conventional::values(&prepared),
            Method::Network => network::values(&prepared),
        };
        match answer.and_then(|values| prepared.judged(method, values)) {
            Ok(mut estimate) => {
                let last = [
                    (!other_releases.is_empty(), flag::Flag::SeveralReleases),
                    (record.repeats().is_some(), flag::Flag::RepeatedValues),
                    (estimate.lasts(prepared.window().cycles), flag::Flag::DoesNotDieAway),
                    (estimate.is_of_coarse_clock(record.rate_u), flag::Flag::RateUncertain),
                ];
                estimate
                    .flags
                    .extend(last.iter().filter(|(found, _)| *found).map(|(_, flag)| *flag));
                estimates.push(estimate.on_clock(record.rate_u));
            }
            Err(reason) => unavailable.push(Unavailable { method, reason }),
        }
    }
    if let (true, Some(first)) = (estimates.is_empty(), unavailable.first()) {
        let record = record.file.display().to_string();
        return Err(Error::NoEstimate { record, reason: first.reason.to_string() });
    }
    Ok(Identification {
        file: record.file.display().to_string(),
        said: record.measurand.said(),
        release_time_s: prepared.span.release_time_s,
        begins: prepared.span.begin,
        ends: prepared.span.end,
        other_releases,
        rate_hz: prepared.samples.rate_hz(),
        window: prepared.window(),
        noise_rms_deg: prepared.noise_rms_deg(),
        outliers: prepared.samples.excluded(),
        estimates,
        unavailable,
    })
}
