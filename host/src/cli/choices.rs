//! What the command line lets one choose from, as the libraries have it.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::ValueEnum;
use yawrig_core::identify::conventional;
use yawrig_records::Unit;
use yawrig_shared::axis::Axis;

/// How the damped frequency is read off the spectrum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SpectralPeak {
    /// The highest bin of the periodogram.
    #[default]
    Plain,
    /// A parabola through the highest of four times as many bins.
    Interpolated,
}

impl From<SpectralPeak> for conventional::SpectralPeak {
    fn from(chosen: SpectralPeak) -> Self {
        match chosen {
            SpectralPeak::Plain => Self::Plain,
            SpectralPeak::Interpolated => Self::Interpolated,
        }
    }
}

/// How the decay is read off the maxima.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Decay {
    /// Time to half amplitude of the polynomial.
    #[default]
    HalfAmplitude,
    /// Straight line through the logarithms of all maxima.
    Regression,
}

impl From<Decay> for conventional::Decay {
    fn from(chosen: Decay) -> Self {
        match chosen {
            Decay::HalfAmplitude => Self::HalfAmplitude,
            Decay::Regression => Self::Regression,
        }
    }
}

/// What a file's yaw angle is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum YawUnit {
    Deg,
    Rad,
}

impl From<YawUnit> for Unit {
    fn from(chosen: YawUnit) -> Self {
        match chosen {
            YawUnit::Deg => Self::Deg,
            YawUnit::Rad => Self::Rad,
        }
    }
}

/// The axis of this name.
pub fn axis() -> impl TypedValueParser<Value = Axis> {
    PossibleValuesParser::new(Axis::BOTH.map(Axis::name))
        .map(|name| name.parse().expect("one of the names of both"))
}
