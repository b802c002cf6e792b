//! The derivative table of a campaign with its uncertainties: what is printed, as plain structs.

use super::at::At;
use super::condition::{scatter, Condition, Identified, Scatter};
use super::critical::CriticalSpeed;
use super::doubt::Doubt;
use crate::quantity::Quantity;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use yawrig_shared::axis::Axis;

/// The two axes of a point may have been measured at wind speeds this far apart, relative.
pub(super) const PARTNER_SPEED: f64 = 0.05;

/// Contributions to a standard uncertainty (k = 1), in the unit of the value; their squares add up to its
/// square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Scatter between releases of one condition beyond their fits' uncertainties.
    pub repeatability: f64,
    /// The uncertainties that the identification of each record states.
    pub fit: f64,
    /// Springs, arm, scatter about the line, or the given inertia's own.
    pub inertia: f64,
    /// Of the air's density, as the campaign states it.
    pub air_density: f64,
    /// Of the wind speeds, as the releases state them.
    pub wind_speed: f64,
    /// Length, frontal area, axis offset.
    pub geometry: f64,
    /// The clock of the samples, where it says how well it is known (`rig.clock_u_ppm`).
    pub clock: f64,
}

/// The budgets of one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointBudget {
    /// What the u of [`Point::cn_beta`] is made of.
    pub cn_beta: Budget,
    /// What the u of [`Point::cn_r`] is made of.
    pub cn_r: Budget,
    /// What the u of [`Point::cy_beta`] is made of.
    pub cy_beta: Option<Budget>,
    /// What the u of [`Point::cy_r`] is made of.
    pub cy_r: Option<Budget>,
}

/// The derivatives on one spring at one wind speed, per radian; `cn_*` at the middle axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Name of the springs.
    pub spring: String,
    /// Mean wind speed of the wind-on releases.
    pub wind_speed_m_s: f64,
    /// What else it was made under.
    #[serde(skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// Damped frequency of the wind-on oscillation, made dimensionless with length and wind speed.
    pub reduced_frequency: f64,
    /// Yaw moment by yaw angle; > 0 lowers the stiffness.
    pub cn_beta: Quantity,
    /// Combined: Cn_r - Cn_betadot.
    pub cn_r: Quantity,
    /// Side force by yaw angle; `None` without releases at the front axis.
    pub cy_beta: Option<Quantity>,
    /// Side force by yaw rate; `None` without releases at the front axis.
    pub cy_r: Option<Quantity>,
    /// Yaw moment by yaw angle about the front axis, where it was released there.
    pub cn_beta_front: Option<Quantity>,
    /// Yaw moment by yaw rate about the front axis, where it was released there.
    pub cn_r_front: Option<Quantity>,
    /// What the uncertainties above are made of.
    pub budget: PointBudget,
}

/// A value for each axis; `None` where nothing is known of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ByAxis<T> {
    /// At the middle axis.
    pub mid: Option<T>,
    /// At the front axis.
    pub front: Option<T>,
}

impl<T> ByAxis<T> {
    pub(super) fn from_fn(each: impl Fn(Axis) -> Option<T>) -> Self {
        Self { mid: each(Axis::Mid), front: each(Axis::Front) }
    }
}

/// The straight line of Kr against wn_off^2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InertiaLine {
    /// Points on the line: springs released with the wind off.
    pub springs: usize,
    /// Kr at wn_off^2 = 0, N m/rad: zero where 2 Ks b^2 is all the stiffness there is. Widened for scatter.
    pub intercept_nm: Quantity,
    /// About 1 where the stated uncertainties are true; `null` for two springs.
    pub chi_squared_per_degree: Option<f64>,
}

/// By how much repeats scatter more than their fits state, where that is more than chance; else 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BirgeRatio {
    /// Of wn.
    pub natural_frequency: f64,
    /// Of 2 zeta wn.
    pub damping: f64,
}

/// A spring as the campaign states it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpringRow {
    /// Name of the springs.
    pub spring: String,
    /// u is zero where it is not stated.
    pub stiffness_n_per_m: Quantity,
}

/// Where an inertia comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum InertiaOrigin {
    /// From the campaign's file.
    Given,
    /// From Kr / wn_off^2 of the only spring: other stiffness is taken as zero.
    OneSpring,
    /// From the line through several springs.
    Line,
}

/// The mean of the releases of one spring and axis at one wind speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionRow {
    /// Name of the springs.
    pub spring: String,
    /// The axis that the model turns about.
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    /// What else it was made under.
    #[serde(skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// Releases that the mean is of.
    pub repeats: usize,
    /// Mean of the releases, u widened where they scatter by more than they state.
    pub natural_frequency_rad_s: Quantity,
    /// From the means of wn and 2 zeta wn; negative where the oscillation grows.
    pub damping_ratio: Quantity,
    /// `null` for what was released once.
    pub birge_ratio: Option<BirgeRatio>,
    /// `null` for what was released once.
    pub scatter: Option<Scatter>,
}

