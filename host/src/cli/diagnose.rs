//! `diagnose`: which physical effect a second-order model of a record, or of a campaign's, lacks.

use super::common::{print_json, print_line, EffectsArg, SCHEMA_VERSION};
use super::csv;
use super::diagnosis_text;
use super::law;
use super::model::{JudgeArgs, DEFAULT};
use super::releases::{warn_of_more, ReleaseArg};
use crate::campaign::CampaignFile;
use crate::law::{found, Found};
use crate::model::document::{is_model, Model, RecordEntry};
use crate::model::edits;
use crate::model::effects::named;
use crate::model::limits::structure;
use crate::model::records;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::diagnosis::campaign;
use yawrig_core::diagnosis::diagnose::{
    diagnose_with_fits, name_of, Diagnosed, Diagnosis, Options, Status, SECOND_ORDER,
};
use yawrig_core::diagnosis::several::{diagnose_several, Common, SeveralDiagnosis};

/// Which physical effect a second-order model of a record lacks.
///
/// Every effect of the library is fitted, alone and in combination. Near the noise it is judged by evidence; where more
/// than noise is left, by the prediction of parts of the record that were not fitted, and what is left is said. A reading
/// at rest that is not zero counts as a constant moment unless --unknown-zero
/// says that the sensor was not zeroed. Your own effect, a moment written as an expression in a file, competes with them
/// when --effect names it. Where nothing explains a record, its law is measured and named as `yawrig law` does it, and the
/// best formula is printed with the commands that add it. Nothing is written but with --out.
///
/// With --model the present model's effects stay, and what it lacks beside them is looked for; without a FILE in the
/// model's own record.
///
/// Several FILEs are releases of one rig: each is judged by itself, and what their answers name is tried in all of them
/// at once. Each has its own natural frequency, damping ratio and rest angle (--same-rig: the first two in common), and one
/// coefficient of each effect is common to all unless --own names it. What is held out is each release, predicted from the
/// others.
///
/// A campaign.toml has its releases judged likewise: which effects they need, whether each is there with the wind off
/// (mechanical) or only with it on (aerodynamic), and what it does to the derivatives.
#[derive(Args, Debug, Clone)]
pub struct Diagnose {
    /// Record (CSV: time_s,yaw_deg), several of one rig, or campaign.toml; none: the model's records
    #[arg(value_name = "FILE|campaign.toml")]
    pub files: Vec<PathBuf>,
    /// The model that is there already [default, without a FILE: model.toml]
    #[arg(long, value_name = "MODEL")]
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
    /// Where the formulas of a law that was measured are written, as files that `yawrig add` takes
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Print CSV, a row for each model that was gone through, units in the header
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
}

#[derive(Serialize)]
struct Object<'a> {
    schema_version: u32,
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    seconds: f64,
    /// As `law` prints it.
    #[serde(skip_serializing_if = "Option::is_none")]
    law: Option<serde_json::Value>,
}

impl Diagnose {
    pub fn run(&self) -> Result<()> {
        let own = self.effects.effects()?;
        let options = Options {
            zero_unknown: self.judge.unknown_zero,
            own,
            stop: interrupt::stop(),
            ..Options::default()
        };
        let is_toml =
            |file: &Path| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        let files = self.release.of(&self.files)?;
        if files.len() > 1 {
            return self.run_several(&files, options);
        }
        let asked = self.same_rig || !self.share.is_empty() || !self.own.is_empty();
        if let (true, [file]) = (asked, &files[..]) {
            return Err(Error::usage(format!(
                "--same-rig, --share or --own with {} alone",
                file.display()
            ))
            .help("name the other releases too: yawrig diagnose A.csv B.csv"));
        }
        let file = files.first();
        match (file, &self.model) {
            (Some(file), None) if is_toml(file) && is_model(file) => {
                self.run_beside(file, None, options)
            }
            (Some(file), None) if is_toml(file) => self.run_campaign(file, &options),
            (Some(file), Some(_)) if is_toml(file) => {
                Err(Error::usage("a campaign beside --model")
                    .help("leave --model out: a campaign is judged from a second-order model on"))
            }
            (Some(file), None) => self.judge(file, &options, SECOND_ORDER),
            (file, model) => {
                let model = model.as_deref().unwrap_or(Path::new(DEFAULT));
                self.run_beside(model, file.map(PathBuf::as_path), options)
            }
        }
    }

    /// What the model at `path` lacks, in `file` or its own record.
    fn run_beside(&self, path: &Path, file: Option<&Path>, options: Options) -> Result<()> {
        let model = Model::read(path)?;
        edits::warn(&model, path);
        let fitted: Vec<&RecordEntry> = model.records.iter().filter(|r| !r.held_out).collect();
        for entry in &model.records {
            if let Some(changed) = records::changed(entry, &Model::record_path(path, entry)) {
                crate::say!("yawrig: warning: {changed}");
            }
        }
        let entry = match (file, fitted.as_slice()) {
            (Some(file), _) => records::known_or_new(&model, path, file)?,
            (None, [entry]) => (*entry).clone(),
            (None, all) => {
                let files: Vec<PathBuf> =
                    all.iter().map(|entry| Model::record_path(path, entry)).collect();
                let options = Options {
                    zero_unknown: options.zero_unknown || model.unknown_zero,
                    present: structure(&model)?,
                    ..options
                };
                return self.run_several(&files, options);
            }
        };
        let options = Options {
            stop: interrupt::stop(),
            zero_unknown: options.zero_unknown || model.unknown_zero,
            present: structure(&model)?,
            wind_speed_m_s: entry.made_under.as_ref().map_or(0.0, |m| m.wind_speed_m_s),
            ..options
        };
        self.judge(&Model::record_path(path, &entry), &options, "the present model")
    }

