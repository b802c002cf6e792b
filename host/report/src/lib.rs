//! The report: what is known of records, a campaign, a model or a demo as plain structs, which `--json`
//! prints and the page holds; [`html`] makes the page of them and [`charts`] its drawings, by [`plot`].
#![forbid(unsafe_code)]

mod answer;
mod beside;
pub mod channels;
pub mod charts;
mod conditions;
mod critical;
mod criticism;
pub mod data;
pub mod drawn;
mod escape;
pub mod html;
mod of_campaign;
mod of_model;
mod of_models;
mod of_records;
pub mod panels;
pub mod plot;
mod sections;
mod table;
pub mod trace;
mod transfer;
mod trust;
pub mod units;
pub mod view;
pub mod xlsx;

pub use answer::Answer;
pub use of_campaign::{of_campaign, of_table, Also};
pub use of_model::of_model;
pub use of_models::of_models;
pub use of_records::{drawn_of, of_diagnosed, of_records, with_effects};
pub use transfer::transfer;

use serde::{Deserialize, Serialize};
use std::path::Path;
use trace::Trace;
use yawrig_base::clock;
use yawrig_base::error::{Error, Result};
use yawrig_core::derivatives::at::At;
use yawrig_core::derivatives::critical::CriticalSpeed;
use yawrig_core::derivatives::plausible::Doubt;
use yawrig_core::derivatives::table::{PointBudget, SpringRow};
use yawrig_core::diagnosis::amplitude::AmplitudePicture;
use yawrig_core::diagnosis::compare::Where;
use yawrig_core::identify::AtAmplitude;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Said;
use yawrig_records::{content, content_when_read, Content};
use yawrig_shared::axis::Axis;

pub const SCHEMA_VERSION: u32 = 1;
/// Largest page, bytes.
pub const MAX_BYTES: usize = 5_000_000;
/// Numbers of all traces: two megabytes.
pub const TRACE_NUMBERS: usize = 250_000;

/// What a report is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Records,
    Campaign,
    Model,
    Demo,
}

/// All of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub schema_version: u32,
    pub kind: Kind,
    pub title: String,
    pub made: Made,
    pub settings: Vec<SettingRow>,
    pub sources: Vec<SourceFile>,
    /// One sentence.
    pub verdict: String,
    /// What could make it wrong.
    #[serde(default)]
    pub doubts: Vec<Doubt>,
    /// Entries of a campaign left out, whose uncertainty is taken as zero.
    #[serde(default)]
    pub assumed_zero: Vec<String>,
    pub inertia_kg_m2: Vec<(Axis, Quantity)>,
    #[serde(default)]
    pub springs: Vec<SpringRow>,
    pub points: Vec<PointReport>,
    /// Another campaign's, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beside: Option<Beside>,
    /// The same points before effects were added, where there are any.
    pub points_before: Vec<PointReport>,
    /// Where the model swings by itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub critical_speed: Vec<CriticalSpeed>,
    pub criticism: Option<Criticism>,
    pub journal: Vec<JournalRow>,
    pub releases: Vec<ReleaseReport>,
    pub training: Option<TrainingReport>,
    /// Where it is about several models.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sides: Vec<SideReport>,
    pub notes: Vec<String>,
}

/// One of several models of the same records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SideReport {
    pub model: String,
    pub effects: Vec<String>,
    /// Numbers that were fitted.
    pub numbers: usize,
    pub residual_rms_deg: f64,
    pub residual_over_noise: f64,
    pub held_out_over_noise: Option<f64>,
    /// Difference of BIC in favour of this model against the first.
    pub bic_gain: f64,
    pub parameters: Vec<(String, Quantity)>,
}

/// Who made it, when and how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Made {
    /// Name and version.
    pub program: String,
    /// As it was typed.
    pub command: String,
    /// RFC 3339, to the second.
    pub time_utc: String,
}