impl ConditionRow {
    pub(super) fn new(condition: &Condition, identified: &[Identified]) -> Self {
        let found: Vec<&Identified> =
            condition.setting.releases.iter().map(|&k| &identified[k]).collect();
        let (wn, damping) = (condition.natural_frequency_rad_s, condition.damping_rad_s);
        let zeta = damping.value / (2.0 * wn.value);
        let u_zeta = (damping.u() / (2.0 * wn.value)).hypot(zeta * wn.u() / wn.value);
        let repeats = condition.setting.releases.len();
        Self {
            spring: condition.setting.spring.clone(),
            axis: condition.setting.axis,
            wind_speed_m_s: condition.setting.wind_speed_m_s,
            at: condition.setting.at.clone(),
            repeats,
            natural_frequency_rad_s: Quantity::new(wn.value, wn.u()),
            damping_ratio: Quantity::new(zeta, u_zeta),
            birge_ratio: (repeats > 1).then_some(BirgeRatio {
                natural_frequency: wn.birge_ratio,
                damping: damping.birge_ratio,
            }),
            scatter: scatter(&found),
        }
    }
}

/// One release with what was found in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReleaseRow {
    /// As the campaign names it.
    pub file: String,
    /// Name of the springs.
    pub spring: String,
    /// The axis that the model turns about.
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    /// What else it was made under.
    #[serde(skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// Its natural frequency and damping ratio.
    #[serde(flatten)]
    pub identified: Identified,
    /// Mean squared difference between the record and the response computed from the derivatives, over what
    /// was analysed, deg2; `null` with the wind off.
    pub validation_mse_deg2: Option<f64>,
}

/// Everything `derivatives` has to say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// The layout of this table in JSON.
    pub schema_version: u32,
    /// The campaign's file.
    pub campaign: PathBuf,
    /// Name of the car model.
    pub model: String,
    /// By which natural frequency and damping ratio were found.
    pub method: String,
    /// Izz about each axis, given or from the wind-off releases.
    pub inertia_kg_m2: ByAxis<Quantity>,
    /// How each inertia is known.
    pub inertia_origin: ByAxis<InertiaOrigin>,
    /// As the campaign states them, in the order of their first release.
    pub springs: Vec<SpringRow>,
    /// The lines that the inertia was read from; `None` where it was given.
    pub inertia_line: ByAxis<InertiaLine>,
    /// The derivatives, a row for each spring and wind speed.
    pub points: Vec<Point>,
    /// The means that the derivatives are computed from.
    pub conditions: Vec<ConditionRow>,
    /// Where damping falls to zero, for each spring and axis where it does; `None` where it does nowhere.
    pub critical_speed: Option<Vec<CriticalSpeed>>,
    /// In the order of the campaign.
    pub releases: Vec<ReleaseRow>,
    /// Entries of the campaign file left out, whose uncertainty is taken as zero.
    pub assumed_zero: Vec<String>,
    /// What a reader must know besides, a sentence each.
    pub notes: Vec<String>,
    /// What could make it wrong, as [`super::plausible::doubts`] has it; empty where that was not asked.
    pub doubts: Vec<Doubt>,
}

impl Budget {
    pub(super) fn shares(&mut self) -> [&mut f64; 7] {
        let Self { repeatability, fit, inertia, air_density, wind_speed, geometry, clock } = self;
        [repeatability, fit, inertia, air_density, wind_speed, geometry, clock]
    }

    /// Each source with its contribution, the largest kinds of campaigns first.
    pub fn sources(&self) -> [(&'static str, f64); 7] {
        let Self { repeatability, fit, inertia, air_density, wind_speed, geometry, clock } = *self;
        [
            ("fit", fit),
            ("repeatability", repeatability),
            ("inertia", inertia),
            ("air density", air_density),
            ("wind speed", wind_speed),
            ("geometry", geometry),
            ("clock", clock),
        ]
    }
}

impl Table {
    /// The releases on this point's spring, with the wind off or at its speed.
    pub fn releases_of(&self, point: &Point) -> Vec<&ReleaseRow> {
        let speed = point.wind_speed_m_s;
        let is_its = |r: &&ReleaseRow| {
            let off = r.wind_speed_m_s - speed;
            let is_off = r.wind_speed_m_s == 0.0 && r.at.serves(&point.at);
            r.spring == point.spring
                && (is_off || off.abs() < PARTNER_SPEED * speed && r.at == point.at)
        };
        self.releases.iter().filter(is_its).collect()
    }

    /// Mean over this point's wind-on releases; NaN where none was validated.
    pub fn validation_mse_deg2(&self, point: &Point) -> f64 {
        let releases = self.releases_of(point).into_iter();
        let errors: Vec<f64> = releases.filter_map(|release| release.validation_mse_deg2).collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    }
}
