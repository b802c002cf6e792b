//! Yaw angle, or what else was recorded of the motion, over time as it comes from a file, at whatever rate
//! and with whatever jitter.

pub mod faults;
mod measurand;
pub(crate) mod resample;
mod timing;

pub use measurand::{Called, Derivative, Measurand, Said};
pub use timing::Timing;

use crate::error::{Error, Result};
use crate::statistics::sample_noise;
use std::path::PathBuf;

/// Samples of another rate for each of the record's own, at most: a record of 20 Hz at the device's 1 kHz.
const MAX_BETWEEN: f64 = 50.0;
/// A record is resampled to at most so many times the samples that its rate would make of those it has, and
/// so many more.
const MAX_FILLED: f64 = 20.0;
const ALWAYS_FILLED: f64 = 1e5;

/// Share of a record's runs of one value that are whole numbers of a sensor's sample, where all of it was read so
/// often; of a coarse reading they have any length.
const MAX_ALIKE: f64 = 0.9;

/// Whether all `records` hold the same quantity in the same unit.
///
/// # Errors
/// [`Error::OtherMeasurand`] naming the first that does not.
pub fn same_measurand<'a>(records: impl IntoIterator<Item = &'a Record>) -> Result<()> {
    let mut records = records.into_iter();
    let Some(first) = records.next() else { return Ok(()) };
    match records.find(|record| record.measurand != first.measurand) {
        None => Ok(()),
        Some(other) => Err(Error::OtherMeasurand {
            record: other.file.display().to_string(),
            quantity: other.measurand.quantity().to_owned(),
            unit: other.measurand.unit().to_owned(),
            first: first.file.display().to_string(),
        }),
    }
}

/// One recorded release.
///
/// ```
/// use yawrig_core::record::Record;
///
/// let time_s: Vec<f64> = (0..2000).map(|k| f64::from(k) / 250.0).collect();
/// let yaw_deg = time_s.iter().map(|t| 9.0 * (-0.1 * t).exp() * (6.0 * t).cos()).collect();
/// let record = Record::new("mine", time_s, yaw_deg);
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
    /// Yaw angle in degrees as the potentiometer shows it, with its constant offset; of another quantity in
    /// the unit of [`Self::measurand`].
    pub yaw_deg: Vec<f64>,
    /// What these numbers are.
    pub measurand: Measurand,
    /// Whether its time stamps came in bursts, several samples under one, and were spread evenly by the
    /// samples' number.
    pub stamps_spread: bool,
    /// Standard uncertainty of its rate, as a share of it: of time stamps coarser than the clock behind them.
    pub rate_u: f64,
}

impl Record {
    /// Its file, as it was named.
    pub fn name(&self) -> String {
        self.file.display().to_string()
    }

    /// A record of these samples, each at its own time.
    pub fn new(file: impl Into<PathBuf>, time_s: Vec<f64>, yaw_deg: Vec<f64>) -> Self {
        Self {
            file: file.into(),
            time_s,
            yaw_deg,
            measurand: Measurand::default(),
            stamps_spread: false,
            rate_u: 0.0,
        }
    }

    /// Other samples of the same file.
    pub(crate) fn with(&self, time_s: Vec<f64>, yaw_deg: Vec<f64>) -> Self {
        Self {
            file: self.file.clone(),
            time_s,
            yaw_deg,
            measurand: self.measurand.clone(),
            stamps_spread: self.stamps_spread,
            rate_u: self.rate_u,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is no sample.
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

    /// How many samples each value stands for, where most stand for several of them in a row.
    pub fn repeats(&self) -> Option<usize> {
        let runs: Vec<usize> = self.yaw_deg.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
        // At the ends a run is cut.
        let inner = runs.get(1..runs.len().checked_sub(1)?)?;
        let mut sorted = inner.to_vec();
        let times =
            *sorted.get_mut(..).filter(|s| !s.is_empty())?.select_nth_unstable(inner.len() / 2).1;
        let alike = inner.iter().filter(|run| **run % times == 0).count();
        (times > 1 && alike as f64 > MAX_ALIKE * inner.len() as f64).then_some(times)
    }

    /// Standard deviation of white sample noise, in the record's unit, from the median of third differences;
    /// 0 for fewer than four samples. At a few tens of samples a cycle it is an upper bound.
    pub fn noise_rms_deg(&self) -> f64 {
        sample_noise(&self.yaw_deg)
    }

    /// Whether the record can be resampled at `rate_hz`.
    ///
    /// # Errors
    /// As [`Self::resampled`].
    pub fn check_resampling(&self, rate_hz: f64) -> Result<()> {
        let record = || self.file.display().to_string();
        if self.len() < 4 {
            return Err(Error::TooFewSamples { record: record(), samples: self.len() });
        }
        let own_hz = self.timing().rate_hz;
        let least_hz = rate_hz / MAX_BETWEEN;
        if own_hz < least_hz {
            return Err(Error::TooSlow { record: record(), rate_hz: own_hz, least_hz });
        }
        let span_s = self.time_s[self.len() - 1] - self.time_s[0];
        let expected = self.len() as f64 * rate_hz / own_hz;
        if span_s * rate_hz > MAX_FILLED * expected + ALWAYS_FILLED {
            return Err(Error::Gaps { record: record(), samples: self.len(), span_s });
        }
        Ok(())
    }

    /// The same record at a uniform `rate_hz`, from its first sample to its last, by a cubic spline through
    /// every sample (not-a-knot ends).
    ///
    /// The error for a sinusoid of f Hz sampled at s Hz is about 2 (f / (s - f))^4 of its amplitude: 1.2e-2
    /// for the rig's fastest mode (4.2 Hz) at 20 Hz, where straight lines are 0.2 out, and about 1e-6 at 160
    /// Hz. A record faster than `rate_hz` is sampled at points, as the device's converter would.
    ///
    /// # Errors
    /// For fewer than four samples, where fifty and more would stand for each of its own, and for gaps that
    /// are most of the record.
    pub fn resampled(&self, rate_hz: f64) -> Result<Self> {
        self.check_resampling(rate_hz)?;
        let (time_s, yaw_deg) = resample::uniform(&self.time_s, &self.yaw_deg, rate_hz);
        Ok(self.with(time_s, yaw_deg))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_stands_for_several_samples_where_all_do() {
        let of = |value: fn(usize) -> f64| {
            Record::new("r", (0..400).map(|k| k as f64).collect(), (0..400).map(value).collect())
        };
        assert_eq!(of(|k| ((k / 4) as f64 * 0.7).sin()).repeats(), Some(4));
        // A coarse reading has any number of each.
        assert_eq!(of(|k| (8.0 * (k as f64 * 0.05).sin()).round()).repeats(), None);
        assert_eq!(of(|k| (k as f64 * 0.7).sin()).repeats(), None);
        assert_eq!(of(|_| 1.0).repeats(), None);
    }
}
