//! A window as the network's inputs: forty-one numbers, or forty-two with its amplitude.

use crate::history::{History, View};
use crate::window::{Window, SAMPLE_RATE_HZ};
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Points or bins that describe the shape of a window.
pub const SHAPE: usize = 40;
/// The shape and the reciprocal of the window's duration.
pub const FEATURES: usize = SHAPE + 1;
/// Most inputs of a network: the features and the amplitude.
pub const MAX_INPUTS: usize = FEATURES + 1;

/// What a network is given, as many numbers as its topology says first.
pub type Inputs = Vec<f32, MAX_INPUTS>;

/// How the shape of the window is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum FeatureKind {
    /// Means over forty equal bins, divided by their root mean square: all samples count, so
    /// noise of 2 % of the peak leaves 2 % in the damping ratio where points leave 9 %.
    BinMeans,
    /// The thesis's forty point samples, divided by the largest of them (4.5.3).
    PointSamples,
}

/// Maps that bring the features to about -1 to 1.
///
/// One factor for all forty shape features: a map for each column, as is usual, fits the
/// training set's accidents.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct InputScaling {
    pub shape_gain: f32,
    /// Reciprocal duration that maps to zero, 1/s.
    pub reciprocal_offset_hz: f32,
    /// Gain on the reciprocal duration less its offset, s.
    pub reciprocal_gain_s: f32,
    /// The amplitude as one more input; none: the network does without.
    pub amplitude: Option<AmplitudeScaling>,
}

/// The window's amplitude, which its features have lost, as an input: `gain (ln(amplitude / deg) - offset)`.
/// Where natural frequency and damping change with amplitude, only the amplitude says which they belong to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct AmplitudeScaling {
    pub log_offset: f32,
    pub log_gain: f32,
}

/// Least amplitude that has a logarithm here, degrees.
const MIN_AMPLITUDE_DEG: f32 = 1e-3;

impl AmplitudeScaling {
    /// Brings these amplitudes, degrees, to -1 and 1.
    pub fn between(low_deg: f32, high_deg: f32) -> Self {
        let log = |deg: f32| libm::logf(deg.max(MIN_AMPLITUDE_DEG));
        let (low, high) = (log(low_deg), log(high_deg));
        Self { log_offset: 0.5 * (low + high), log_gain: 2.0 / (high - low).max(f32::MIN_POSITIVE) }
    }

    fn apply(&self, amplitude_deg: f32) -> f32 {
        (libm::logf(amplitude_deg.max(MIN_AMPLITUDE_DEG)) - self.log_offset) * self.log_gain
    }
}

/// Features of a window, and the amplitude they were divided by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// Shape above the mid-line, its first half cycle positive, then the reciprocal duration;
    /// unscaled.
    pub values: [f32; FEATURES],
    /// Amplitude of the sinusoid with the window's root mean square, degrees.
    pub amplitude_deg: f32,
}

/// Features of a window that [`crate::window::Tracker`] has closed; not yet scaled.
#[inline]
pub fn features<S: Copy + Default + Into<f32>, const N: usize, const B: usize>(
    kind: FeatureKind,
    history: &History<S, N, B>,
    window: &Window,
) -> Features {
    of_view(kind, history.view(), window)
}

#[inline(never)]
fn of_view<S: Copy + Default + Into<f32>>(
    kind: FeatureKind,
    history: View<'_, S>,
    window: &Window,
) -> Features {
    let sign = if window.rising { 1.0 } else { -1.0 };
    let mut values = [0.0_f32; FEATURES];
    let mut square = 0.0;
    let mut peak = 0.0_f32;
    let mut from = window.start;
    for (i, value) in values[..SHAPE].iter_mut().enumerate() {
        let to = window.moment((i + 1) as f32 / SHAPE as f32);
        let yaw_deg = match kind {
            FeatureKind::BinMeans => history.mean(from, to),
            FeatureKind::PointSamples => history.at(from),
        };
        from = to;
        *value = sign * (yaw_deg - window.midline_deg);
        square += *value * *value;
        peak = peak.max(value.abs());
    }
    let rms = libm::sqrtf(square / SHAPE as f32);
    let unit = match kind {
        FeatureKind::BinMeans => rms,
        FeatureKind::PointSamples => peak,
    };
    if unit > 0.0 {
        for value in &mut values[..SHAPE] {
            *value /= unit;
        }
    }
    values[SHAPE] = SAMPLE_RATE_HZ / window.length;
    Features { values, amplitude_deg: rms * core::f32::consts::SQRT_2 }
}

impl InputScaling {
    /// Numbers [`InputScaling::apply`] makes of a window.
    pub fn count(&self) -> usize {
        FEATURES + usize::from(self.amplitude.is_some())
    }

    /// What the network is given.
    pub fn apply(&self, features: &Features) -> Inputs {
        let mut inputs: Inputs = features.values.into_iter().collect();
        for value in &mut inputs[..SHAPE] {
            *value *= self.shape_gain;
        }
        inputs[SHAPE] = (inputs[SHAPE] - self.reciprocal_offset_hz) * self.reciprocal_gain_s;
        inputs.extend(self.amplitude.map(|scaling| scaling.apply(features.amplitude_deg)));
        inputs
    }
}
