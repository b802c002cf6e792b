//! What a rig can do, as a campaign's or a model's file says it.

use serde::{Deserialize, Serialize};
use yawrig_shared::axis::Axis;

/// What the rig can do, where that is not what it has done; an empty list leaves open what it is about.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Can {
    /// Amplitudes from which the model can be released.
    pub amplitudes_deg: Vec<f64>,
    /// Lengths of the records that it can make.
    pub seconds: Vec<f64>,
    /// With other springs, where a model is not of a campaign.
    pub natural_frequencies_rad_s: Vec<f64>,
    /// Names of the springs it can have, among those of the records there are.
    pub springs: Vec<String>,
    /// Wind speeds it can have; 0: wind off.
    pub wind_speeds_m_s: Vec<f64>,
    /// Axes about which the model can turn.
    pub axes: Vec<Axis>,
}
