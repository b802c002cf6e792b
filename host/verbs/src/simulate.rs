//! `simulate`: records of a virtual rig whose truth is known.

use super::choices;
use super::common::{bare, print_json, print_line, within};
use super::simulated::{
    campaign_json, condition_json, effect_ids, effect_parameters, points, Seen,
};
use crate::answer::{Answer, Drawn};
use clap::{Args, ValueEnum};
use serde_json::{json, Value};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_campaign::simulated::{self, refuse_existing, Planned};
use yawrig_core::record::{Derivative, Measurand, Record};
use yawrig_records::{as_written, write_samples_of};
use yawrig_rig::{
    kinds, Condition, Effect, Effects, End, Rig, Sample, Samples, Sensor, Spring, Start, LIBRARY,
};
use yawrig_shared::axis::Axis;
use yawrig_shared::derivatives::{reduced_frequency, YawDerivatives};
use yawrig_shared::modal::Modal;

/// Write records of a virtual rig, its truth printed beside them.
///
/// One record: give --natural-frequency and --damping, or --spring with --wind and --axis, and --out.
/// A whole campaign (eight springs, both axes, wind off and on): give --campaign FOLDER.
#[derive(Args, Debug, Clone)]
#[command(after_long_help = effects_help(), after_help = effects_help())]
pub struct Simulate {
    /// Where the record goes (CSV)
    #[arg(
        short,
        long,
        value_name = "FILE",
        conflicts_with = "campaign",
        required_unless_present = "campaign"
    )]
    pub out: Option<PathBuf>,
    /// Write a campaign, campaign.toml and all records, into this folder
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["natural_frequency", "spring", "axis"])]
    pub campaign: Option<PathBuf>,
    /// Releases of each condition of a campaign
    #[arg(long, default_value_t = 1, requires = "campaign", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeats: u32,
    /// Natural frequency of one record, rad/s
    #[arg(long, value_name = "RAD_S", requires = "damping", conflicts_with_all = ["spring", "wind", "axis"], allow_negative_numbers = true)]
    pub natural_frequency: Option<f64>,
    /// Damping ratio of one record; zero or negative: self-excited
    #[arg(
        long,
        value_name = "ZETA",
        requires = "natural_frequency",
        allow_negative_numbers = true
    )]
    pub damping: Option<f64>,
    /// Spring of one record, K1 to K8
    #[arg(long, required_unless_present_any = ["campaign", "natural_frequency"])]
    pub spring: Option<String>,
    /// Wind speed, m/s; 0: off [default: 0 for one record, 10 for a campaign]
    #[arg(long, value_name = "M_S", allow_negative_numbers = true)]
    pub wind: Option<f64>,
    /// Axis the model turns about
    #[arg(long, value_parser = choices::axis(), default_value_t = Axis::Mid)]
    pub axis: Axis,
    /// What the sensor sees of one record's motion: of a rate or an acceleration, noise, offset and converter
    /// are in deg/s or deg/s2
    #[arg(long, value_enum, default_value_t = Sees::Angle, conflicts_with = "campaign")]
    pub quantity: Sees,
    /// Angle the model is released from
    #[arg(long, value_name = "DEG", default_value_t = 15.0, allow_negative_numbers = true)]
    pub amplitude_deg: f64,
    /// Rms of the sensor's noise
    #[arg(long, value_name = "DEG", default_value_t = 0.05, allow_negative_numbers = true)]
    pub noise_deg: f64,
    /// Correlation of the noise from one sample to the next; 0: white
    #[arg(long, value_name = "RHO", default_value_t = 0.0, allow_negative_numbers = true)]
    pub noise_correlation: f64,
    /// Reading of the sensor with the model at rest
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub offset_deg: f64,
    /// One count of the 16-bit converter; 0: no converter
    #[arg(long, value_name = "DEG", default_value_t = 0.005, allow_negative_numbers = true)]
    pub adc_step_deg: f64,
    /// Sampling rate
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, allow_negative_numbers = true)]
    pub rate_hz: f64,
    /// How long the model is held before it is released
    #[arg(long, value_name = "S", default_value_t = 2.0, allow_negative_numbers = true)]
    pub hold_s: f64,
    /// Hide an effect, ID:NAME=VALUE,NAME=VALUE; your own by its file, FILE.toml:NAME=VALUE; repeatable, see
    /// the list below
    #[arg(long = "effect", value_name = "EFFECT")]
    pub effects: Vec<String>,
    /// Effects act with the wind on only, as aerodynamic ones do [default: in every release]
    #[arg(long, requires_all = ["campaign", "effects"])]
    pub aerodynamic: bool,
    /// Length of the record [default: until the oscillation is below 0.8 deg]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub seconds: Option<f64>,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Print one JSON object
    #[arg(short, long)]
    pub json: bool,
}

