//! `diagnose`: which physical effect a second-order model of a record, or of a campaign's, lacks.

mod case;
mod json;
mod outcome;

use super::common::{print_json, print_line, EffectsArg};
use super::csv;
use super::diagnosis_text;
use super::law;
use super::model::{JudgeArgs, DEFAULT};
use super::releases::ReleaseArg;
use super::roll::RollArgs;
use crate::answer::{Answer, Drawn};
use crate::commands::{self, new_model, Making, Words};
use case::{beside, one, several, Case};
use clap::Args;
use json::object;
use outcome::Outcome;
use std::path::{Path, PathBuf};
use yawrig_base::clock::Instant;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_campaign::CampaignFile;
use yawrig_core::diagnosis::diagnose::{
    diagnose, name_of, Common, Diagnosis, Grouping, Options, Status, SECOND_ORDER,
};
use yawrig_core::record::Record;
use yawrig_model::document::{is_model, Model};
use yawrig_model::effects::named;
use yawrig_model::law::LawAnswer;
use yawrig_model::limits::structure;

/// Which physical effect a second-order model of a record lacks.
///
/// Every effect of the library is fitted, alone and in combination. Those that bring the model down to the
/// noise are judged by evidence; where none do, by the prediction of parts of the record that were not
/// fitted, and what is left is said. A reading at rest that is not zero counts as a constant moment unless
/// --unknown-zero says that the sensor was not zeroed. Your own effect, a moment written as an expression
/// in a file, competes with them when --effect names it. Where nothing explains a record, its law is
/// measured and named as `yawrig law` does it, and the best formula is printed with the commands that add
/// it. Nothing is written but with --out.
///
/// With --model the present model's effects stay, and what it lacks beside them is looked for; without a FILE
/// in the model's own record.
///
/// Several FILEs are releases of one rig: each is judged by itself, and what their answers name is tried in
/// all of them at once. Each has its own natural frequency, damping ratio and rest angle (--same-rig: the
/// first two in common), and one coefficient of each effect is common to all unless --own names it. What is
/// held out is each release, predicted from the others; far from the noise, where the effects are those that
/// predict, it is pieces of the releases.
///
/// A campaign.toml has its releases judged likewise: which effects they need, whether each is there with the
/// wind off (mechanical) or only with it on (aerodynamic), and what it does to the derivatives.
#[derive(Args, Debug, Clone)]
pub struct Diagnose {
    /// Record (CSV: time_s,yaw_deg), several of one rig, or campaign.toml; none: the model's records
    #[arg(value_name = "FILE|campaign.toml")]
    pub files: Vec<PathBuf>,
    /// The model that is there already [default, without a FILE: model.toml]
    #[arg(short, long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Several records: one natural frequency and one damping ratio for all
    #[arg(long)]
    pub same_rig: bool,
    /// Several records: one coefficient of this effect for all, as is the rule (repeatable)
    #[arg(long, value_name = "EFFECT")]
    pub share: Vec<String>,
    /// Several records: a coefficient of this effect for each (repeatable)
    #[arg(long, value_name = "EFFECT")]
    pub own: Vec<String>,
    #[command(flatten)]
    pub release: ReleaseArg,
    #[command(flatten)]
    pub effects: EffectsArg,
    #[command(flatten)]
    pub judge: JudgeArgs,
    #[command(flatten)]
    pub roll: RollArgs,
    /// Where the formulas of a law that was measured are written, as files that `yawrig add` takes
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Print CSV, a row for each model that was gone through, units in the header
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
}

impl Diagnose {
    pub fn run(&self) -> Result<()> {
        let outcome = self.judged(self.case()?, !self.csv)?;
        let outcome = Outcome { commands: self.commands(&outcome)?, ..outcome };
        let diagnosis = &outcome.diagnosed.diagnosis;
        if self.csv {
            return csv::diagnosed(&outcome.name(), diagnosis);
        }
        let files = match &outcome.law {
            Some(found) => law::written(found, self.out.as_deref())?,
            None => Vec::new(),
        };
        if self.judge.json {
            return print_json(&object(&outcome, &files));
        }
        print_line(&self.text(&outcome, &files)?)
    }

