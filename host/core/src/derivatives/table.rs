//! The derivative table of a campaign with its uncertainties: what is printed, as plain structs.

use super::condition::{Condition, Identified};
use crate::quantity::Quantity;
use serde::Serialize;
use std::path::PathBuf;
use yawrig_shared::axis::Axis;

/// Contributions to a standard uncertainty (k = 1), in the unit of the value; their squares add up to its square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Budget {
    /// Scatter between releases of one condition beyond their fits' uncertainties.
    pub repeatability: f64,
    pub fit: f64,
    /// Springs, arm, scatter about the line, or the given inertia's own.
    pub inertia: f64,
    pub air_density: f64,
    pub wind_speed: f64,
    /// Length, frontal area, axis offset.
    pub geometry: f64,
    /// The clock of the samples, where it says how well it is known (`rig.clock_u_ppm`).
    pub clock: f64,
}

/// The budgets of one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PointBudget {
    pub cn_beta: Budget,
    pub cn_r: Budget,
    pub cy_beta: Option<Budget>,
    pub cy_r: Option<Budget>,
}

/// The derivatives on one spring at one wind speed, per radian; `cn_*` at the middle axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    pub spring: String,
    pub wind_speed_m_s: f64,
    pub reduced_frequency: f64,
    pub cn_beta: Quantity,
    /// Combined: Cn_r - Cn_betadot.
    pub cn_r: Quantity,
    pub cy_beta: Option<Quantity>,
    pub cy_r: Option<Quantity>,
    pub cn_beta_front: Option<Quantity>,
    pub cn_r_front: Option<Quantity>,
    pub budget: PointBudget,
}

/// A value for each axis; `None` where nothing is known of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ByAxis<T> {
    pub mid: Option<T>,
    pub front: Option<T>,
}

/// The straight line of Kr against wn_off^2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InertiaLine {
    pub springs: usize,
    /// Kr at wn_off^2 = 0, N m/rad: zero where 2 Ks b^2 is all the stiffness there is. Widened for scatter.
    pub intercept_nm: Quantity,
    /// About 1 where the stated uncertainties are true; `null` for two springs.
    pub chi_squared_per_degree: Option<f64>,
}

/// By how much repeats scatter more than their fits state, where that is more than chance; else 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BirgeRatio {
    pub natural_frequency: f64,
    /// Of 2 zeta wn.
    pub damping: f64,
}

/// The mean of the releases of one spring and axis at one wind speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionRow {
    pub spring: String,
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    pub repeats: usize,
    pub natural_frequency_rad_s: Quantity,
    pub damping_ratio: Quantity,
    /// `null` for what was released once.
    pub birge_ratio: Option<BirgeRatio>,
}

impl ConditionRow {
    pub(super) fn of(condition: &Condition) -> Self {
        let (wn, damping) = (condition.natural_frequency_rad_s, condition.damping_rad_s);
        let zeta = damping.value / (2.0 * wn.value);
        let u_zeta = (damping.u() / (2.0 * wn.value)).hypot(zeta * wn.u() / wn.value);
        let repeats = condition.releases.len();
        Self {
            spring: condition.spring.clone(),
            axis: condition.axis,
            wind_speed_m_s: condition.wind_speed_m_s,
            repeats,
            natural_frequency_rad_s: Quantity::new(wn.value, wn.u()),
            damping_ratio: Quantity::new(zeta, u_zeta),
            birge_ratio: (repeats > 1).then_some(BirgeRatio {
                natural_frequency: wn.birge_ratio,
                damping: damping.birge_ratio,
            }),
        }
    }
}

/// One release with what was found in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReleaseRow {
    pub file: String,
    pub spring: String,
    pub axis: Axis,
    pub wind_speed_m_s: f64,
    #[serde(flatten)]
    pub identified: Identified,
    /// Mean squared difference between the record and the response computed from the derivatives, over what was
    /// analysed, deg2; `null` with the wind off.
    pub validation_mse_deg2: Option<f64>,
}

/// Everything `derivatives` has to say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    pub schema_version: u32,
    pub campaign: PathBuf,
    pub model: String,
    pub method: String,
    pub inertia_kg_m2: ByAxis<Quantity>,
    pub inertia_line: ByAxis<InertiaLine>,
    pub points: Vec<Point>,
    pub conditions: Vec<ConditionRow>,
    pub releases: Vec<ReleaseRow>,
    /// Entries of the campaign file left out, whose uncertainty is taken as zero.
    pub assumed_zero: Vec<String>,
    pub notes: Vec<String>,
}
