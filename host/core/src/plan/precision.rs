//! What one more release of a condition does to the error of a derivative.

use crate::derivatives::campaign::Campaign;
use crate::derivatives::condition::{is_same_speed, Identified};
use crate::derivatives::table::Point;
use crate::derivatives::Computed;
use crate::error::Result;
use crate::quantity::Quantity;
use serde::Serialize;
use std::path::Path;
use yawrig_shared::axis::Axis;

/// A condition released once more, and the point of the table whose error that narrows most.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Narrowed {
    /// Springs of the condition.
    pub spring: String,
    /// Axis of the condition.
    pub axis: Axis,
    /// Wind speed of the condition; 0: off.
    pub wind_speed_m_s: f64,
    /// Name of the derivative.
    pub derivative: String,
    /// Springs of the point whose error is narrowed.
    pub point_spring: String,
    /// Wind speed of the point whose error is narrowed.
    pub point_wind_speed_m_s: f64,
    /// Standard uncertainty of the derivative now, per radian.
    pub u: f64,
    /// The same after the release.
    pub u_after: f64,
}

/// One more release of each condition of `campaign`, whose releases are `identified`: its result is as far
/// from the mean of its condition as those are. Those that narrow most come first; `of` takes the derivative
/// called `name` of a point.
///
/// # Errors
/// Where there is no table.
pub fn precision(
    campaign: &Campaign,
    identified: &[Identified],
    name: &str,
    of: &dyn Fn(&Point) -> Option<Quantity>,
) -> Result<Vec<Narrowed>> {
    let points = |campaign: &Campaign, identified: &[Identified]| -> Result<Vec<Point>> {
        Ok(Computed::new(campaign, identified)?.table(Path::new(""), "").points)
    };
    let before = points(campaign, identified)?;
    let mut all: Vec<Narrowed> = Vec::new();
    for (index, release) in campaign.release.iter().enumerate() {
        let same = |k: &usize| {
            let other = &campaign.release[*k];
            other.spring == release.spring
                && other.axis == release.axis
                && is_same_speed(other.wind_speed_m_s, release.wind_speed_m_s)
        };
        let repeats: Vec<usize> = (0..identified.len()).filter(same).collect();
        if repeats[0] != index {
            continue;
        }
        let (mut campaign, mut identified) = (campaign.clone(), identified.to_vec());
        identified.push(another(&identified, &repeats));
        campaign.release.push(release.clone());
        let after = points(&campaign, &identified)?;
        let narrowed = before.iter().zip(&after).filter_map(|(a, b)| {
            let (u, u_after) = (of(a)?.u, of(b)?.u);
            (u_after < u).then(|| Narrowed {
                spring: release.spring.clone(),
                axis: release.axis,
                wind_speed_m_s: release.wind_speed_m_s,
                derivative: name.to_owned(),
                point_spring: a.spring.clone(),
                point_wind_speed_m_s: a.wind_speed_m_s,
                u,
                u_after,
            })
        });
        all.extend(narrowed.min_by(|a, b| (a.u_after / a.u).total_cmp(&(b.u_after / b.u))));
    }
    all.sort_by(|a, b| (a.u_after / a.u).total_cmp(&(b.u_after / b.u)));
    Ok(all)
}

/// A further result: one standard deviation of `repeats` off their mean, so that their scatter stays.
fn another(identified: &[Identified], repeats: &[usize]) -> Identified {
    let n = repeats.len() as f64;
    let off = |of: fn(&Identified) -> Quantity| {
        let values = || repeats.iter().map(|&k| of(&identified[k]).value);
        let mean = values().sum::<f64>() / n;
        let squares: f64 = values().map(|v| (v - mean).powi(2)).sum();
        let deviation = if n > 1.0 { (squares / (n - 1.0)).sqrt() } else { 0.0 };
        Quantity::new(mean + deviation, of(&identified[repeats[0]]).u)
    };
    Identified {
        natural_frequency_rad_s: off(|i| i.natural_frequency_rad_s),
        damping_ratio: off(|i| i.damping_ratio),
        ..identified[repeats[0]].clone()
    }
}