    /// What is printed; `files` hold the law's formulas.
    fn text(&self, outcome: &Outcome, files: &[PathBuf]) -> Result<String> {
        let diagnosis = &outcome.diagnosed.diagnosis;
        let reading = self.release.selection()?;
        let records: Vec<PathBuf> = outcome.records.iter().map(|r| r.file.clone()).collect();
        let measure = law::command(&records, &reading, false);
        let mut text = diagnosis_text::of(&outcome.name(), diagnosis, outcome.model);
        if let Some(command) = outcome.about_rest(&reading) {
            text += &format!(
                "\n\nfitted about the angle of rest, not about zero; the same model: {command}"
            );
        }
        if diagnosis.jumps.is_some() {
            text += "\n\na device learns its converter's error from some of its own releases and takes it out of each \
                     sample: yawrig device linearity RECORD...; other converters and rests: yawrig doctor --device PORT";
        } else if records.len() == 1 && diagnosis.lacks_more() {
            text += &format!("\n\nwhat is left may be a law that can be measured: {measure}");
        }
        let law = outcome.law.as_ref().and_then(|found| law::in_short(found, files, &measure));
        if let Some(law) = law {
            text += &format!("\n\n{law}");
        }
        if !outcome.commands.is_empty() {
            text += &format!("\n\n{}", commands::lines(&outcome.commands));
        }
        Ok(text)
    }

