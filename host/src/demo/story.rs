//! A riddle: an effect of the library hidden in the releases of one spring, to be found out by whoever reads them.

use crate::criticism::effects::Effect;
use crate::criticism::fitting::fit_plain;
use crate::criticism::model::{is_own, Model};
use crate::criticism::model_fit::{held_against, Recorded};
use crate::criticism::records;
use crate::derivatives::simulated::{self, Planned, CAMPAIGN_FILE};
use crate::error::{Error, Exit, Result};
use crate::link::bench::{Bench, Target};
use crate::link::flash::{self, Progress};
use crate::quantity::Quantity;
use crate::record::Record;
use crate::replay::{replay, Range};
use crate::report::charts::Chart;
use crate::rig::{self, Effects, Rig, Sensor, Spring, Start};
use crate::study::plot::{Axis, Curve, Plot};
use crate::{files, interrupt};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use yawrig_shared::wire::WindowResult;

pub const SEALED_FILE: &str = "sealed-truth.txt";
pub const MODEL_FILE: &str = "model.toml";
pub const NETWORK_FILE: &str = "network.yrn";
pub const REPORT_FILE: &str = "report.html";
pub const PICTURE_FILE: &str = "device.svg";
const SCHEMA_VERSION: u32 = 1;
const WIND_M_S: f64 = 10.0;
/// Springs whose windows are many enough to see something change, and whose releases end within a minute and a half.
const SPRINGS: [&str; 4] = ["K2", "K3", "K4", "K5"];
/// Amplitude at which an effect's size is told, rad.
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

/// The effect that `seed` chooses and its size: large enough to be seen, small enough to go unnoticed on a rig. Those
/// of the library that leave the device's answers as they are (a constant moment, a drifting nought) or that nobody can
/// foretell (buffeting) make no riddle.
fn chosen(seed: u64, rig: &Rig) -> Result<(Spring, rig::Effect)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let spring = Spring::named(SPRINGS[random.random_range(0..SPRINGS.len())])?;
    let condition = rig::Condition { spring, axis: rig::Axis::Mid, wind_speed_m_s: 0.0 };
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

/// Writes four releases on one spring, about both axes with the wind off and on, their campaign file and the sealed
/// truth to `folder`.
///
/// # Errors
/// Those of [`simulated::write`].
pub fn hide(folder: &Path, seed: u64, force: bool) -> Result<()> {
    let rig = Rig::default();
    let (spring, effect) = chosen(seed, &rig)?;
    let effects = Effects::new(vec![effect])?;
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

/// The riddle's folder among the arguments of a command: the one that holds a sealed truth.
pub fn folder_of(arguments: impl IntoIterator<Item = PathBuf>) -> Option<PathBuf> {
    let holds = |folder: &Path| folder.join(SEALED_FILE).is_file();
    arguments.into_iter().find_map(|argument| {
        if holds(&argument) && !argument.as_os_str().is_empty() {
            return Some(argument);
        }
        let parent = argument.parent()?.to_owned();
        (!parent.as_os_str().is_empty() && argument.exists() && holds(&parent)).then_some(parent)
    })
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

/// What was hidden, beside what was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Revealed {
    pub schema_version: u32,
    pub hidden: Hidden,
    /// None: no model was made.
    pub model: Option<Judged>,
    pub releases: Vec<JudgedRelease>,
    pub host: Option<Errors>,
    /// None: no network was trained.
    pub device: Option<Errors>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hidden {
    pub seed: u64,
    pub effect: String,
    pub title: String,
    pub parameters: Vec<HiddenParameter>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HiddenParameter {
    pub name: String,
    pub unit: String,
    pub truth: f64,
    /// The model's; none where it has no such effect.
    pub found: Option<Quantity>,
    /// Whether truth lies within two standard uncertainties of it.
    pub within_k2: Option<bool>,
}

/// The model against the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judged {
    pub effects: Vec<String>,
    /// The hidden effect, and no other.
    pub named_right: bool,
}

/// Natural frequency, rad/s, and damping ratio.
pub type Pair = [f64; 2];

/// A release as planted, and as it was measured without and with the effect known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedRelease {
    pub file: String,
    pub truth: Pair,
    pub host_before: Pair,
    pub host_after: Option<Pair>,
    pub device_before: Pair,
    pub device_after: Option<Pair>,
    pub windows_before: Vec<WindowOf>,
    pub windows_after: Option<Vec<WindowOf>>,
}

/// Three cycles as the device sees them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WindowOf {
    pub amplitude_deg: f64,
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
}

