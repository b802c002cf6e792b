//! What a verb answers about records that a program holds in memory: the object that `--json` prints, and
//! what can be drawn and simulated of it.

use serde::Serialize;
use std::sync::OnceLock;
use yawrig_base::error::{Error, Result};
use yawrig_core::derivatives::table::Table;
use yawrig_core::diagnosis::diagnose::Diagnosed;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_plain_within, Fitted, Limit, Number, Structure};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::record::Record;
use yawrig_model::model_fit::Recorded;
use yawrig_report::charts::{self, Chart};
use yawrig_report::{drawn_of, of_diagnosed, of_table, with_effects};

/// Progress of a verb that works through many records: how many are done, of how many.
pub type Progress<'a> = dyn Fn(usize, usize) + Sync + 'a;

/// A verb's answer.
pub struct Answer {
    /// One JSON object, as `--json` prints it.
    pub json: String,
    /// The verdict.
    pub sentence: String,
    /// What is printed without `--json`, of one record; empty where that is not made.
    pub text: String,
    drawn: Drawn,
    fits: OnceLock<Vec<OfRecord>>,
}

/// What an answer is drawn from.
pub enum Drawn {
    Nothing,
    /// A record, with the natural frequency and damping ratio that were identified.
    Identified(Box<Record>, [f64; 2]),
    Diagnosed(Vec<Record>, Box<Diagnosed>),
    /// Each record with its model.
    Fitted(Vec<OfRecord>),
    Derivatives(Box<Table>),
    /// A record that was made.
    Made(Box<Record>),
}

/// A record and the model that was fitted to it.
pub struct OfRecord {
    /// As the answer names it.
    pub name: String,
    pub decay: FreeDecay,
    pub model: Fitted,
}

impl OfRecord {
    /// Of a model's record.
    pub fn new(recorded: Recorded, model: Fitted) -> Self {
        Self { name: recorded.entry.file, decay: recorded.decay, model }
    }
}

/// A record's name, what was read of it, and its model.
pub type OfOne<'a> = (String, &'a FreeDecay, &'a Fitted);

/// Block means of a record, a fiftieth of a period each, and the model there.
pub struct Curves {
    /// On the record's own clock.
    pub time_s: Vec<f64>,
    pub angle_deg: Vec<f64>,
    pub model_deg: Vec<f64>,
}

impl Answer {
    /// # Errors
    /// Exit 1, for a defect of this program only.
    pub fn new(object: &impl Serialize, sentence: String) -> Result<Self> {
        let json = serde_json::to_string(object)
            .map_err(|e| Error::internal(format!("cannot write JSON: {e}")))?;
        let text = String::new();
        Ok(Self { json, sentence, text, drawn: Drawn::Nothing, fits: OnceLock::new() })
    }

    /// With what is printed.
    pub fn printed(self, text: String) -> Self {
        Self { text, ..self }
    }

    /// With what it is drawn from.
    pub fn drawn_from(self, drawn: Drawn) -> Self {
        Self { drawn, ..self }
    }

    /// The record that was made, where that is the answer.
    pub fn made(&self) -> Option<&Record> {
        match &self.drawn {
            Drawn::Made(record) => Some(record),
            _ => None,
        }
    }

    /// Of `diagnose` about records.
    pub fn diagnosed(&self) -> Option<&Diagnosed> {
        match &self.drawn {
            Drawn::Diagnosed(_, diagnosed) => Some(diagnosed),
            _ => None,
        }
    }

    /// The records with their models; none where the answer has no one model of a record.
    ///
    /// # Errors
    /// Exit 3 where a record that was identified has too little in it for a fit.
    pub fn fits(&self) -> Result<Vec<OfOne<'_>>> {
        fn each(all: &[OfRecord]) -> Vec<OfOne<'_>> {
            all.iter().map(|r| (r.name.clone(), &r.decay, &r.model)).collect()
        }
        Ok(match &self.drawn {
            Drawn::Diagnosed(records, diagnosed) => {
                let of = |(i, record): (usize, &Record)| {
                    (record.name(), &diagnosed.decays[i], diagnosed.last(i))
                };
                records.iter().enumerate().map(of).collect()
            }
            Drawn::Fitted(all) => each(all),
            Drawn::Identified(record, values) => {
                if self.fits.get().is_none() {
                    // Another thread may have been quicker, with the same.
                    let _ = self.fits.set(vec![held(record, *values)?]);
                }
                self.fits.get().map_or_else(Vec::new, |all| each(all))
            }
            Drawn::Nothing | Drawn::Derivatives(_) | Drawn::Made(_) => Vec::new(),
        })
    }

    /// What is random in the answer, and in no model of a record.
    pub fn random(&self) -> Option<&Effect> {
        match &self.drawn {
            Drawn::Diagnosed(_, found) => found.diagnosis.effects.iter().find(|e| e.is_random()),
            _ => None,
        }
    }

    /// The pictures of a report's page, each an SVG of its own with its caption.
    ///
    /// # Errors
    /// As [`Self::fits`].
    pub fn pictures(&self) -> Result<Vec<(String, String)>> {
        let charts = match &self.drawn {
            Drawn::Nothing | Drawn::Made(_) => Vec::new(),
            Drawn::Diagnosed(records, found) if records.len() == 1 => {
                charts::of(&of_diagnosed(&records[0], found))
            }
            Drawn::Derivatives(table) => charts::of(&of_table(table)),
            Drawn::Identified(..) | Drawn::Diagnosed(..) | Drawn::Fitted(_) => {
                let of = |(_, decay, model): OfOne| {
                    drawn_of(decay, &[(with_effects(model).as_str(), model)])
                };
                self.fits()?.into_iter().flat_map(of).collect()
            }
        };
        let file = |chart: Chart| Ok((chart.file()?, chart.caption));
        charts.into_iter().map(file).collect()
    }
}

/// The second-order model with these values; the record's own initial state is fitted.
fn held(record: &Record, [natural_frequency_rad_s, damping_ratio]: [f64; 2]) -> Result<OfRecord> {
    let decay = FreeDecay::from_record(record)?;
    let fixed = |number, value| Limit { number, low: value, high: value };
    let structure = Structure {
        limits: vec![
            fixed(Number::NaturalFrequency, natural_frequency_rad_s),
            fixed(Number::DampingRatio, damping_ratio),
        ],
        ..Structure::default()
    };
    let model = fit_plain_within(&decay, &structure, decay.yaw_rad.len());
    Ok(OfRecord { name: record.file.display().to_string(), decay, model })
}

/// The means of `decay` and what `model` makes of them.
pub fn curves(decay: &FreeDecay, model: &Fitted) -> Curves {
    let degrees = |rad: &[f64]| rad.iter().map(|y| decay.measurand.shown(*y)).collect();
    let time_s = |k| decay.release_time_s + decay.grid.time_s(k);
    Curves {
        time_s: (0..decay.yaw_rad.len()).map(time_s).collect(),
        angle_deg: degrees(&decay.yaw_rad),
        model_deg: degrees(&model.readings(&decay.grid)),
    }
}