/// What a sensor sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sees {
    /// A potentiometer's.
    Angle,
    /// A gyroscope's.
    Rate,
    Acceleration,
}

impl From<Sees> for yawrig_rig::Sees {
    fn from(chosen: Sees) -> Self {
        match chosen {
            Sees::Angle => Self::Angle,
            Sees::Rate => Self::Rate,
            Sees::Acceleration => Self::Acceleration,
        }
    }
}

impl Simulate {
    fn measurand(&self) -> Measurand {
        Measurand::angular(match self.quantity {
            Sees::Angle => Derivative::None,
            Sees::Rate => Derivative::Rate,
            Sees::Acceleration => Derivative::Acceleration,
        })
    }

    pub fn run(&self) -> Result<()> {
        let (sensor, start, effects) = (self.sensor()?, self.start()?, self.effects()?);
        match (&self.campaign, &self.out) {
            (Some(folder), _) => self.write_campaign(folder, &effects, &sensor, &start),
            (None, Some(file)) => self.write_record(file, &effects, &sensor, &start),
            (None, None) => Err(Error::usage("neither --out nor --campaign is given")),
        }
    }

    fn effects(&self) -> Result<Effects> {
        let effects = self.effects.iter().map(|text| text.parse());
        Ok(Effects::new(effects.collect::<yawrig_rig::Result<Vec<Effect>>>()?)?)
    }

    fn sensor(&self) -> Result<Sensor> {
        within("--rate-hz", self.rate_hz, 20.0, 10_000.0)?;
        within("--noise-deg", self.noise_deg, 0.0, 90.0)?;
        within("--noise-correlation", self.noise_correlation, -0.999_999, 0.999_999)?;
        within("--adc-step-deg", self.adc_step_deg, 0.0, 10.0)?;
        within("--offset-deg", self.offset_deg, -360.0, 360.0)?;
        Ok(Sensor {
            sees: self.quantity.into(),
            rate_hz: self.rate_hz,
            noise_deg: self.noise_deg,
            noise_correlation: self.noise_correlation,
            offset_deg: self.offset_deg,
            adc_step_deg: self.adc_step_deg,
        })
    }

    fn start(&self) -> Result<Start> {
        let standard = Start::default();
        within("--amplitude-deg", self.amplitude_deg, -180.0, 180.0)?;
        within("--hold-s", self.hold_s, 0.0, 3600.0)?;
        let end = match (self.seconds, standard.end) {
            (Some(seconds), _) => {
                within("--seconds", seconds, 0.1, 86_400.0)?;
                End::After(seconds)
            }
            (None, End::Below { amplitude_deg, .. })
                if self.amplitude_deg.abs() <= amplitude_deg =>
            {
                return Err(Error::usage(format!(
                    "--amplitude-deg {}: a record ends below {amplitude_deg} deg",
                    self.amplitude_deg
                ))
                .help("release from a larger angle, or say how long with --seconds"));
            }
            (None, end) => end,
        };
        Ok(Start { amplitude_deg: self.amplitude_deg, hold_s: self.hold_s, end })
    }

    /// What one record is made of; the condition where it is one of the rig's.
    fn subject(&self, rig: &Rig) -> Result<(Modal, Option<Condition>)> {
        if let (Some(natural_frequency_rad_s), Some(damping_ratio)) =
            (self.natural_frequency, self.damping)
        {
            within("--natural-frequency", natural_frequency_rad_s, 1e-3, 1e4)?;
            within("--damping", damping_ratio, -0.99, 0.99)?;
            return Ok((Modal { natural_frequency_rad_s, damping_ratio }, None));
        }
        let name = self.spring.as_deref().ok_or_else(|| Error::usage("--spring is missing"))?;
        let wind_speed_m_s = self.wind.unwrap_or(0.0);
        within("--wind", wind_speed_m_s, 0.0, 300.0)?;
        let condition = Condition { spring: Spring::named(name)?, axis: self.axis, wind_speed_m_s };
        Ok((rig.modal(&condition)?, Some(condition)))
    }

