//! A riddle: an effect of the library hidden in the releases of one spring, to be identified.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_campaign::simulated::{self, Planned, CAMPAIGN_FILE};
pub use yawrig_model::document::DEFAULT as MODEL_FILE;
use yawrig_rig::{self, Effects, Rig, Sensor, Spring, Start};
use yawrig_shared::axis::Axis;

pub const SEALED_FILE: &str = "sealed-truth.txt";
pub const NETWORK_FILE: &str = "network.yrn";
pub const REPORT_FILE: &str = "report.html";
pub const PICTURE_FILE: &str = "device.svg";
pub(super) const SCHEMA_VERSION: u32 = 1;
const WIND_M_S: f64 = 10.0;
/// Springs whose windows are many enough to see something change, and whose releases end within a minute and
/// a half.
const SPRINGS: [&str; 4] = ["K2", "K3", "K4", "K5"];
/// Amplitude to which an effect's size refers, rad.
const AMPLITUDE_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// What is hidden, and what an identification should find.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    pub schema_version: u32,
    pub seed: u64,
    /// As `simulate --effect` takes it.
    pub effect: String,
    pub releases: Vec<TrueRelease>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueRelease {
    /// In the riddle's folder.
    pub file: String,
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
}

/// The effect that `seed` chooses and its size: large enough to be seen, small enough to go unnoticed on a
/// rig. Those of the library that leave the device's answers as they are (a constant moment, a drifting zero)
/// or that is random (buffeting) are not used.
fn chosen(seed: u64, rig: &Rig) -> Result<(Spring, yawrig_rig::Effect)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let spring = Spring::named(SPRINGS[random.random_range(0..SPRINGS.len())])?;
    let condition = yawrig_rig::Condition { spring, axis: Axis::Mid, wind_speed_m_s: 0.0 };
    let wn = rig.modal(&condition)?.natural_frequency_rad_s;
    let which = random.random_range(0..5);
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let a = AMPLITUDE_RAD;
    let text = match which {
        // Where friction alone would hold the model, deg.
        0 => format!("coulomb_friction:c={:.4}", wn * wn * between(0.08, 0.2).to_radians()),
        // Damping ratio that the drag adds at ten degrees.
        1 => {
            let zeta = between(0.004, 0.008);
            format!("quadratic_damping:d={:.4}", zeta * 3.0 * std::f64::consts::PI / (4.0 * a))
        }
        2 => format!("cubic_damping:c={:.3}", 8.0 * between(0.004, 0.008) * wn / (a * a)),
        // Share by which natural frequency changes at ten degrees.
        3 => {
            let share = between(0.01, 0.03) * if between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
            format!("cubic_stiffness:k3={:.2}", 8.0 / 3.0 * share * wn * wn / (a * a))
        }
        _ => format!("free_play:g={:.5}", between(0.08, 0.25).to_radians()),
    };
    Ok((spring, text.parse()?))
}

/// Writes four releases on one spring, about both axes with the wind off and on, their campaign file and the
/// sealed truth to `folder`.
///
/// # Errors
/// Those of [`simulated::write`].
pub fn hide(folder: &Path, seed: u64, force: bool) -> Result<()> {
    let rig = Rig::default();
    let (spring, effect) = chosen(seed, &rig)?;
    let effects = Effects::new(vec![effect.clone()])?;
    let planned: Vec<Planned> = simulated::plan(&rig, WIND_M_S, 1, seed)?
        .into_iter()
        .filter(|planned| planned.condition.spring == spring)
        .map(|planned| Planned { effects: effects.clone(), ..planned })
        .collect();
    let sensor = Sensor { noise_deg: 0.05, ..Sensor::default() };
    simulated::write(folder, &rig, &planned, &Start::default(), &sensor, force)?;
    let releases = planned.iter().map(|planned| TrueRelease {
        file: planned.file.clone(),
        natural_frequency_rad_s: planned.truth.natural_frequency_rad_s,
        damping_ratio: planned.truth.damping_ratio,
    });
    let effect = effect.to_string();
    let truth =
        Truth { schema_version: SCHEMA_VERSION, seed, effect, releases: releases.collect() };
    files::write_atomically(&folder.join(SEALED_FILE), sealed(&truth)?.as_bytes())
}

