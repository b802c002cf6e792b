//! Which methods are applied to a record, and how.

use serde::{Deserialize, Serialize};

/// How records are analysed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Amplitude at which the analysis starts, deg.
    pub from_deg: f64,
    /// Amplitude at which it ends, deg.
    pub to_deg: f64,
    /// Refuse a record with fewer than three cycles between the two, which else is analysed on what there is.
    pub only_between: bool,
    /// Choices of the conventional method; the others heed none.
    pub conventional: Conventional,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            from_deg: 10.0,
            to_deg: 1.0,
            only_between: false,
            conventional: Conventional::default(),
        }
    }
}

/// How natural frequency and damping ratio are found from the free decay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// One damped mode fitted to the samples, at the information limit in white noise.
    LeastSquares,
    /// Peak of the spectrum and decay of the maxima, as the thesis has it.
    Conventional,
    /// The network that the device carries, over windows of three cycles.
    Network,
}

/// How the damped frequency is read off the spectrum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpectralPeak {
    /// The highest bin of the periodogram.
    #[default]
    Plain,
    /// A parabola through the highest of four times as many bins.
    Interpolated,
}

/// How the decay is read off the maxima.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decay {
    /// Time to half amplitude of the polynomial.
    #[default]
    HalfAmplitude,
    /// Straight line through the logarithms of all maxima.
    Regression,
}

/// Choices within the conventional method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Conventional {
    /// Where the damped frequency comes from.
    pub spectral_peak: SpectralPeak,
    /// Where the damping ratio comes from.
    pub decay: Decay,
}
