//! What a campaign's records were made under.
//!
//! Every `..._u_...` entry is the standard uncertainty of the entry it is named after, in its unit; left out,
//! it is taken as zero and said to be.

use super::at::At;
use super::doubt::Kind;
use crate::plan::Can;
use crate::record::Called;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use yawrig_shared::axis::Axis;

/// The version of the file's layout.
pub const SCHEMA_VERSION: u32 = 1;

fn not_said() -> f64 {
    f64::NAN
}

/// A whole campaign as it stands in the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// [`SCHEMA_VERSION`], or the file is of another layout.
    pub schema_version: u32,
    /// The car model.
    pub model: ModelEntry,
    /// The air of the wind tunnel.
    pub air: AirEntry,
    /// The rig's geometry and its clock.
    pub rig: RigEntry,
    /// Known moments of inertia; without one it comes from the wind-off releases of that axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<InertiaEntry>,
    /// What the rig can do besides, for the plan of further releases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub can: Option<Can>,
    /// Of each spring by its name, for releases that do not say it themselves, N/m.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub stiffness_n_per_m: BTreeMap<String, f64>,
    /// Doubts about any of it that were looked into and are not said any more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accept: Vec<Kind>,
    /// What the motion is called in tables, plots and reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Called>,
    /// The releases, wind off and on, in the order of the file.
    #[serde(default)]
    pub release: Vec<ReleaseEntry>,
}

/// The car model's sizes, which make moments and forces dimensionless.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelEntry {
    /// As the table of derivatives prints it.
    pub name: String,
    /// Reference length of the moments and of the reduced frequency.
    pub length_m: f64,
    /// Standard uncertainty of `length_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_u_m: Option<f64>,
    /// Reference area.
    pub frontal_area_m2: f64,
    /// Standard uncertainty of `frontal_area_m2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frontal_area_u_m2: Option<f64>,
}

/// The air that the model is released in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirEntry {
    /// At the time of the wind-on releases.
    pub density_kg_m3: f64,
    /// Standard uncertainty of `density_kg_m3`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_u_kg_m3: Option<f64>,
}

/// Lengths of the rig, and how well its clock is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigEntry {
    /// Distance of each spring from the axis of rotation.
    pub spring_arm_m: f64,
    /// Standard uncertainty of `spring_arm_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring_arm_u_m: Option<f64>,
    /// How far the front axis lies ahead of the middle one.
    pub axis_offset_m: f64,
    /// Standard uncertainty of `axis_offset_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis_offset_u_m: Option<f64>,
    /// Relative standard uncertainty of the clock that the records were sampled by, millionths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_u_ppm: Option<f64>,
}

/// Moments of inertia about the two axes of rotation, where they are known beforehand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InertiaEntry {
    /// Izz about the middle axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mid_kg_m2: Option<f64>,
    /// Standard uncertainty of `mid_kg_m2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mid_u_kg_m2: Option<f64>,
    /// Izz about the front axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front_kg_m2: Option<f64>,
    /// Standard uncertainty of `front_kg_m2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front_u_kg_m2: Option<f64>,
}

/// One release; several of one condition are repeats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReleaseEntry {
    /// Relative to the campaign's own file.
    pub file: String,
    /// Name of the springs: releases on springs of one name share their stiffness.
    pub spring: String,
    /// Not a number where only [`Campaign::stiffness_n_per_m`] says it.
    #[serde(default = "not_said")]
    pub spring_stiffness_n_per_m: f64,
    /// Standard uncertainty of `spring_stiffness_n_per_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring_stiffness_u_n_per_m: Option<f64>,
    /// The axis that the model turns about.
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    /// Standard uncertainty of `wind_speed_m_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind_speed_u_m_s: Option<f64>,
    /// Density of the air in this release, where it is not [`AirEntry::density_kg_m3`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_kg_m3: Option<f64>,
    /// What else it was made under, by name (`ride_height_mm`, `wing`); empty with the wind off where the reference
    /// serves every setting.
    #[serde(default, skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// Doubts about it that were looked into and are not said any more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accept: Vec<Kind>,
}