impl Made {
    /// Now, by `command`.
    pub fn now(command: String) -> Self {
        Self {
            program: format!("yawrig {}", env!("CARGO_PKG_VERSION")),
            command,
            time_utc: humantime::format_rfc3339_seconds(clock::now()).to_string(),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingRow {
    pub name: String,
    pub value: String,
    pub unit: String,
}

impl SettingRow {
    pub fn new(name: &str, value: impl ToString, unit: &str) -> Self {
        Self { name: name.to_owned(), value: value.to_string(), unit: unit.to_owned() }
    }
}

/// A file that was read, with its checksum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceFile {
    pub file: String,
    pub bytes: usize,
    pub crc32: String,
}

impl SourceFile {
    /// # Errors
    /// Exit 3 where it cannot be read.
    pub fn new(file: &Path) -> Result<Self> {
        let content = content_when_read(file).or_else(|| content(file)).ok_or_else(|| {
            Error::data(format!("cannot read {}", file.display()))
                .help("see to it that you may read it")
        })?;
        let Content { bytes, crc32 } = content;
        Ok(Self { file: file.display().to_string(), bytes, crc32 })
    }
}

/// The derivatives on one spring at one wind speed, per radian, `cn_*` at the middle axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointReport {
    pub spring: String,
    pub wind_speed_m_s: f64,
    pub reduced_frequency: f64,
    #[serde(default, skip_serializing_if = "At::is_empty")]
    pub at: At,
    pub cn_beta: Quantity,
    /// Combined: Cn_r - Cn_betadot.
    pub cn_r: Quantity,
    pub cy_beta: Option<Quantity>,
    pub cy_r: Option<Quantity>,
    /// Planted; cn_beta, cn_r, cy_beta, cy_r.
    pub truth: Option<[f64; 4]>,
    /// What the uncertainties are made of.
    #[serde(default)]
    pub budget: Option<PointBudget>,
}

impl From<&yawrig_core::derivatives::table::Point> for PointReport {
    fn from(p: &yawrig_core::derivatives::table::Point) -> Self {
        Self {
            spring: p.spring.clone(),
            wind_speed_m_s: p.wind_speed_m_s,
            reduced_frequency: p.reduced_frequency,
            at: p.at.clone(),
            cn_beta: p.cn_beta,
            cn_r: p.cn_r,
            cy_beta: p.cy_beta,
            cy_r: p.cy_r,
            truth: None,
            budget: Some(p.budget),
        }
    }
}

/// What another campaign has found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Beside {
    /// Its model and file.
    pub name: String,
    pub points: Vec<PointReport>,
}

/// One release, recorded or made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReleaseReport {
    /// The record's file, or what the release was made under.
    pub name: String,
    /// What a campaign says that it was made under.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<String>,
    pub held_out: bool,
    pub samples: usize,
    pub rate_hz: f64,
    pub noise_rms_deg: Option<f64>,
    /// What was recorded, where that is no angle in deg.
    #[serde(default, skip_serializing_if = "Said::is_none")]
    pub said: Said,
    /// Of the models in `trace`, in their order.
    pub residual_over_noise: Vec<f64>,
    pub estimates: Vec<Estimate>,
    /// Natural frequency, rad/s, and damping ratio that were planted.
    pub truth: Option<[f64; 2]>,
    pub trace: Option<Trace>,
    pub amplitude: Option<AmplitudePicture>,
    /// Of the last model in `trace`, or of what was identified, from the largest amplitude to the smallest.
    #[serde(default)]
    pub at_amplitude: Vec<AtAmplitude>,
    /// What is to be taken from it, where it was diagnosed or is a model's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<Answer>,
    /// Its own diagnosis, where one was made.
    pub criticism: Option<Criticism>,
}