    fn judge(&self, file: &Path, options: &Options, model: &str) -> Result<()> {
        warn_of_more(file);
        let begin = std::time::Instant::now();
        let Diagnosed { diagnosis, decay, .. } =
            diagnose_with_fits(&yawrig_records::read(file)?, options)?;
        for warning in &decay.warnings {
            crate::say!("yawrig: warning: {warning}");
        }
        let seconds = begin.elapsed().as_secs_f64();
        if self.csv {
            return csv::diagnosed(
                &file.display().to_string(),
                &diagnosis.status,
                &diagnosis.steps,
            );
        }
        let found = law_of(file, &diagnosis, options)?;
        let files = match &found {
            Some(found) => law::written(found, self.out.as_deref())?,
            None => Vec::new(),
        };
        if self.judge.json {
            let (schema_version, diagnosis) = (SCHEMA_VERSION, &diagnosis);
            let law = found.as_ref().map(|found| law::object(found, &files));
            return print_json(&Object { schema_version, diagnosis, seconds, law });
        }
        let text = diagnosis_text::of_record(&file.display().to_string(), &diagnosis, model);
        let measure = law::command(&[file.to_path_buf()], false);
        match found.as_ref().and_then(|found| law::in_short(found, &files, &measure)) {
            Some(law) => print_line(&format!("{text}\n\n{law}")),
            None => print_line(&text),
        }
    }

    /// What `files`, releases of one rig, lack.
    fn run_several(&self, files: &[PathBuf], options: Options) -> Result<()> {
        if let Some(file) = files.iter().find(|f| f.extension().is_some_and(|e| e == "toml")) {
            return Err(Error::usage(format!("{} among several records", file.display()))
                .help("give records only, or one campaign.toml alone"));
        }
        let named = |ids: &[String]| ids.iter().map(|id| named(id)).collect::<Result<Vec<_>>>();
        let (shared, own) = (named(&self.share)?, named(&self.own)?);
        if let Some(both) = own.iter().find(|e| shared.contains(e)) {
            return Err(Error::usage(format!("--own {both} and --share {both}"))
                .help("give one of them: by itself a coefficient is common to all"));
        }
        let begin = std::time::Instant::now();
        let common = Common { same_rig: self.same_rig, own };
        let records = files.iter().map(|file| yawrig_records::read(file));
        let records: Vec<_> = records.collect::<Result<_>>()?;
        crate::say!("judging {} releases as one", records.len());
        let diagnosis = &diagnose_several(&records, &common, &options)?;
        for warning in &diagnosis.warnings {
            crate::say!("yawrig: warning: {warning}");
        }
        if self.csv {
            let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
            return csv::diagnosed(&names.join(" "), &diagnosis.status, &diagnosis.steps);
        }
        if self.judge.json {
            let (schema_version, seconds) = (SCHEMA_VERSION, begin.elapsed().as_secs_f64());
            return print_json(&SeveralObject { schema_version, diagnosis, seconds });
        }
        print_line(&diagnosis_text::of_several(diagnosis, name_of(&options.present.effects)))
    }

    fn run_campaign(&self, path: &Path, options: &Options) -> Result<()> {
        let begin = std::time::Instant::now();
        let file = CampaignFile::read_releases(path)?;
        crate::say!("fitting {} releases", file.campaign.release.len());
        let diagnosis = &crate::campaign::diagnose(&file, options)?;
        if self.csv {
            return csv::diagnosed(
                &path.display().to_string(),
                &diagnosis.status,
                &diagnosis.steps,
            );
        }
        if self.judge.json {
            let (schema_version, campaign) = (SCHEMA_VERSION, path);
            let seconds = begin.elapsed().as_secs_f64();
            return print_json(&CampaignObject { schema_version, campaign, diagnosis, seconds });
        }
        print_line(&diagnosis_text::of_campaign(&path.display().to_string(), diagnosis))
    }
}

/// The law of a record of which nothing in the library explains what is missing.
fn law_of(file: &Path, diagnosis: &Diagnosis, options: &Options) -> Result<Option<Found>> {
    if diagnosis.status != Status::Unexplained || !options.present.effects.is_empty() {
        return Ok(None);
    }
    crate::say!("no effect explains it; measuring its law");
    let law = found(&[file.to_path_buf()], true);
    interrupt::check()?;
    if let Err(error) = &law {
        crate::say!("yawrig: warning: no law was measured: {error}");
    }
    Ok(law.ok())
}

#[derive(Serialize)]
struct CampaignObject<'a> {
    schema_version: u32,
    campaign: &'a Path,
    #[serde(flatten)]
    diagnosis: &'a campaign::CampaignDiagnosis,
    seconds: f64,
}

#[derive(Serialize)]
struct SeveralObject<'a> {
    schema_version: u32,
    #[serde(flatten)]
    diagnosis: &'a SeveralDiagnosis,
    seconds: f64,
}
