//! Yaw angle over time as it comes from a file, at whatever rate and with whatever jitter.

mod noise;
mod resample;
mod timing;

pub use timing::Timing;

use crate::error::{Error, Result};
use std::path::PathBuf;

/// One recorded release.
///
/// ```
/// use yawrig_core::record::Record;
///
/// let time_s: Vec<f64> = (0..2000).map(|k| f64::from(k) / 250.0).collect();
/// let yaw_deg = time_s.iter().map(|t| 9.0 * (-0.1 * t).exp() * (6.0 * t).cos()).collect();
/// let record = Record { file: "mine".into(), time_s, yaw_deg };
/// assert!((record.timing().rate_hz - 250.0).abs() < 1e-6);
/// // The device's own rate, by a spline through every sample.
/// assert_eq!(record.resampled(1000.0)?.len(), 7997);
/// # Ok::<(), yawrig_core::error::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Where it was read from, for messages.
    pub file: PathBuf,
    /// Seconds, strictly increasing, any origin.
    pub time_s: Vec<f64>,
    /// Yaw angle in degrees as the potentiometer shows it, with its constant offset.
    pub yaw_deg: Vec<f64>,
}

impl Record {
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Sampling rate and jitter.
    ///
    /// # Panics
    /// With fewer than two samples; a record that was read has more.
    pub fn timing(&self) -> Timing {
        timing::measure(&self.time_s)
    }

    /// The same record at a uniform `rate_hz`, from its first sample to its last, by a cubic spline through
    /// every sample (not-a-knot ends).
    ///
    /// The error for a sinusoid of f Hz sampled at s Hz is about 2 (f / (s - f))^4 of its amplitude: 1.2e-2 for
    /// the rig's fastest mode (4.2 Hz) at 20 Hz, where straight lines are 0.2 out, and about 1e-6 at
    /// 160 Hz. A record faster than `rate_hz` is sampled at points, as the device's converter would.
    ///
    /// # Errors
    /// For fewer than four samples.
    pub fn resampled(&self, rate_hz: f64) -> Result<Self> {
        if self.len() < 4 {
            let record = self.file.display().to_string();
            return Err(Error::TooFewSamples { record, samples: self.len() });
        }
        let (time_s, yaw_deg) = resample::uniform(&self.time_s, &self.yaw_deg, rate_hz);
        Ok(Self { file: self.file.clone(), time_s, yaw_deg })
    }
}
