//! Which release next: rival models of a model file's or a campaign's records, and what each possible release
//! would tell.

use crate::adding;
use crate::document::{is_model, EffectEntry, Model};
use crate::effects;
use crate::model_fit::{self, Data};
use crate::records;
use crate::revise::check_addable;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_base::message::Progress;
use yawrig_base::settings;
use yawrig_campaign::CampaignFile;
use yawrig_core::bic::{self, MARGIN};
use yawrig_core::derivatives::can::Can;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::Point;
use yawrig_core::effects::{Effect, MEASURED_LAW};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::fit::joint::JointFit;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::plan::{self, Narrowed, Possible, Ranked, Rival};
use yawrig_core::quantity::Quantity;
use yawrig_records::Selection;

/// Most rivals that are looked for.
const MAX_RIVALS: usize = 3;
/// Where the file does not say what the rig can do: amplitudes and lengths, of those of the records there
/// are.
const AMPLITUDES: [f64; 5] = [0.25, 0.5, 1.0, 1.5, 2.0];
const LENGTHS: [f64; 2] = [1.0, 2.0];
/// Largest amplitude that is proposed unasked, deg.
const LARGEST_DEG: f64 = 60.0;

/// What is found. Releases best first.
#[derive(Clone, Debug, Serialize)]
pub struct Planned {
    pub rivals: Vec<String>,
    pub releases: Vec<Ranked>,
    pub precision: Vec<Narrowed>,
    pub notes: Vec<String>,
}

/// Where a derivative is in a point of the table.
pub type Of = fn(&Point) -> Option<Quantity>;

