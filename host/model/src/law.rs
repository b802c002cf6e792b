//! A measured law, its names, and the files that they may be written to.

use crate::document::{is_model, Model};
use crate::measured::{largest, measured, measured_from, releases};
use crate::model_fit::Data;
use crate::records;
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_core::diagnosis::diagnose::MIN_GAIN;
use yawrig_core::fit::at_amplitude::AtAmplitude;
use yawrig_core::law::beside::{Beside, Kind};
use yawrig_core::law::estimate::{Curve, Measured};
use yawrig_core::law::left::Left;
use yawrig_core::law::names::{names, Names};
use yawrig_core::record::{Measurand, Record};
use yawrig_records::Selection;

/// Formulas that are written.
const WRITTEN: usize = 6;

/// What was found.
pub struct LawAnswer {
    /// The record from the largest angle, whose curve is drawn, and how many the law was measured from.
    pub file: PathBuf,
    pub records: usize,
    /// What they hold.
    pub measurand: Measurand,
    pub measured: Measured,
    pub at_amplitude: Vec<AtAmplitude>,
    pub curve: Curve,
    pub names: Names,
    /// What shows that no law of angle and rate holds the moment.
    pub left: Option<Left>,
}

/// A formula as a file that `add` takes.
pub struct File {
    pub path: PathBuf,
    pub text: String,
}

impl File {
    /// # Errors
    /// Exit 3 where it cannot be written.
    pub fn write(&self) -> Result<()> {
        if let Some(folder) = self.path.parent() {
            files::make_folder(folder)?;
        }
        files::write_atomically(&self.path, self.text.as_bytes())
    }
}

/// What [`beside`] takes: records, read as `reading` says, or a model and its records.
///
/// # Errors
/// Exit 3 where a file cannot be used, 130 where the user stops it.
pub fn read(paths: &[PathBuf], reading: &Selection) -> Result<(Model, Data)> {
    let (model, at) = match paths {
        [model] if is_model(model) => (Model::read(model)?, model.clone()),
        _ => {
            // Entries are relative to a model's file, which lies here.
            let at = PathBuf::from(crate::document::DEFAULT);
            let records = records::entries(paths, reading, &at)?;
            (Model { records, ..Model::default() }, at)
        }
    };
    let data = Data::new(&model, &at)?;
    interrupt::check()?;
    Ok((model, data))
}

/// As [`read`], of records in memory.
///
/// # Errors
/// As [`read`].
pub fn of_records(records: Vec<Record>) -> Result<(Model, Data)> {
    let data = Data::of_records(records)?;
    let records = data.fitted.iter().map(|r| r.entry.clone()).collect();
    Ok((Model { records, ..Model::default() }, data))
}

/// Measures and names the law of `data` beside the effects of `model`; `show` is given a first law, and the
/// law with its uncertainty before it has names.
///
/// # Errors
/// Exit 6 where no law can be fitted, 130 where the user stops it.
pub fn beside(
    model: &Model,
    data: &Data,
    dissipative: bool,
    show: &dyn Fn(Curve, Option<&Measured>),
) -> Result<LawAnswer> {
    let measured = measured(model, data, dissipative, &|first| show(first, None))?;
    let recorded = largest(data);
    let curve = measured.curve(&recorded.decay);
    show(curve.clone(), Some(&measured));
    let records = measured_from(model, data);
    let names = names(&releases(&records), &measured)?;
    let (file, records) = (recorded.path.clone(), records.len());
    let decay = &recorded.decay;
    let of_memory = names.memory.as_ref().map(|memory| Left::memory(decay, &memory.fit));
    let left =
        of_memory.or_else(|| names.beside.as_ref().map(|beside| Left::beside(decay, beside)));
    let at_amplitude = measured.at_amplitude(decay);
    let measurand = decay.measurand.clone();
    Ok(LawAnswer { file, records, measurand, measured, at_amplitude, curve, names, left })
}

impl LawAnswer {
    /// Whether the best formula predicts as well as the law as it was measured, but for a share that does not count.
    pub fn has_name(&self) -> bool {
        let least = (1.0 + MIN_GAIN) * self.measured.held_out_over_noise;
        self.names.ranked.first().is_some_and(|best| best.held_out_over_noise <= least)
    }

    /// The best formulas, in their order, as files of `folder`.
    pub fn files(&self, folder: &Path) -> Vec<File> {
        let best = self.names.ranked.iter().take(WRITTEN);
        best.map_while(|name| {
            let (from, held_out) = (self.file.display(), name.held_out_over_noise);
            let text = name.text.as_ref()?;
            Some(File {
                path: folder.join(format!("{}.toml", name.effect.id())),
                text: format!("# from {from}, held out {held_out:.3} times the noise\n{text}"),
            })
        })
        .collect()
    }

    /// Why no law of angle and rate holds the moment, where hysteresis predicts better.
    pub fn memory(&self) -> Option<String> {
        let memory = self.names.memory.as_ref()?;
        Some(format!(
            "memory: the moment depends on where the model last turned; no law of angle and rate holds it. {} predicts better \
             than every formula (held out {:.3})",
            memory.effect, memory.held_out_over_noise
        ))
    }

    /// What else no law of angle and rate holds, and what to do about it.
    pub fn beside(&self) -> Option<String> {
        let Beside { kind, effect, held_out_over_noise, frequency_rad_s, .. } =
            self.names.beside.as_ref()?;
        let what = match kind {
            Kind::Time => {
                "time: the moment changes as the release goes on, at the same angle and rate".into()
            }
            Kind::SecondFrequency => format!(
                "a second frequency, {:.3} rad/s, which is not the yaw mode's",
                frequency_rad_s.unwrap_or(f64::NAN)
            ),
            Kind::Sensor => "the sensor: its reading bends with the angle, not the moment".into(),
            Kind::Randomness => {
                "randomness: what the law leaves is a random moment, which nothing predicts".into()
            }
        };
        Some(match kind {
            Kind::Randomness => format!("{what}; no law of angle and rate holds it"),
            _ => format!(
                "{what}; no law of angle and rate holds it. {effect} beside the law predicts better (held out {:.3} -> {held_out_over_noise:.3}): yawrig add measured_law, then yawrig add {effect}",
                self.measured.held_out_over_noise
            ),
        })
    }

    /// Which formulas the record leaves open, where several.
    pub fn alike(&self) -> Option<String> {
        let first = &self.names.ranked[..self.names.indistinguishable];
        let alike: Vec<&str> = first.iter().map(|n| n.effect.id()).collect();
        (alike.len() > 1).then(|| {
            format!(
                "this record cannot distinguish {}; a release from another angle, or on another spring, may",
                alike.join(", ")
            )
        })
    }
}
