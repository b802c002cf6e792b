//! The tables of `model.toml` as they stand in it, before anything is checked.

use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;
use yawrig_core::derivatives::can::Can;
use yawrig_core::effects::{Knots, Line, SourceKind};
use yawrig_core::record::Said;
use yawrig_records::Selection;
use yawrig_shared::axis::Axis;

#[derive(Deserialize)]
pub(super) struct Version {
    pub(super) schema_version: Spanned<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawModel {
    #[serde(rename = "schema_version")]
    _schema_version: u32,
    #[serde(default)]
    pub(super) unknown_zero: bool,
    #[serde(default)]
    pub(super) recorded: Said,
    #[serde(default)]
    pub(super) record: Vec<Spanned<RawRecord>>,
    #[serde(default)]
    pub(super) modal: BTreeMap<Spanned<String>, RawModal>,
    #[serde(default)]
    pub(super) effect: Vec<RawEffect>,
    /// Read where further releases are planned.
    #[serde(default, rename = "can")]
    _can: Option<Can>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRecord {
    pub(super) file: Spanned<String>,
    pub(super) condition: Option<String>,
    #[serde(default)]
    pub(super) reading: Selection,
    #[serde(default)]
    pub(super) held_out: bool,
    pub(super) spring: Option<String>,
    pub(super) axis: Option<Axis>,
    pub(super) wind_speed_m_s: Option<f64>,
    pub(super) crc32: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawModal {
    pub(super) natural_frequency_rad_s: Option<Spanned<RawParameter>>,
    pub(super) damping_ratio: Option<Spanned<RawParameter>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawEffect {
    pub(super) id: Spanned<String>,
    pub(super) definition: Option<Spanned<String>>,
    pub(super) law: Option<Spanned<RawLaw>>,
    #[serde(default)]
    pub(super) source: SourceKind,
    /// Of which an aerodynamic coefficient is.
    pub(super) reference_wind_m_s: Option<Spanned<f64>>,
    /// Of which each has a coefficient.
    pub(super) wind_speeds_m_s: Option<Spanned<Vec<f64>>>,
    #[serde(default)]
    pub(super) parameters: BTreeMap<Spanned<String>, Spanned<RawParameter>>,
}

/// A measured law: how far it is known, and the weight of each curve's roughness.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLaw {
    pub(super) yaw_deg: f64,
    pub(super) rate_deg_s: f64,
    #[serde(default)]
    pub(super) friction: bool,
    #[serde(default)]
    pub(super) dissipative: bool,
    pub(super) stiffness: Option<RawCurve>,
    pub(super) uneven_stiffness: Option<RawCurve>,
    pub(super) damping: Option<RawCurve>,
    pub(super) uneven_damping: Option<RawCurve>,
    pub(super) damping_line: Option<Line>,
}

/// Older files hold its weight alone.
#[derive(Clone, Copy, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "weight and knots; a law of an older file is to be measured again: delete its [[effect]], then yawrig add measured_law"
)]
pub(super) struct RawCurve {
    pub(super) weight: f64,
    pub(super) knots: Knots,
}

#[derive(Clone, Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RawParameter {
    pub(super) value: Option<f64>,
    pub(super) u: Option<f64>,
    pub(super) unit: Option<String>,
    pub(super) min: Option<f64>,
    pub(super) max: Option<f64>,
    pub(super) free: Option<bool>,
}
