//! What a campaign's records were made under.
//!
//! Every `..._u_...` entry is the standard uncertainty of the entry it is named after, in its unit; left out,
//! it is taken as zero and said to be.

use crate::plan::Can;
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
    pub schema_version: u32,
    pub model: ModelEntry,
    pub air: AirEntry,
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
    #[serde(default)]
    pub release: Vec<ReleaseEntry>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelEntry {
    pub name: String,
    pub length_m: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_u_m: Option<f64>,
    pub frontal_area_m2: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frontal_area_u_m2: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirEntry {
    pub density_kg_m3: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_u_kg_m3: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigEntry {
    /// Distance of each spring from the axis of rotation.
    pub spring_arm_m: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring_arm_u_m: Option<f64>,
    /// How far the front axis lies ahead of the middle one.
    pub axis_offset_m: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis_offset_u_m: Option<f64>,
    /// Relative standard uncertainty of the clock that the records were sampled by, millionths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_u_ppm: Option<f64>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InertiaEntry {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mid_kg_m2: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mid_u_kg_m2: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front_kg_m2: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front_u_kg_m2: Option<f64>,
}

/// One release; several of one condition are repeats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReleaseEntry {
    /// Relative to the campaign's own file.
    pub file: String,
    pub spring: String,
    /// Not a number where only [`Campaign::stiffness_n_per_m`] says it.
    #[serde(default = "not_said")]
    pub spring_stiffness_n_per_m: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring_stiffness_u_n_per_m: Option<f64>,
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind_speed_u_m_s: Option<f64>,
}