/// The first line of a sealed truth.
const SEAL: &str =
    "sealed: what is hidden in these releases; `yawrig demo --reveal FOLDER` opens it\n";

fn sealed(truth: &Truth) -> Result<String> {
    let json = serde_json::to_string(truth).map_err(|e| Error::internal(e.to_string()))?;
    let digits: Vec<u8> = json.bytes().flat_map(|b| format!("{b:02x}").into_bytes()).collect();
    let lines = digits.chunks(72).map(|line| format!("{}\n", String::from_utf8_lossy(line)));
    Ok(SEAL.to_owned() + &lines.collect::<String>())
}

/// What was hidden in `folder`.
///
/// # Errors
/// Exit 3 where the sealed truth is not there or spoilt.
pub fn unsealed(folder: &Path) -> Result<Truth> {
    let file = folder.join(SEALED_FILE);
    let wrong = |why: &dyn std::fmt::Display| {
        Error::data(format!("{}: {why}", file.display()))
            .help("name the folder of a riddle: yawrig demo --hidden 1 --out FOLDER makes one")
    };
    let text = std::fs::read_to_string(&file).map_err(|e| wrong(&e))?;
    let digits: Vec<u8> = text.lines().skip(1).flat_map(str::bytes).collect();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    let bytes: Option<Vec<u8>> = digits.chunks(2).map(byte).collect();
    let bytes =
        bytes.filter(|_| text.starts_with(SEAL)).ok_or_else(|| wrong(&"the seal is broken"))?;
    serde_json::from_slice(&bytes).map_err(|_| wrong(&"the seal is broken"))
}

/// The release a model is made of: about the middle axis with the wind off.
pub fn first_release(truth: &Truth) -> &str {
    truth.releases.first().map_or("", |r| r.file.as_str())
}

/// The release to measure with the device: about the same axis with the wind on.
pub fn other_release(truth: &Truth) -> &str {
    truth.releases.get(1).map_or("", |r| r.file.as_str())
}

/// The campaign file of `folder`.
pub fn campaign(folder: &Path) -> PathBuf {
    folder.join(CAMPAIGN_FILE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sealed_cannot_be_read_and_comes_out_again() {
        let truth = Truth {
            schema_version: 1,
            seed: 3,
            effect: "free_play:g=0.002".into(),
            releases: vec![TrueRelease {
                file: "a.csv".into(),
                natural_frequency_rad_s: 7.5,
                damping_ratio: 0.01,
            }],
        };
        let folder = tempfile::tempdir().unwrap();
        let text = sealed(&truth).unwrap();
        assert!(!text.contains("free_play") && text.contains("sealed"));
        let file = folder.path().join(SEALED_FILE);
        std::fs::write(&file, &text).unwrap();
        assert_eq!(unsealed(folder.path()).unwrap(), truth);
        for spoilt in [&text[..text.len() - 2], "sealed", &text.replacen('7', "x", 1), ""] {
            std::fs::write(&file, spoilt).unwrap();
            assert!(unsealed(folder.path()).is_err(), "{spoilt}");
        }
    }

    #[test]
    fn seeds_choose_among_effects_springs_and_sizes() {
        let rig = Rig::default();
        let all: Vec<(Spring, yawrig_rig::Effect)> =
            (0..60).map(|s| chosen(s, &rig).unwrap()).collect();
        let mut ids: Vec<&str> = all.iter().map(|(_, e)| e.id()).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), 5, "{ids:?}");
        for name in SPRINGS {
            assert!(all.iter().any(|(spring, _)| spring.name == name));
        }
        assert_eq!(chosen(5, &rig).unwrap(), all[5]);
    }
}