/// What is asked.
#[derive(Clone, Debug, Default)]
pub struct PlanRequest {
    /// Models that compete, each by the names of its effects, `measured_law` that of the model; none: they
    /// are looked for.
    pub rivals: Vec<Vec<String>>,
    /// The derivative whose error is to be narrowed, and where it is in the table.
    pub derivative: Option<(&'static str, Of)>,
}

/// Plans for the model or campaign at `path`; `progress` hears how many releases are simulated, and of each.
///
/// # Errors
/// Exit 3 where a file cannot be used, 6 where no rivals can be fitted, 130 where the user stops it.
pub fn plan(
    path: &Path,
    asked: &PlanRequest,
    progress: &(dyn Fn(Option<usize>) + Sync),
) -> Result<Planned> {
    let (model, at, campaign) = read(path)?;
    let data = Data::new(&model, &at)?;
    let measurand = data.measurand();
    if !measurand.is_angle() {
        let what = format!(
            "a plan of further releases is of angles, and these records hold a {}",
            measurand.quantity()
        );
        return Err(Error::usage(what)
            .help("measure the angle, or release it again from another amplitude"));
    }
    let mut notes = Vec::new();
    let fits = match asked.rivals.as_slice() {
        [] => found(&model, &data, &mut notes)?,
        named => {
            let sets: Vec<Vec<Effect>> =
                named.iter().map(|set| chosen(&model, set)).collect::<Result<_>>()?;
            sets.iter().map(|set| fitted(&model, &data, set)).collect::<Result<_>>()?
        }
    };
    let fits: Vec<JointFit> = fits.into_iter().map(JointFit::quickly).collect();
    let rivals: Vec<Rival> = fits.iter().map(|fit| Rival { name: name(fit), fit }).collect();
    let can = can(path, campaign.as_ref())?;
    let possible = possible(&data, &fits[0], &can);
    if possible.is_empty() {
        return Err(Error::data(format!("{}: [can] leaves no release to make", path.display()))
            .help("name springs, wind speeds and axes of records that there are"));
    }
    progress(Some(possible.len()));
    let decays: Vec<&FreeDecay> = data.fitted.iter().map(|r| &r.decay).collect();
    let releases = plan::rank(&rivals, &decays, &possible, &|| progress(None))?;
    let left_out = possible.len() - releases.len();
    if left_out > 0 {
        let is_law = |fit: &JointFit| fit.structure.effects.iter().any(|e| e.id() == MEASURED_LAW);
        notes.push(match fits.iter().any(is_law) {
            true => format!(
                "{left_out} releases are left out: beyond its range the measured law says nothing, and a larger \
                 release measures it there"
            ),
            false => format!("{left_out} releases are left out: in them a rival does not stay finite"),
        });
    }
    let precision = match (&campaign, asked.derivative) {
        (Some(file), Some((name, of))) => narrowed(file, name, of)?,
        _ => Vec::new(),
    };
    let rivals = rivals.into_iter().map(|rival| rival.name).collect();
    Ok(Planned { rivals, releases, precision, notes })
}

/// The model, the path its records are relative to, and the campaign where it is one.
fn read(path: &Path) -> Result<(Model, PathBuf, Option<CampaignFile>)> {
    if is_model(path) {
        return Ok((Model::read(path)?, path.to_owned(), None));
    }
    let file = CampaignFile::read_releases(path)?;
    // A model that is not written, beside the campaign.
    let at = path.with_file_name(".plan.toml");
    let records = records::entries(&[path.to_owned()], &Selection::default(), &at)?;
    Ok((Model { records, ..Model::default() }, at, Some(file)))
}

fn can(path: &Path, campaign: Option<&CampaignFile>) -> Result<Can> {
    #[derive(Deserialize)]
    struct File {
        can: Option<Can>,
    }
    if let Some(file) = campaign {
        return Ok(file.campaign.can.clone().unwrap_or_default());
    }
    let text = crate::document::read_text(path)?;
    let file: File = toml::from_str(&text)
        .map_err(|e| Error::data(format!("{}: [can]: {}", path.display(), e.message())))?;
    Ok(file.can.unwrap_or_default())
}

/// A rival's effects, as it is called.
fn name(fit: &JointFit) -> String {
    let names: Vec<&str> = fit.structure.effects.iter().map(Effect::id).collect();
    match names.is_empty() {
        true => "second_order".to_owned(),
        false => names.join("+"),
    }
}

/// Effects by their names; what is in the model already is that.
fn chosen(model: &Model, names: &[String]) -> Result<Vec<Effect>> {
    let of = |name: &String| match model.effects.iter().find(|e| e.effect.id() == name) {
        Some(entry) => Ok(entry.effect.clone()),
        None => effects::named(name),
    };
    effects::distinct(names.iter().map(of).collect::<Result<_>>()?)
}

/// The records' model with these effects instead of its own.
fn fitted(model: &Model, data: &Data, effects: &[Effect]) -> Result<JointFit> {
    let mut model = Model { effects: Vec::new(), ..model.clone() };
    for effect in effects {
        check_addable(&model, effect.clone())?;
        model.effects.push(EffectEntry::unfitted(effect.clone()));
    }
    let fit = model_fit::fit(&model, data)?;
    if fit.converged {
        return Ok(fit);
    }
    Err(Error::new(Exit::Quality, format!("the rival {} cannot be fitted", name(&fit)))
        .help(format!("name other rivals with {}", settings::name("rival"))))
}

/// The model and what does about as well in the place of one of its effects; without effects, the effects
/// that explain most by themselves.
fn found(model: &Model, data: &Data, notes: &mut Vec<String>) -> Result<Vec<JointFit>> {
    let present = model_fit::fit(model, data)?;
    let mut effects: Vec<Effect> = present.structure.effects.clone();
    // What can take the shape of others is no rival of theirs.
    let library = || {
        Effect::ALL.into_iter().filter(|e| {
            let without_zero = model.unknown_zero && e.moves_rest();
            !e.is_random()
                && !e.is_flexible()
                && !without_zero
                && !present.structure.effects.contains(e)
        })
    };
    let mut others: Vec<JointFit> = Vec::new();
    let inners: Vec<JointFit> = if effects.is_empty() {
        vec![present.clone()]
    } else {
        let without = |effect: &Effect| {
            let mut rest = model.clone();
            rest.effects.retain(|e| e.effect != *effect);
            model_fit::fit(&rest, data)
        };
        effects.drain(..).map(|effect| without(&effect)).collect::<Result<_>>()?
    };
    for inner in &inners {
        let all: Vec<JointFit> = library()
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|effect| adding::add(data, inner, effect))
            .collect::<Result<_>>()?;
        others.extend(all.into_iter().filter(|fit| fit.converged));
    }
    interrupt::check()?;
    // Worse than the best by this much of BIC.
    let worse = |fit: &JointFit, best: &JointFit| {
        let more = best.parameters.len() as f64 - fit.parameters.len() as f64;
        bic::gain(fit.sum_of_squares, best.sum_of_squares, best.effective_count(), more)
    };
    others.sort_by(|a, b| worse(a, &present).total_cmp(&worse(b, &present)));
    let mut rivals = if present.structure.effects.is_empty() { Vec::new() } else { vec![present] };
    for other in others {
        let is_near = rivals.first().is_none_or(|best| worse(&other, best) < MARGIN);
        if rivals.len() >= MAX_RIVALS || (!is_near && rivals.len() >= 2) {
            break;
        }
        if !is_near {
            notes.push(format!(
                "the records there are already tell {} from {}, by {:.0} of BIC",
                name(&rivals[0]),
                name(&other),
                worse(&other, &rivals[0])
            ));
        }
        rivals.push(other);
    }
    match rivals.len() {
        0 | 1 => Err(Error::new(Exit::Quality, "there are no two models to choose between").help(
            format!(
                "name them: {} {}",
                settings::given("rival", "EFFECT"),
                settings::given("rival", "EFFECT+EFFECT")
            ),
        )),
        _ => Ok(rivals),
    }
}

