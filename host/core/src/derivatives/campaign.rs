//! What a campaign's records were made under.
//!
//! Every `..._u_...` entry is the standard uncertainty of the entry it is named after, in its unit; left out,
//! it is taken as zero and said to be.

use super::at::At;
use super::can::Can;
use super::doubt::Kind;
use crate::quantity::Quantity;
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
    /// At the time of the wind-on releases. Not a number where it follows from temperature and pressure.
    #[serde(default = "not_said")]
    pub density_kg_m3: f64,
    /// Standard uncertainty of `density_kg_m3`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_u_kg_m3: Option<f64>,
    /// In place of the density, with `pressure_pa`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_deg_c: Option<f64>,
    /// Absolute, not reduced to sea level; in place of the density, with `temperature_deg_c`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure_pa: Option<f64>,
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
    /// 0: wind off. Not a number where it follows from `dynamic_pressure_pa`.
    #[serde(default = "not_said")]
    pub wind_speed_m_s: f64,
    /// Standard uncertainty of `wind_speed_m_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind_speed_u_m_s: Option<f64>,
    /// In place of the wind's speed: what the tunnel's Pitot tube shows, half density times speed squared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dynamic_pressure_pa: Option<f64>,
    /// Density of the air in this release, where it is not [`AirEntry::density_kg_m3`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_kg_m3: Option<f64>,
    /// In place of the density, with `pressure_pa` here or in [`AirEntry`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_deg_c: Option<f64>,
    /// Absolute; in place of the density, with `temperature_deg_c` here or in [`AirEntry`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure_pa: Option<f64>,
    /// What else it was made under, by name (`ride_height_mm`, `wing`); empty with the wind off where the
    /// reference serves every setting.
    #[serde(default, skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// Doubts about it that were looked into and are not said any more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accept: Vec<Kind>,
}

/// Density of dry air, kg/m3, as an ideal gas; moist air is lighter, by 1 % at 30 deg C and 60 %.
fn dry_air_density_kg_m3(temperature_deg_c: f64, pressure_pa: f64) -> f64 {
    const GAS_CONSTANT_J_KG_K: f64 = 287.05;
    pressure_pa / (GAS_CONSTANT_J_KG_K * (temperature_deg_c + 273.15))
}

impl ModelEntry {
    /// A model of these sizes, their uncertainties not stated.
    pub fn new(name: &str, length_m: f64, frontal_area_m2: f64) -> Self {
        let name = name.to_owned();
        Self { name, length_m, length_u_m: None, frontal_area_m2, frontal_area_u_m2: None }
    }
}

impl RigEntry {
    /// A rig of these lengths, their uncertainties and its clock's not stated.
    pub fn new(spring_arm_m: f64, axis_offset_m: f64) -> Self {
        Self {
            spring_arm_m,
            spring_arm_u_m: None,
            axis_offset_m,
            axis_offset_u_m: None,
            clock_u_ppm: None,
        }
    }
}

impl AirEntry {
    /// Air of this density, its uncertainty not stated.
    pub fn new(density_kg_m3: f64) -> Self {
        Self { density_kg_m3, density_u_kg_m3: None, temperature_deg_c: None, pressure_pa: None }
    }
}

impl ReleaseEntry {
    /// A release on `spring`, wind off at 0 m/s, with nothing else stated.
    pub fn new(
        file: &str,
        (spring, spring_stiffness_n_per_m): (&str, f64),
        axis: Axis,
        wind_speed_m_s: f64,
    ) -> Self {
        Self {
            file: file.to_owned(),
            spring: spring.to_owned(),
            spring_stiffness_n_per_m,
            spring_stiffness_u_n_per_m: None,
            axis,
            wind_speed_m_s,
            wind_speed_u_m_s: None,
            dynamic_pressure_pa: None,
            density_kg_m3: None,
            temperature_deg_c: None,
            pressure_pa: None,
            at: At::default(),
            accept: Vec::new(),
        }
    }
}