/// One method's answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    pub method: String,
    pub natural_frequency_rad_s: Quantity,
    pub damping_ratio: Quantity,
    pub residual_rms_deg: Option<f64>,
    /// Of a second-order model with these values; none where the release's last model is meant.
    #[serde(default)]
    pub residual_over_noise: Option<f64>,
    /// Of a second-order model, which the diagnosis refuses.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub refused: bool,
    /// Remarks.
    pub remarks: Vec<String>,
}

/// What a second-order model lacks, and what was done about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Criticism {
    /// What was recorded, where that is no angle in deg.
    #[serde(default, skip_serializing_if = "Said::is_none")]
    pub said: Said,
    /// `adequate`, `explained`, `mostly_explained` or `unexplained`; none for a model's journal.
    pub status: Option<String>,
    /// What the effects account for and what is left; which were refused, and why.
    pub sentences: Vec<String>,
    pub steps: Vec<StaircaseStep>,
    /// What was held out for `held_out_over_noise`.
    pub held_out: String,
    pub candidates: Vec<CandidateRow>,
    pub effects: Vec<EffectFound>,
    pub indistinguishable: Vec<[String; 2]>,
    /// Where the models named fail, on the record named.
    pub wheres: Vec<(String, Where)>,
    pub where_file: String,
}

/// One step of the staircase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StaircaseStep {
    /// `second order`, `+ coulomb_friction`, `- free_play`.
    pub name: String,
    pub residual_rms_deg: f64,
    pub residual_over_noise: f64,
    pub held_out_over_noise: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CandidateRow {
    pub effect: String,
    pub residual_over_noise: f64,
    pub evidence: f64,
    pub converged: bool,
}

/// An effect of the model, with its card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectFound {
    pub id: String,
    pub title: String,
    pub formula: String,
    pub parameters: Vec<ParameterRow>,
    /// `mechanical`, `aerodynamic` or `undecided`, and why; of a campaign only.
    pub origin: Option<[String; 2]>,
    pub cause: String,
    pub fingerprint: String,
    pub confirm: String,
    pub remove: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterRow {
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// None: taken as known, or not computable.
    pub u: Option<f64>,
}

/// A step of a model's journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournalRow {
    pub step: usize,
    pub time_utc: String,
    pub what: String,
    pub command: String,
    pub why: String,
    pub residual_over_noise: Option<f64>,
    pub held_out_over_noise: Option<f64>,
}

/// How a network was trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingReport {
    pub topology: String,
    pub samples: usize,
    pub epochs: usize,
    pub stopped: String,
    /// Of natural frequency and damping ratio, percent, on windows that were not trained on.
    pub test_rms_percent: [f64; 2],
    pub history: Vec<Epoch>,
    /// Not of every epoch; empty in files of earlier versions.
    #[serde(default)]
    pub held_out: Vec<HeldOut>,
}

/// As [`Epoch`]'s, over windows that were not trained on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    pub epoch: usize,
    pub natural_frequency_rms: f64,
    pub damping_ratio_rms: f64,
}

/// Errors are rms over the training windows, in scaled units: an output goes from -1 to 1 over its range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    pub epoch: usize,
    pub natural_frequency_rms: f64,
    pub damping_ratio_rms: f64,
    /// Effective number of parameters.
    pub effective_parameters: f64,
}

impl Report {
    /// With nothing in it yet.
    pub fn new(kind: Kind, title: String, made: Made) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            kind,
            title,
            made,
            settings: Vec::new(),
            sources: Vec::new(),
            verdict: String::new(),
            doubts: Vec::new(),
            assumed_zero: Vec::new(),
            springs: Vec::new(),
            inertia_kg_m2: Vec::new(),
            points: Vec::new(),
            points_before: Vec::new(),
            critical_speed: Vec::new(),
            beside: None,
            criticism: None,
            journal: Vec::new(),
            releases: Vec::new(),
            training: None,
            sides: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// As `--json` prints it and the page holds it.
    ///
    /// # Errors
    /// Exit 1, for a defect of this program only.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string(self)
            .map_err(|e| Error::internal(format!("cannot write the report's data: {e}")))
    }
}
