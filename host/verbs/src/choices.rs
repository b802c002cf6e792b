//! What the command line lets one choose from, as the libraries have it.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::ValueEnum;
use yawrig_core::identify::conventional;
use yawrig_core::record::Called;
use yawrig_model::export::{Target, What};
use yawrig_model::plan::Of;
use yawrig_records::{Quantity, TimeUnit};
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

/// What was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QuantityChoice {
    Angle,
    /// Of an angle (a gyroscope's) or of a displacement.
    Rate,
    /// Of an angle or of a displacement.
    Acceleration,
    /// Or anything in proportion to it: a strain, a voltage.
    Displacement,
}

impl From<QuantityChoice> for Quantity {
    fn from(chosen: QuantityChoice) -> Self {
        match chosen {
            QuantityChoice::Angle => Self::Angle,
            QuantityChoice::Rate => Self::Rate,
            QuantityChoice::Acceleration => Self::Acceleration,
            QuantityChoice::Displacement => Self::Displacement,
        }
    }
}

/// What the motion is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MotionChoice {
    Yaw,
    Pitch,
    Roll,
    Pendulum,
    Displacement,
}

impl From<MotionChoice> for Called {
    fn from(chosen: MotionChoice) -> Self {
        match chosen {
            MotionChoice::Yaw => Self::Yaw,
            MotionChoice::Pitch => Self::Pitch,
            MotionChoice::Roll => Self::Roll,
            MotionChoice::Pendulum => Self::Pendulum,
            MotionChoice::Displacement => Self::Displacement,
        }
    }
}

/// What a file's time is in, by the names of all units of time.
pub fn time_unit() -> impl TypedValueParser<Value = TimeUnit> {
    PossibleValuesParser::new(TimeUnit::all().map(TimeUnit::name))
        .map(|name| TimeUnit::try_from(name).expect("one of the names of all"))
}

/// The axis of this name.
pub fn axis() -> impl TypedValueParser<Value = Axis> {
    PossibleValuesParser::new(Axis::BOTH.map(Axis::name))
        .map(|name| name.parse().expect("one of the names of both"))
}

/// What a model is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportTo {
    /// A module with numpy and scipy.
    Python,
    /// A function file for MATLAB and Octave.
    Matlab,
    /// A C99 header.
    C,
    /// Model, measurement and residual, sample by sample.
    Csv,
}

impl From<ExportTo> for What {
    fn from(chosen: ExportTo) -> Self {
        match chosen {
            ExportTo::Python => Self::Code(Target::Python),
            ExportTo::Matlab => Self::Code(Target::Matlab),
            ExportTo::C => Self::Code(Target::C),
            ExportTo::Csv => Self::Table,
        }
    }
}

/// A derivative of the table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Derivative {
    CnBeta,
    #[default]
    CnR,
    CyBeta,
    CyR,
}

impl Derivative {
    /// Its name, and where it is in a point.
    pub fn of(self) -> (&'static str, Of) {
        match self {
            Self::CnBeta => ("cn_beta", |point| Some(point.cn_beta)),
            Self::CnR => ("cn_r", |point| Some(point.cn_r)),
            Self::CyBeta => ("cy_beta", |point| point.cy_beta),
            Self::CyR => ("cy_r", |point| point.cy_r),
        }
    }
}