impl Campaign {
    /// These releases, with nothing else stated.
    pub fn new(
        model: ModelEntry,
        air: AirEntry,
        rig: RigEntry,
        release: Vec<ReleaseEntry>,
    ) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            model,
            air,
            rig,
            inertia: None,
            can: None,
            stiffness_n_per_m: BTreeMap::new(),
            accept: Vec::new(),
            motion: None,
            release,
        }
    }

    /// Izz about each axis, in the order of [`Axis::BOTH`], and its standard uncertainty, where given.
    pub(crate) fn known_inertia(&self) -> [(Option<f64>, Option<f64>); 2] {
        let known = self.inertia.clone().unwrap_or_default();
        [(known.mid_kg_m2, known.mid_u_kg_m2), (known.front_kg_m2, known.front_u_kg_m2)]
    }

    /// Stiffness of a spring as its first release states it, N/m; u is zero where it is not stated.
    pub(crate) fn stiffness_of(&self, spring: &str) -> Quantity {
        let first = self.release.iter().find(|release| release.spring == spring);
        first.map_or(Quantity::exact(f64::NAN), |release| {
            let u = release.spring_stiffness_u_n_per_m.unwrap_or(0.0);
            Quantity::new(release.spring_stiffness_n_per_m, u)
        })
    }

    /// Density of the air in a release.
    pub fn density_kg_m3(&self, release: &ReleaseEntry) -> f64 {
        release.density_kg_m3.unwrap_or(self.air.density_kg_m3)
    }

    /// What a wind-on release at `spring` and `axis` is held against: the settings of its wind-off reference.
    pub fn reference_of(&self, release: &ReleaseEntry) -> Option<&At> {
        let is_its = |off: &&ReleaseEntry| {
            (&off.spring, off.axis, off.wind_speed_m_s) == (&release.spring, release.axis, 0.0)
        };
        let offs = self.release.iter().filter(is_its);
        release.at.reference(offs.map(|off| (&off.at, &off.at)))
    }

    /// Fills in what is stated in another way: the stiffness by the spring's name, the density by temperature
    /// and pressure, the wind's speed by its dynamic pressure. What is not stated at all stays not a number.
    ///
    /// # Errors
    /// The release, none for the head, and the entry that is said in two ways or wants another one.
    pub fn fill_in(&mut self) -> Result<(), (Option<usize>, String)> {
        let density = |temperature: Option<f64>, pressure: Option<f64>| {
            Some(dry_air_density_kg_m3(temperature?, pressure?))
        };
        let both = |entry: &str, other: &str| format!("{entry} is stated and {other}, too");
        let air = &mut self.air;
        let (temperature, pressure) = (air.temperature_deg_c.take(), air.pressure_pa.take());
        if let Some(density) = density(temperature, pressure) {
            if !self.air.density_kg_m3.is_nan() {
                return Err((None, both("air.density_kg_m3", "temperature_deg_c, pressure_pa")));
            }
            self.air.density_kg_m3 = density;
        }
        for (index, entry) in self.release.iter_mut().enumerate() {
            let fault = |what: String| (Some(index), what);
            if entry.spring_stiffness_n_per_m.is_nan() {
                let of_spring = self.stiffness_n_per_m.get(&entry.spring);
                entry.spring_stiffness_n_per_m = of_spring.copied().unwrap_or(f64::NAN);
            }
            let own = [entry.temperature_deg_c.take(), entry.pressure_pa.take()];
            if own.iter().any(Option::is_some) {
                if entry.density_kg_m3.is_some() {
                    return Err(fault(both("density_kg_m3", "temperature_deg_c or pressure_pa")));
                }
                let its = density(own[0].or(temperature), own[1].or(pressure));
                let wanting = "temperature_deg_c and pressure_pa are both needed, here or in [air]";
                entry.density_kg_m3 = Some(its.ok_or_else(|| fault(wanting.to_owned()))?);
            }
            if let Some(pressure) = entry.dynamic_pressure_pa.take() {
                if !entry.wind_speed_m_s.is_nan() {
                    return Err(fault(both("wind_speed_m_s", "dynamic_pressure_pa")));
                }
                let density = entry.density_kg_m3.unwrap_or(self.air.density_kg_m3);
                entry.wind_speed_m_s = (2.0 * pressure / density).sqrt();
            }
        }
        Ok(())
    }
}
