//! Where the strength of a model's effect comes from: the rig, the air, or another one at each wind speed.

use crate::document::Model;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::derivatives::condition::is_same_speed;
use yawrig_core::effects::{Effect, Source, SourceKind};

impl Model {
    /// The wind speeds of the records that are fitted, rising, each once; 0: off. Records that no campaign
    /// tells of have none.
    pub fn wind_speeds(&self) -> Vec<f64> {
        let made =
            self.records.iter().filter(|r| !r.held_out).filter_map(|r| r.made_under.as_ref());
        let mut speeds: Vec<f64> = made.map(|made| made.wind_speed_m_s).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup_by(|a, b| is_same_speed(*a, *b));
        speeds
    }
}

/// `effect` from the source asked for, in a model whose records have these wind speeds: the coefficient of
/// one that the air makes is that at the lowest of them with the wind on.
///
/// # Errors
/// Exit 2 where the air cannot make it, or the records do not say so much of the wind.
pub fn sourced(effect: &Effect, asked: SourceKind, speeds_m_s: &[f64]) -> Result<Effect> {
    let on = speeds_m_s.iter().copied().find(|speed| *speed > 0.0);
    let lacking = |what: &str| {
        let why = format!("{effect} with {}: {what}", settings::name(asked.name()));
        Error::usage(why).help(format!(
            "make the model of a campaign, which says the wind of each release: {}",
            settings::command("fit", &["campaign.toml"], &[])
        ))
    };
    let source = match (asked, on) {
        (SourceKind::Mechanical, _) => Source::Mechanical,
        (_, None) => return Err(lacking("no record of the model is known to have the wind on")),
        (SourceKind::Aerodynamic, Some(reference_m_s)) => Source::Aerodynamic { reference_m_s },
        (SourceKind::EachWind, Some(_)) if speeds_m_s.len() < 2 => {
            return Err(lacking("all records of the model have one wind speed"))
        }
        (SourceKind::EachWind, Some(_)) => Source::EachWind { speeds_m_s: speeds_m_s.to_vec() },
    };
    effect.from_source(source).ok_or_else(|| {
        Error::usage(format!(
            "{effect} with {}: it is no moment of angle and rate in proportion to a coefficient",
            settings::name(asked.name())
        ))
        .help("add it without: it is the same whatever the wind")
    })
}