/// Rms over the releases, before and after the effect is known. Frequencies as a share of the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    pub natural_frequency_before: f64,
    pub natural_frequency_after: f64,
    pub damping_ratio_before: f64,
    pub damping_ratio_after: f64,
}

impl Errors {
    fn of(pairs: &[(Pair, Pair, Pair)]) -> Option<Self> {
        let n = pairs.len() as f64;
        let rms = |error: &dyn Fn(&(Pair, Pair, Pair)) -> f64| {
            (pairs.iter().map(|p| error(p).powi(2)).sum::<f64>() / n).sqrt()
        };
        (n > 0.0).then(|| Self {
            natural_frequency_before: rms(&|(t, before, _)| before[0] / t[0] - 1.0),
            natural_frequency_after: rms(&|(t, _, after)| after[0] / t[0] - 1.0),
            damping_ratio_before: rms(&|(t, before, _)| before[1] - t[1]),
            damping_ratio_after: rms(&|(t, _, after)| after[1] - t[1]),
        })
    }
}

/// Opens the seal of `folder` and judges the model and the network that are there. The device is started twice: with
/// the network compiled into it and with the one trained on the model.
///
/// # Errors
/// Exit 3 where a file is missing or spoilt; those of the link; 6 where the device has no answer.
pub fn reveal(folder: &Path, target: &Target, progress: &mut dyn Progress) -> Result<Revealed> {
    let truth = unsealed(folder)?;
    let hidden: rig::Effect = truth.effect.parse()?;
    let path = folder.join(MODEL_FILE);
    let model = if path.exists() { Some(Model::read(&path)?) } else { None };
    let network = folder.join(NETWORK_FILE);
    let network = if network.exists() { Some(flash::read(&network)?.0) } else { None };
    let before = device(folder, &truth, target, None, progress)?;
    let after = network.map(|blob| device(folder, &truth, target, Some(&blob), progress));
    let after = after.transpose()?;
    let mut releases = Vec::new();
    for (k, release) in truth.releases.iter().enumerate() {
        interrupt::check()?;
        let file = folder.join(&release.file);
        let entry = records::known_or_new(&model.clone().unwrap_or_default(), &path, &file)?;
        let recorded = Recorded::read(entry, file)?;
        let plain = fit_plain(&recorded.swing, false, recorded.swing.yaw_rad.len());
        let with = model.as_ref().map(|model| held_against(model, &recorded, 1.0)).transpose()?;
        let pair = |fit: &crate::criticism::fitting::Fitted| [fit.parameters[0], fit.parameters[1]];
        releases.push(JudgedRelease {
            file: release.file.clone(),
            truth: [release.natural_frequency_rad_s, release.damping_ratio],
            host_before: pair(&plain),
            host_after: with.as_ref().map(pair),
            device_before: before[k].0,
            device_after: after.as_ref().map(|after| after[k].0),
            windows_before: before[k].1.clone(),
            windows_after: after.as_ref().map(|after| after[k].1.clone()),
        });
    }
    let errors = |before: fn(&JudgedRelease) -> Pair, after: fn(&JudgedRelease) -> Option<Pair>| {
        let of = |r: &JudgedRelease| Some((r.truth, before(r), after(r)?));
        Errors::of(&releases.iter().filter_map(of).collect::<Vec<_>>())
    };
    Ok(Revealed {
        schema_version: SCHEMA_VERSION,
        hidden: compared(truth.seed, &hidden, model.as_ref()),
        model: model.as_ref().map(|model| Judged {
            named_right: model.effects.len() == 1 && model.effects[0].effect.id() == hidden.id(),
            effects: model.effects.iter().map(|e| e.effect.id().to_owned()).collect(),
        }),
        host: errors(|r| r.host_before, |r| r.host_after),
        device: errors(|r| r.device_before, |r| r.device_after),
        releases,
    })
}

