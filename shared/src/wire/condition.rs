//! What the host says of releases: how the sensor is seen, and what they are made under.

use crate::checksum::crc32_of;
use crate::derivatives::{Model, Wind};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Highest count of the boards' converters: the sum of sixteen readings of 12 bits.
pub const FULL_SCALE_COUNTS: u16 = 16 * 4095;

/// How the device sees the potentiometer and what it analyses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    pub degrees_per_count: f32,
    /// Counts at zero degrees.
    pub zero_counts: u16,
    /// Highest count the converter gives.
    pub full_scale_counts: u16,
    /// Windows begin below this amplitude and end above the other.
    pub from_deg: f32,
    pub to_deg: f32,
    /// Relative standard uncertainty of the sampling clock, millionths; none: the board's own.
    pub clock_u_ppm: Option<f32>,
}

impl Default for Settings {
    /// The boards' converter with 0.005 deg a count, analysed from 10 to 1 deg.
    fn default() -> Self {
        Self {
            degrees_per_count: 0.005,
            zero_counts: 32768,
            full_scale_counts: FULL_SCALE_COUNTS,
            from_deg: 10.0,
            to_deg: 1.0,
            clock_u_ppm: None,
        }
    }
}

/// What a release is made under, so that the device can give derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Condition {
    /// Which spring and axis ([`rig_id`]): a wind-off release is a reference for those of the same rig and
    /// model alone.
    pub rig: u32,
    /// Wind off: its result becomes the reference of the releases after it.
    pub wind: Wind,
    pub model: Model,
    /// Moment of inertia about the yaw axis; zero: the device gives no derivatives.
    pub inertia_kg_m2: f64,
}

/// A number for a spring and an axis, by their names.
pub fn rig_id(spring: &str, axis: &str) -> u32 {
    crc32_of(&[spring.as_bytes(), &[0], axis.as_bytes()])
}

/// The quantity of a [`Condition`] that is no number, negative, or beyond what any tunnel and model have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ConditionFault {
    /// Outside 0.01 to 100 kg/m3.
    Density,
    /// Outside 0 to 340 m/s.
    WindSpeed,
    /// Outside 0.01 to 20 m.
    Length,
    /// Outside 1e-5 to 100 m2.
    FrontalArea,
    /// Neither zero nor 1e-8 to 1e5 kg m2.
    Inertia,
}

impl Condition {
    /// Whether it can be.
    ///
    /// # Errors
    /// The first quantity that cannot.
    pub fn check(&self) -> Result<(), ConditionFault> {
        let Self { wind, model, inertia_kg_m2, .. } = self;
        // None of these holds for what is no number.
        let faults = [
            ((0.01..=100.0).contains(&wind.density_kg_m3), ConditionFault::Density),
            ((0.0..=340.0).contains(&wind.speed_m_s), ConditionFault::WindSpeed),
            ((0.01..=20.0).contains(&model.length_m), ConditionFault::Length),
            ((1e-5..=100.0).contains(&model.frontal_area_m2), ConditionFault::FrontalArea),
            (
                *inertia_kg_m2 == 0.0 || (1e-8..=1e5).contains(inertia_kg_m2),
                ConditionFault::Inertia,
            ),
        ];
        faults.into_iter().find(|(can_be, _)| !can_be).map_or(Ok(()), |(_, fault)| Err(fault))
    }
}