    fn write_record(
        &self,
        file: &Path,
        effects: &Effects,
        sensor: &Sensor,
        start: &Start,
    ) -> Result<()> {
        let made = self.made(effects, sensor, start)?;
        if !self.force {
            refuse_existing(file)?;
        }
        let mut seen = Seen::default();
        let samples = self.samples(&made)?;
        write_samples_of(file, &self.measurand(), samples.map(|sample| seen.of(sample)))?;
        seen.warn();
        if self.json {
            return print_json(&self.object(file, &made, &seen));
        }
        let Made { truth, effects, derivatives, .. } = &made;
        let mut text = format!(
            "{}: {} samples, {:.3} s\nnatural frequency  {:.6} rad/s\ndamping ratio      {:.7}\n",
            file.display(),
            seen.samples,
            seen.last_s,
            truth.natural_frequency_rad_s,
            truth.damping_ratio
        );
        for effect in effects.iter() {
            text += &format!("hidden effect      {effect}\n");
        }
        if let Some(d) = derivatives {
            text += &format!(
                "Cn_beta            {:.4} per rad, about this axis\nCn_r - Cn_betadot  {:.4} per rad, about this axis\n",
                d.cn_beta, d.cn_r
            );
        }
        print_line(text.trim_end())
    }

    /// The record in memory, or, with --campaign, what was written.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self) -> Result<Answer> {
        let (sensor, start, effects) = (self.sensor()?, self.start()?, self.effects()?);
        let Some(file) = &self.out else {
            let folder = self.campaign.as_deref().unwrap_or(Path::new(""));
            let (rig, file, planned) = self.campaign_made(folder, &effects, &sensor, &start)?;
            let sentence = format!("{}: {} releases", file.display(), planned.len());
            return Answer::new(&campaign_json(&rig, &file, &planned), sentence);
        };
        let made = self.made(&effects, &sensor, &start)?;
        let mut seen = Seen::default();
        let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
        for (row, sample) in self.samples(&made)?.enumerate() {
            let (t, yaw) = as_written(seen.of(sample));
            time_s.push(t);
            yaw_deg.push(yaw);
            if row % ROWS_PER_CHECK == 0 {
                interrupt::check()?;
            }
        }
        seen.warn();
        let Modal { natural_frequency_rad_s: wn, damping_ratio: zeta } = made.truth;
        let sentence = format!("natural frequency {wn:.6} rad/s, damping ratio {zeta:.7}");
        let mut record = Record::new(file, time_s, yaw_deg);
        record.measurand = self.measurand();
        Ok(Answer::new(&self.object(file, &made, &seen), sentence)?
            .drawn_from(Drawn::Made(Box::new(record))))
    }

    fn made(&self, effects: &Effects, sensor: &Sensor, start: &Start) -> Result<Made> {
        let rig = Rig::default();
        let (truth, condition) = self.subject(&rig)?;
        if 2.0 * truth.damped_frequency_hz() >= sensor.rate_hz {
            return Err(Error::usage(format!(
                "--rate-hz {}: an oscillation at {:.3} Hz needs more than two samples a cycle",
                sensor.rate_hz,
                truth.damped_frequency_hz()
            ))
            .help("sample faster"));
        }
        let effects = effects.clone().in_wind(condition.map_or(0.0, |c| c.wind_speed_m_s));
        let start = start.limited(&truth, &effects);
        let derivatives = condition
            .filter(|condition| condition.wind_speed_m_s > 0.0)
            .map(|condition| rig.derivatives(&condition.spring, condition.axis));
        Ok(Made { truth, condition, effects, start, sensor: *sensor, derivatives })
    }

    fn samples(&self, made: &Made) -> Result<impl Iterator<Item = Sample>> {
        let Made { truth, effects, start, sensor, .. } = made;
        Ok(Samples::with_effects(truth, effects, start, sensor, self.seed)?)
    }

    fn object(&self, file: &Path, made: &Made, seen: &Seen) -> Value {
        let Made { truth, condition, effects, start, sensor, derivatives } = made;
        json!({
            "schema_version": 1,
            "file": file,
            "samples": seen.samples,
            "seconds": seen.last_s,
            "rate_hz": sensor.rate_hz,
            "release_time_s": start.hold_s,
            "seed": self.seed,
            "condition": condition.map(|c| condition_json(&c)),
            "truth": {
                "natural_frequency_rad_s": truth.natural_frequency_rad_s,
                "damping_ratio": truth.damping_ratio,
                "amplitude_deg": start.amplitude_deg,
                "offset_deg": sensor.offset_deg,
                "noise_rms_deg": sensor.noise_deg,
                "cn_beta": derivatives.map(|d| d.cn_beta),
                "cn_r": derivatives.map(|d| d.cn_r),
                "effects": effect_ids(effects),
                "parameters": effect_parameters(effects),
            },
        })
    }

    fn write_campaign(
        &self,
        folder: &Path,
        effects: &Effects,
        sensor: &Sensor,
        start: &Start,
    ) -> Result<()> {
        let (rig, file, planned) = self.campaign_made(folder, effects, sensor, start)?;
        if self.json {
            return print_json(&campaign_json(&rig, &file, &planned));
        }
        let mut rows = bare(&["spring", "km", "Cn_beta", "Cn_r-Cn_betadot", "Cy_beta", "Cy_r"]);
        for (condition, modal) in points(&planned) {
            let truth = rig.truth(&condition.spring);
            let km = reduced_frequency(modal, &rig.wind(condition.wind_speed_m_s), &rig.model);
            let derivatives = [truth.cn_beta, truth.cn_r, truth.cy_beta, truth.cy_r];
            let cells = [condition.spring.name.to_owned(), format!("{km:.3}")];
            rows.add_row(cells.into_iter().chain(derivatives.map(|d| format!("{d:.4}"))));
        }
        let made = format!("{}: {} releases", file.display(), planned.len());
        print_line(&format!("{made}\n{}", rows.trim_fmt()))
    }

    /// Writes a campaign; its rig, its file and what it is of.
    fn campaign_made(
        &self,
        folder: &Path,
        effects: &Effects,
        sensor: &Sensor,
        start: &Start,
    ) -> Result<(Rig, PathBuf, Vec<Planned>)> {
        let rig = Rig::default();
        let wind_speed_m_s = self.wind.unwrap_or(10.0);
        within("--wind", wind_speed_m_s, 0.1, 300.0)?;
        let mut planned = simulated::plan(&rig, wind_speed_m_s, self.repeats, self.seed)?;
        for record in &mut planned {
            if !self.aerodynamic || record.condition.wind_speed_m_s > 0.0 {
                record.effects = effects.clone();
            }
        }
        yawrig_base::say!("writing {} records to {}", planned.len(), folder.display());
        let file = simulated::write(folder, &rig, &planned, start, sensor, self.force)?;
        Ok((rig, file, planned))
    }
}

/// Samples between two looks for a request to stop.
const ROWS_PER_CHECK: usize = 10_000;

/// What one record is made of.
struct Made {
    truth: Modal,
    condition: Option<Condition>,
    effects: Effects,
    start: Start,
    sensor: Sensor,
    derivatives: Option<YawDerivatives>,
}

/// The library as `--help` shows it.
fn effects_help() -> String {
    let mut text = "Effects, torques over the inertia, b yaw angle (rad), r yaw rate (rad/s), t from the release (s):\n".to_owned();
    for kind in kinds() {
        let parameters: Vec<String> =
            kind.parameters.iter().map(|p| format!("{} ({})", p.name, p.unit)).collect();
        text +=
            &format!("  {:20} {}\n  {:20}   {}\n", kind.id, kind.term, "", parameters.join(", "));
    }
    let examples = LIBRARY.iter().map(|kind| format!(" --effect {}:{}", kind.id, kind.example));
    text + "\nExample:" + &examples.take(2).collect::<String>()
}