    /// The answer about these records in memory, or, where there are none, about the files. Nothing is
    /// written.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, records: Vec<Record>) -> Result<Answer> {
        let from_files = records.is_empty();
        let case = match from_files {
            true => self.case()?,
            false => Case::Records(records, self.beside_model(self.options()?)?),
        };
        let outcome = self.judged(case, true)?;
        let commands = if from_files { self.commands(&outcome)? } else { Vec::new() };
        let outcome = Outcome { commands, ..outcome };
        let d = &outcome.diagnosed.diagnosis;
        let answer = Answer::new(&object(&outcome, &[]), d.verdict(outcome.model))?
            .printed(self.text(&outcome, &[])?);
        Ok(match outcome.records.is_empty() {
            true => answer,
            false => answer.drawn_from(Drawn::Diagnosed(outcome.records, outcome.diagnosed.into())),
        })
    }

    /// Which make the model of the answer about files.
    fn commands(&self, outcome: &Outcome) -> Result<Vec<Words>> {
        let is_beside = self.model.is_some() || outcome.model != SECOND_ORDER;
        let (files, reading) = (self.release.of(&self.files)?, self.release.selection()?);
        let model = match (&self.model, &files[..]) {
            (Some(model), _) => model.clone(),
            (None, [file]) if is_model(file) => file.clone(),
            (None, []) => PathBuf::from(DEFAULT),
            _ => new_model(),
        };
        let is_there = is_beside || files.iter().any(|file| is_model(file)) || files.is_empty();
        let d = &outcome.diagnosed.diagnosis;
        let making = Making {
            files: if is_there { &[] } else { &files },
            reading: &reading,
            unknown_zero: outcome.zero_unknown || outcome.campaign.is_none() && d.about_rest,
            model,
            own: &self.effects.own_files()?,
        };
        Ok(making.of_diagnosis(d, outcome.law.as_ref().is_some_and(|l| !l.measured.law.is_none())))
    }

    fn options(&self) -> Result<Options> {
        Ok(Options {
            zero_unknown: self.judge.unknown_zero,
            own: self.effects.effects()?,
            stop: interrupt::stop(),
            ..Options::default()
        })
    }

    /// What several releases have in common.
    fn common(&self) -> Result<Common> {
        let named = |ids: &[String]| ids.iter().map(|id| named(id)).collect::<Result<Vec<_>>>();
        let (shared, own) = (named(&self.share)?, named(&self.own)?);
        if let Some(both) = own.iter().find(|e| shared.contains(e)) {
            return Err(Error::usage(format!("--own {both} and --share {both}"))
                .help("give one of them: by itself a coefficient is common to all"));
        }
        Ok(Common { same_rig: self.same_rig, own })
    }

    fn case(&self) -> Result<Case> {
        let options = self.options()?;
        // Before anything is read.
        self.common()?;
        self.roll.ship()?;
        let is_toml =
            |file: &Path| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        let files = self.release.of(&self.files)?;
        if files.len() > 1 {
            return several(&files, &self.release.selection()?, self.beside_model(options)?);
        }
        let asked = self.same_rig || !self.share.is_empty() || !self.own.is_empty();
        if let (true, [file]) = (asked, &files[..]) {
            return Err(Error::usage(format!(
                "--same-rig, --share or --own with {} alone",
                file.display()
            ))
            .help("name the other releases too: yawrig diagnose A.csv B.csv"));
        }
        let reading = self.release.selection()?;
        let file = files.first();
        match (file, &self.model) {
            (Some(file), None) if is_toml(file) && is_model(file) => {
                beside(file, None, &reading, options)
            }
            (Some(file), None) if is_toml(file) => Ok(Case::Campaign(file.clone(), options)),
            (Some(file), Some(_)) if is_toml(file) => {
                Err(Error::usage("a campaign beside --model")
                    .help("leave --model out: a campaign is judged from a second-order model on"))
            }
            (Some(file), None) => one(file, &reading, options),
            (file, model) => {
                let model = model.as_deref().unwrap_or(Path::new(DEFAULT));
                beside(model, file.map(PathBuf::as_path), &reading, options)
            }
        }
    }

    /// With what the model of --model holds as present.
    fn beside_model(&self, mut options: Options) -> Result<Options> {
        if let Some(path) = &self.model {
            let model = Model::read(path)?;
            options.zero_unknown |= model.unknown_zero;
            options.present = structure(&model)?;
        }
        Ok(options)
    }

    /// `with_law`: the law of a record that nothing explains is measured.
    fn judged(&self, case: Case, with_law: bool) -> Result<Outcome> {
        let begin = Instant::now();
        let (records, campaign, diagnosed, options) = match case {
            Case::Records(records, options) => {
                let grouping = Grouping::Rig(self.common()?);
                let rolls = self.roll.all_roll(records.iter().map(|r| &r.measurand))?;
                if records.len() > 1 {
                    yawrig_base::say!("judging {} releases as one", records.len());
                }
                let mut diagnosed = diagnose(&records, &grouping, &options)?;
                for warning in diagnosed.decays.iter().flat_map(|decay| &decay.warnings) {
                    yawrig_base::warn!("{warning}");
                }
                if rolls {
                    diagnosed.diagnosis = diagnosed.diagnosis.of_ship(self.roll.ship()?);
                }
                (records, None, diagnosed, options)
            }
            Case::Campaign(path, options) => {
                if self.roll.ship()?.is_some() {
                    return Err(Error::usage("an inertia, GM or displacement with a campaign")
                        .help("give its records: yawrig diagnose FILE... --motion roll"));
                }
                let file = CampaignFile::read_releases(&path)?;
                yawrig_base::say!("fitting {} releases", file.campaign.release.len());
                let diagnosed = yawrig_campaign::diagnose(&file, &options)?;
                (Vec::new(), Some(path), diagnosed, options)
            }
        };
        let seconds = begin.elapsed().as_secs_f64();
        let law = match &records[..] {
            [record] if with_law => law_of(record, &diagnosed.diagnosis, &options)?,
            _ => None,
        };
        let model = name_of(&options.present.effects);
        let zero_unknown = options.zero_unknown;
        let commands = Vec::new();
        Ok(Outcome { records, campaign, diagnosed, law, zero_unknown, model, seconds, commands })
    }
}

/// The law of a record of which nothing in the library explains what is missing.
fn law_of(record: &Record, diagnosis: &Diagnosis, options: &Options) -> Result<Option<LawAnswer>> {
    if diagnosis.status != Status::Unexplained || !options.present.effects.is_empty() {
        return Ok(None);
    }
    yawrig_base::say!("no effect explains it; measuring its law");
    let law = yawrig_model::law::of_records(vec![record.clone()])
        .and_then(|(model, data)| yawrig_model::law::beside(&model, &data, true, &|_, _| {}));
    interrupt::check()?;
    if let Err(error) = &law {
        yawrig_base::warn!("no law was measured: {error}");
    }
    Ok(law.ok())
}