/// Every amplitude and length under every condition that there is and is not excluded, and on the other
/// springs of a lone model.
fn possible(data: &Data, fit: &JointFit, can: &Can) -> Vec<Possible> {
    let mut out = Vec::new();
    let mut seen: Vec<&str> = Vec::new();
    for (like, recorded) in data.fitted.iter().enumerate() {
        let (entry, decay) = (&recorded.entry, &recorded.decay);
        if seen.contains(&entry.condition.as_str()) {
            continue;
        }
        seen.push(&entry.condition);
        let made = entry.made_under.as_ref();
        let excluded = made.is_some_and(|m| {
            let speed = |v: &f64| (v - m.wind_speed_m_s).abs() < 1e-9;
            (!can.springs.is_empty() && !can.springs.contains(&m.spring))
                || (!can.axes.is_empty() && !can.axes.contains(&m.axis))
                || (!can.wind_speeds_m_s.is_empty() && !can.wind_speeds_m_s.iter().any(speed))
        });
        if excluded {
            continue;
        }
        let amplitude_deg = decay.amplitude_rad.to_degrees();
        let length_s = decay.grid.step_s * decay.grid.count as f64;
        let scaled = |given: &[f64], by: &[f64], of: f64, most: f64| -> Vec<f64> {
            let rounded = |x: f64| (x * 10.0).round() / 10.0;
            match given {
                [] => {
                    by.iter().map(|b| rounded(b * of)).filter(|x| *x > 0.0 && *x <= most).collect()
                }
                given => given.to_vec(),
            }
        };
        let amplitudes = scaled(&can.amplitudes_deg, &AMPLITUDES, amplitude_deg, LARGEST_DEG);
        let lengths = scaled(&can.seconds, &LENGTHS, length_s, f64::INFINITY);
        let wn = fit.fits[like].parameters[0];
        let others = can.natural_frequencies_rad_s.iter().filter(|_| made.is_none());
        let frequencies = std::iter::once((wn, true)).chain(others.map(|w| (*w, false)));
        for (natural_frequency_rad_s, repeated) in frequencies {
            for &amplitude_deg in &amplitudes {
                out.extend(lengths.iter().map(|&seconds| Possible {
                    amplitude_deg,
                    spring: made.map(|m| m.spring.clone()),
                    wind_speed_m_s: made.map(|m| m.wind_speed_m_s),
                    axis: made.map(|m| m.axis),
                    seconds,
                    natural_frequency_rad_s,
                    like,
                    repeated,
                }));
            }
        }
    }
    out
}

fn narrowed(file: &CampaignFile, name: &str, of: Of) -> Result<Vec<Narrowed>> {
    let progress = Progress::new(file.campaign.release.len(), "identifying");
    let one = |index: usize| {
        interrupt::check()?;
        progress.one();
        let record = file.record(index)?;
        let found = identify(&record, &[Method::LeastSquares], &Settings::default())?;
        Identified::from_identification(found).ok_or_else(|| {
            let path = file.record_path(index);
            Error::data(format!("{}: nothing is identified in it", path.display()))
                .help("leave it out of the campaign")
        })
    };
    let releases = 0..file.campaign.release.len();
    let identified: Vec<Identified> = releases.into_par_iter().map(one).collect::<Result<_>>()?;
    Ok(plan::precision(&file.campaign, &identified, name, &of)?)
}
