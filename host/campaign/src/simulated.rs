//! A campaign of the virtual rig, written as a folder of records.

use rayon::prelude::*;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_core::derivatives::campaign::{AirEntry, Campaign, ModelEntry, ReleaseEntry, RigEntry};
use yawrig_records::write_samples;
use yawrig_rig::{Condition, Effects, Rig, Samples, Sensor, Start};
use yawrig_shared::derivatives::Model;
use yawrig_shared::modal::Modal;

/// The name of a campaign's file in its folder.
pub const CAMPAIGN_FILE: &str = "campaign.toml";

/// One record of a simulated campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    pub condition: Condition,
    /// In the campaign's folder, such as `K1-mid-off.csv`.
    pub file: String,
    pub truth: Modal,
    /// Effects hidden in it; empty as planned.
    pub effects: Effects,
    /// Seed of its noise.
    pub seed: u64,
}

/// Every condition `repeats` times, wind off first, each with noise of its own.
///
/// # Errors
/// Exit 2 where the model diverges in that wind.
pub fn plan(rig: &Rig, wind_speed_m_s: f64, repeats: u32, seed: u64) -> Result<Vec<Planned>> {
    let mut planned = Vec::new();
    for condition in rig.conditions(wind_speed_m_s) {
        let truth = rig.modal(&condition)?;
        let Condition { spring, axis, wind_speed_m_s } = condition;
        let wind = if wind_speed_m_s == 0.0 { "off" } else { "on" };
        for repeat in 1..=repeats {
            let number = if repeat == 1 { String::new() } else { format!("-{repeat}") };
            let file = format!("{}-{axis}-{wind}{number}.csv", spring.name);
            // The upper half counts records, so that campaigns of neighbouring seeds share no noise.
            let seed = seed.wrapping_add((planned.len() as u64 + 1) << 32);
            let effects = Effects::default();
            planned.push(Planned { condition, file, truth, effects, seed });
        }
    }
    Ok(planned)
}

/// The campaign file of these records.
pub fn describe(rig: &Rig, planned: &[Planned]) -> Campaign {
    let release = planned.iter().map(|record| {
        let condition = &record.condition;
        let spring = (condition.spring.name, condition.spring.stiffness_n_per_m);
        ReleaseEntry::new(&record.file, spring, condition.axis, condition.wind_speed_m_s)
    });
    let rig_entry = RigEntry {
        // The virtual rig's clock is exact.
        clock_u_ppm: Some(0.0),
        ..RigEntry::new(rig.spring_arm_m, rig.axis_offset_m)
    };
    let Model { length_m, frontal_area_m2 } = rig.model;
    let model = ModelEntry::new("Davis model, simulated", length_m, frontal_area_m2);
    Campaign::new(model, AirEntry::new(rig.air_density_kg_m3), rig_entry, release.collect())
}

/// Writes every record on all cores, then the campaign file, each whole or not at all. Gives its path.
///
/// # Errors
/// Exit 2 where a file is there already and `force` is not set, or effects do not suit their release, 3 where
/// one cannot be written, 130 where the user stops it; the records written by then are deleted, unless
/// `force` overwrote others.
pub fn write(
    folder: &Path,
    rig: &Rig,
    planned: &[Planned],
    start: &Start,
    sensor: &Sensor,
    force: bool,
) -> Result<PathBuf> {
    let campaign_file = folder.join(CAMPAIGN_FILE);
    if !force {
        for file in
            planned.iter().map(|record| folder.join(&record.file)).chain([campaign_file.clone()])
        {
            refuse_existing(&file)?;
        }
    }
    for record in planned {
        Samples::with_effects(&record.truth, &record.effects, start, sensor, record.seed).map_err(
            |e| {
                let named = Error::from(e);
                Error { message: format!("{}: {}", record.file, named.message), ..named }
            },
        )?;
    }
    files::make_folder(folder)?;
    let written = planned.par_iter().try_for_each(|record| {
        interrupt::check()?;
        let release =
            rig.release_with(&record.condition, &record.effects, start, sensor, record.seed)?;
        write_samples(
            &folder.join(&record.file),
            release.samples.map(|sample| (sample.time_s, sample.yaw_deg)),
        )
    });
    if let Err(error) = written {
        // No half-written campaign is left; files that were there before stay.
        if !force {
            for record in planned {
                let _ = std::fs::remove_file(folder.join(&record.file));
            }
            let _ = std::fs::remove_dir(folder);
        }
        return Err(error);
    }
    let text = toml::to_string(&describe(rig, planned))
        .map_err(|e| Error::internal(format!("cannot describe the campaign: {e}")))?;
    files::write_atomically(&campaign_file, text.as_bytes())?;
    Ok(campaign_file)
}

/// # Errors
/// Exit 2 where `file` is there already.
pub fn refuse_existing(file: &Path) -> Result<()> {
    if file.exists() {
        return Err(Error::usage(format!("{} is there already", file.display())).help(format!(
            "choose another name, or overwrite it with {}",
            settings::name("force")
        )));
    }
    Ok(())
}
