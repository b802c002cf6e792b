//! `diagnose`: which physical effect a second-order model of a record, or of a campaign's, lacks.

use super::common::{print_json, print_line, EffectsArg, SCHEMA_VERSION};
use super::diagnosis_text;
use super::model::{JudgeArgs, DEFAULT};
use crate::campaign::CampaignFile;
use crate::model::document::{is_model, Model, RecordEntry};
use crate::model::limits::structure;
use crate::model::records;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::diagnosis::campaign;
use yawrig_core::diagnosis::diagnose::{
    diagnose_with_fits, Diagnosed, Diagnosis, Options, SECOND_ORDER,
};

/// Which physical effect a second-order model of a record lacks.
///
/// Every effect of the library is fitted, alone and in combination. Near the noise it is judged by evidence; where more
/// than noise is left, by the prediction of parts of the record that were not fitted, and what is left is said. A reading
/// at rest that is not zero counts as a constant moment unless --unknown-zero
/// says that the sensor was not zeroed. Your own effect, a moment written as an expression in a file, competes with them
/// when --effect names it.
///
/// With --model the present model's effects stay, and what it lacks beside them is looked for; without a FILE in the
/// model's own record.
///
/// A campaign.toml has all its releases judged by one joint fit: which effects they need, whether each is there with the wind
/// off (mechanical) or only with it on (aerodynamic), and what it does to the derivatives.
#[derive(Args, Debug, Clone)]
pub struct Diagnose {
    /// Record (CSV: time_s,yaw_deg), or campaign.toml; none: the model's record
    #[arg(value_name = "FILE|campaign.toml")]
    pub file: Option<PathBuf>,
    /// The model that is there already [default, without a FILE: model.toml]
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    #[command(flatten)]
    pub effects: EffectsArg,
    #[command(flatten)]
    pub judge: JudgeArgs,
}

#[derive(Serialize)]
struct Object<'a> {
    schema_version: u32,
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    seconds: f64,
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
        match (&self.file, &self.model) {
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
                self.run_beside(model, file.as_deref(), options)
            }
        }
    }

    /// What the model at `path` lacks, in `file` or its own record.
    fn run_beside(&self, path: &Path, file: Option<&Path>, options: Options) -> Result<()> {
        let model = Model::read(path)?;
        let fitted: Vec<&RecordEntry> = model.records.iter().filter(|r| !r.held_out).collect();
        let entry = match (file, fitted.as_slice()) {
            (Some(file), _) => records::known_or_new(&model, path, file)?,
            (None, [entry]) => (*entry).clone(),
            (None, all) => {
                return Err(Error::usage(format!(
                    "{} is about {} fitted records",
                    path.display(),
                    all.len()
                ))
                .help("name one: yawrig diagnose RECORD.csv --model MODEL"))
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
        let begin = std::time::Instant::now();
        let Diagnosed { diagnosis, swing, .. } =
            diagnose_with_fits(&yawrig_records::read(file)?, options)?;
        for warning in &swing.warnings {
            crate::say!("yawrig: warning: {warning}");
        }
        let seconds = begin.elapsed().as_secs_f64();
        if self.judge.json {
            let schema_version = SCHEMA_VERSION;
            return print_json(&Object { schema_version, diagnosis: &diagnosis, seconds });
        }
        print_line(&diagnosis_text::of_record(&file.display().to_string(), &diagnosis, model))
    }

    fn run_campaign(&self, path: &Path, options: &Options) -> Result<()> {
        let file = CampaignFile::read_releases(path)?;
        crate::say!("fitting {} releases", file.campaign.release.len());
        let diagnosis = &crate::campaign::diagnose(&file, options)?;
        if self.judge.json {
            let (schema_version, campaign) = (SCHEMA_VERSION, path);
            return print_json(&CampaignObject { schema_version, campaign, diagnosis });
        }
        print_line(&diagnosis_text::of_campaign(&path.display().to_string(), diagnosis))
    }
}

#[derive(Serialize)]
struct CampaignObject<'a> {
    schema_version: u32,
    campaign: &'a Path,
    #[serde(flatten)]
    diagnosis: &'a campaign::CampaignDiagnosis,
}
