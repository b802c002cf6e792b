//! The riddle of [`story`](super::story) opened: what was hidden beside the model and the network that were
//! made.

use super::story::{unsealed, TrueRelease, Truth, MODEL_FILE, NETWORK_FILE, SCHEMA_VERSION};
use serde::Serialize;
use std::path::Path;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_plain, Fitted};
use yawrig_core::quantity::Quantity;
use yawrig_link::bench::{Bench, Target};
use yawrig_link::flash::{self, Progress};
use yawrig_link::replay::{replay, Range};
use yawrig_model::document::{is_own, Model};
use yawrig_model::model_fit::{held_against, Recorded};
use yawrig_model::records;
use yawrig_report::charts::Chart;
use yawrig_report::plot::{Axis, Curve, Plot};
use yawrig_shared::wire::WindowResult;

/// What was hidden, beside what was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Revealed {
    pub schema_version: u32,
    pub hidden: Hidden,
    /// None: no model was made.
    pub model: Option<RevealedAnswer>,
    pub releases: Vec<RevealedRelease>,
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
pub struct RevealedAnswer {
    pub effects: Vec<String>,
    /// The hidden effect, and no other.
    pub named_right: bool,
}

/// Natural frequency, rad/s, and damping ratio.
pub type Pair = [f64; 2];

/// A release as planted, and as it was measured without and with the effect known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RevealedRelease {
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
    fn new(pairs: &[(Pair, Pair, Pair)]) -> Option<Self> {
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

/// Opens the seal of `folder` and judges the model and the network that are there. The device is started
/// twice: with the network compiled into it and with the one trained on the model.
///
/// # Errors
/// Exit 3 where a file is missing or spoilt; those of the link; 6 where the device has no answer.
pub fn reveal(folder: &Path, target: &Target, progress: &mut dyn Progress) -> Result<Revealed> {
    let truth = unsealed(folder)?;
    let hidden: yawrig_rig::Effect = truth.effect.parse()?;
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
        let plain = fit_plain(&recorded.decay, false, recorded.decay.yaw_rad.len());
        let with = model.as_ref().map(|model| held_against(model, &recorded, 1.0)).transpose()?;
        let pair = |fit: &Fitted| [fit.natural_frequency_rad_s().value, fit.damping_ratio().value];
        releases.push(RevealedRelease {
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
    let errors = |before: fn(&RevealedRelease) -> Pair,
                  after: fn(&RevealedRelease) -> Option<Pair>| {
        let of = |r: &RevealedRelease| Some((r.truth, before(r), after(r)?));
        Errors::new(&releases.iter().filter_map(of).collect::<Vec<_>>())
    };
    Ok(Revealed {
        schema_version: SCHEMA_VERSION,
        hidden: compared(truth.seed, &hidden, model.as_ref()),
        model: model.as_ref().map(|model| RevealedAnswer {
            named_right: model.effects.len() == 1 && model.effects[0].effect.id() == hidden.id(),
            effects: model.effects.iter().map(|e| e.effect.id().to_owned()).collect(),
        }),
        host: errors(|r| r.host_before, |r| r.host_after),
        device: errors(|r| r.device_before, |r| r.device_after),
        releases,
    })
}

fn compared(seed: u64, hidden: &yawrig_rig::Effect, model: Option<&Model>) -> Hidden {
    let effect = Effect::from_id(hidden.id());
    let entry = effect.clone().and_then(|effect| model?.effect(effect));
    let parameter = |(index, (p, truth)): (usize, (&yawrig_rig::Parameter, f64))| {
        let known = entry.filter(|e| !is_own(&e.effect, index)).map(|e| e.parameters[index]);
        let found = known.and_then(|p| Some(Quantity::new(p.value?, p.u.unwrap_or(0.0))));
        HiddenParameter {
            name: p.name.to_string(),
            unit: p.unit.to_string(),
            truth,
            found,
            within_k2: found.map(|q| q.holds(truth, 2.0)),
        }
    };
    Hidden {
        seed,
        effect: hidden.id().to_owned(),
        title: effect.map_or(String::new(), |e| e.card().title.to_owned()),
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
        let record = yawrig_records::read(&folder.join(&release_of.file))?;
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