fn compared(seed: u64, hidden: &rig::Effect, model: Option<&Model>) -> Hidden {
    let effect = Effect::from_id(hidden.id());
    let entry = effect.and_then(|effect| model?.effect(effect));
    let parameter = |(index, (p, truth)): (usize, (&rig::Parameter, f64))| {
        let known = entry.filter(|e| !is_own(e.effect, index)).map(|e| e.parameters[index]);
        let found = known.and_then(|p| Some(Quantity::new(p.value?, p.u.unwrap_or(0.0))));
        HiddenParameter {
            name: p.name.to_owned(),
            unit: p.unit.to_owned(),
            truth,
            found,
            within_k2: found.map(|q| q.holds(truth, 2.0)),
        }
    };
    Hidden {
        seed,
        effect: hidden.id().to_owned(),
        title: effect.map_or("", |e| e.card().title).to_owned(),
        parameters: hidden.parameters().enumerate().map(parameter).collect(),
    }
}

/// What a fresh device answers to each release.
fn device(
    folder: &Path,
    truth: &Truth,
    target: &Target,
    network: Option<&[u8]>,
    progress: &mut dyn Progress,
) -> Result<Vec<(Pair, Vec<WindowOf>)>> {
    let mut bench = Bench::open(target)?;
    if let Some(blob) = network {
        flash::write(&mut bench.client, blob, progress)?;
    }
    let answer = |release_of: &TrueRelease| {
        let record = Record::read(&folder.join(&release_of.file))?;
        let range = Range { from_deg: 10.0, to_deg: 1.0 };
        let replayed = replay(&mut bench, &record, range, &mut |_| Ok(()))?;
        let release = replayed.main_release().filter(|r| !r.windows.is_empty());
        let Some((release, result)) = release.and_then(|r| Some((r, r.result?))) else {
            return Err(Error::new(
                Exit::Quality,
                format!("the device has no answer to {}", release_of.file),
            ));
        };
        let pair =
            [result.natural_frequency_rad_s.value, result.damping_ratio.value].map(f64::from);
        let window = |w: &WindowResult| WindowOf {
            amplitude_deg: f64::from(w.amplitude_deg),
            natural_frequency_rad_s: f64::from(w.natural_frequency_rad_s),
            damping_ratio: f64::from(w.damping_ratio),
        };
        Ok((pair, release.windows.iter().map(window).collect()))
    };
    truth.releases.iter().map(answer).collect()
}

/// The device's windows of the release that the model has not seen, before and after it learnt the effect.
pub fn device_chart(revealed: &Revealed) -> Option<Chart> {
    let release = revealed.releases.get(1).or(revealed.releases.first())?;
    type Of = fn(&WindowOf) -> f64;
    let plot = |k: usize, title: &str, label: &str, of: Of| {
        let at = |windows: &[WindowOf]| windows.iter().map(|w| (w.amplitude_deg, of(w))).collect();
        let mut curves = vec![Curve::points("its own network", at(&release.windows_before))];
        curves.extend(
            release
                .windows_after
                .as_ref()
                .map(|w| Curve::points("after learning the effect", at(w))),
        );
        curves.push(Curve::dashed(
            "planted",
            vec![(1.0, release.truth[k]), (10.0, release.truth[k])],
        ));
        Plot {
            title: format!("{title} of {} on the device", release.file),
            x: Axis::linear("amplitude (deg)"),
            y: Axis::linear(label),
            curves,
        }
    };
    Some(Chart {
        name: "device",
        caption: "The device's windows of three cycles before and after it learnt the effect."
            .to_owned(),
        plots: vec![
            plot(0, "Natural frequency", "wn (rad/s)", |w| w.natural_frequency_rad_s),
            plot(1, "Damping ratio", "zeta", |w| w.damping_ratio),
        ],
    })
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
        let all: Vec<(Spring, rig::Effect)> = (0..60).map(|s| chosen(s, &rig).unwrap()).collect();
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
