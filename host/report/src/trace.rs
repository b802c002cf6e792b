//! A record and its models as they are drawn: few enough numbers, with every extreme kept.

use crate::drawn::{decimated, times};
use serde::{Deserialize, Serialize};
use yawrig_core::fit::fitting::Fitted;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::record::Said;

/// A free decay with what models make of it. Times from the release.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// What was recorded, where that is no angle in deg.
    #[serde(default, skip_serializing_if = "Said::is_none")]
    pub said: Said,
    pub time_s: Vec<f64>,
    pub measured_deg: Vec<f64>,
    pub models: Vec<ModelTrace>,
    /// Values of which `time_s.len()` are left: the fits' means over a fiftieth of a period.
    pub of: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelTrace {
    pub name: String,
    pub yaw_deg: Vec<f64>,
    /// Measured less model.
    pub residual_deg: Vec<f64>,
}

/// Fewest values of a curve.
const MIN: usize = 200;

/// Values per curve where `numbers` are shared by `curves` of them.
pub fn values(numbers: usize, curves: usize) -> usize {
    (numbers / curves.max(1)).max(MIN)
}

/// `decay` and `models` in at most `most` values each: the whole, or the least and the largest value of each
/// of half as many stretches, in the order in which they come.
pub fn of(decay: &FreeDecay, models: &[(&str, &Fitted)], most: usize) -> Trace {
    let time_s: Vec<f64> = (0..decay.yaw_rad.len()).map(|k| decay.grid.time_s(k)).collect();
    let degrees =
        |rad: &[f64]| -> Vec<f64> { rad.iter().map(|y| decay.measurand.shown(*y)).collect() };
    let measured = degrees(&decay.yaw_rad);
    let models = models.iter().map(|(name, model)| {
        let yaw = degrees(&model.readings(&decay.grid));
        let residual: Vec<f64> = measured.iter().zip(&yaw).map(|(y, m)| y - m).collect();
        ModelTrace {
            name: (*name).to_owned(),
            yaw_deg: decimated(&yaw, most),
            residual_deg: decimated(&residual, most),
        }
    });
    Trace {
        said: decay.measurand.said(),
        models: models.collect(),
        time_s: times(&time_s, most),
        measured_deg: decimated(&measured, most),
        of: time_s.len(),
    }
}
