//! What is seen of one release: the record, a model fitted to it or held against it, and where they part.

use crate::drawn::Series;
use rayon::prelude::*;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::diagnosis::amplitude::{self, AmplitudePicture};
use yawrig_core::diagnosis::compare::{locate, Where};
use yawrig_core::diagnosis::diagnose::{self, Diagnosed, Modal, Options};
use yawrig_core::diagnosis::search;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_added, fit_plain_within, Fitted, Structure};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::motion::simulate::Grid;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Record;
use yawrig_model::document::{Model, RecordEntry};
use yawrig_model::limits::structure;
use yawrig_model::model_fit::{held_against, modal_of, Recorded};
use yawrig_model::records;
use yawrig_records::Selection;

/// Points of a drawn model between two of the fit's.
const FINER: usize = 4;

/// A record as it was read.
#[derive(Debug)]
pub struct Loaded {
    pub record: Record,
    /// What it is cut from, where it is what lies between two times of another.
    pub whole: Option<Record>,
    /// Its free decay, or why there is none.
    pub decay: std::result::Result<FreeDecay, Error>,
}

impl Loaded {
    /// # Errors
    /// Those of [`yawrig_records::read_selected`].
    pub fn read(
        path: &Path,
        origin: &Path,
        reading: &Selection,
        wind_speed_m_s: f64,
    ) -> Result<Self> {
        let record = yawrig_records::read_selected(path, reading)?;
        let mut decay = FreeDecay::from_record(&record);
        if let Ok(decay) = &mut decay {
            decay.wind_speed_m_s = wind_speed_m_s;
        }
        let is_cut = path != origin;
        let whole = is_cut.then(|| yawrig_records::read_selected(origin, reading)).transpose()?;
        Ok(Self { record, whole, decay: decay.map_err(Error::from) })
    }

    pub fn recorded(&self, entry: &RecordEntry) -> Result<Recorded> {
        let mut decay = self.decay.clone()?;
        decay.stop = interrupt::stop();
        let path = self.record.file.clone();
        let changed = records::changed(entry, &path);
        Ok(Recorded { entry: entry.clone(), path, decay, changed })
    }
}

/// A model's curves. Times on the record's clock, angles in deg.
#[derive(Debug)]
pub struct Curves {
    pub model: Series,
    /// Measured less model, means over a fiftieth of a period.
    pub residual: Series,
}

impl Curves {
    fn new(decay: &FreeDecay, fitted: &Fitted) -> Self {
        let grid = decay.grid;
        let finer = FINER.min(decay.block.max(1));
        let fine = Grid {
            step_s: grid.step_s / finer as f64,
            count: (grid.count.saturating_sub(1)) * finer + 1,
            mean_width_s: 0.0,
            ..grid
        };
        let clock = |grid: &Grid| {
            (0..grid.count).map(|k| decay.release_time_s + grid.time_s(k)).collect::<Vec<_>>()
        };
        let shown = |x: f64| decay.measurand.shown(x);
        let residual = fitted.residuals.iter().map(|r| -shown(*r)).collect();
        let readings = fitted.readings(&fine).into_iter().map(shown).collect();
        let mut time_s = clock(&grid);
        time_s.truncate(fitted.residuals.len());
        Self { model: Series::new(clock(&fine), readings), residual: Series::new(time_s, residual) }
    }
}

/// The state of the model over time, for the cursor that all panels share.
#[derive(Debug)]
pub struct States {
    pub time_s: Vec<f64>,
    pub yaw_deg: Vec<f64>,
    pub rate_deg_s: Vec<f64>,
}

/// Most states that are sent.
const MAX_STATES: usize = 2000;

impl States {
    fn new(decay: &FreeDecay, fitted: &Fitted) -> Self {
        let (yaw, rate) = fitted.motion().of_angle().readings_and_rates(&decay.grid);
        let every = yaw.len().div_ceil(MAX_STATES).max(1);
        let chosen = || (0..yaw.len()).step_by(every);
        Self {
            time_s: chosen().map(|k| decay.release_time_s + decay.grid.time_s(k)).collect(),
            yaw_deg: chosen().map(|k| decay.measurand.shown(yaw[k])).collect(),
            rate_deg_s: chosen().map(|k| decay.measurand.shown(rate[k])).collect(),
        }
    }
}

/// One release and the present model.
#[derive(Debug)]
pub struct View {
    pub decay: FreeDecay,
    pub fitted: Fitted,
    pub modal: Modal,
    pub curves: Curves,
    pub states: States,
    pub picture: AmplitudePicture,
    pub where_: Where,
    pub over_noise: f64,
    /// Of the later part, the earlier having been fitted alone; only without a model, which says itself what
    /// it is.
    pub later_over_noise: Option<f64>,
    pub is_explained: bool,
}

impl View {
    /// `model` held against the release; without one, a second-order model fitted to it.
    ///
    /// # Errors
    /// Exit 3 where the model has no values yet, 130 where the work is stopped.
    pub fn new(model: Option<&Model>, recorded: Recorded, unknown_zero: bool) -> Result<Self> {
        let Some(model) = model else { return Self::second_order(recorded.decay, unknown_zero) };
        let fitted = held_against(model, &recorded, 1.0)?;
        interrupt::check()?;
        let known = model.modal.get(&recorded.entry.condition).and_then(modal_of);
        Ok(Self::with(recorded.decay, fitted, "the model", known))
    }

    /// A second-order model fitted to the release.
    ///
    /// # Errors
    /// Exit 130 where the work is stopped.
    pub fn second_order(decay: FreeDecay, unknown_zero: bool) -> Result<Self> {
        let zero_unknown = unknown_zero || !decay.measurand.shows_rest();
        let structure = Structure { zero_unknown, ..Structure::default() };
        let fitted = fit_plain_within(&decay, &structure, decay.yaw_rad.len());
        interrupt::check()?;
        let later = diagnose::step(&decay, &fitted, None).held_out_over_noise;
        let view = Self::with(decay, fitted, diagnose::SECOND_ORDER, None);
        Ok(Self { later_over_noise: Some(later), ..view })
    }

    /// `known`: natural frequency and damping ratio where the model has them.
    fn with(decay: FreeDecay, fitted: Fitted, name: &str, known: Option<[Quantity; 2]>) -> Self {
        let [natural_frequency_rad_s, damping_ratio] =
            known.unwrap_or_else(|| [fitted.natural_frequency_rad_s(), fitted.damping_ratio()]);
        Self {
            modal: Modal { natural_frequency_rad_s, damping_ratio },
            curves: Curves::new(&decay, &fitted),
            states: States::new(&decay, &fitted),
            picture: amplitude::picture(&decay, &[(name, &fitted)]),
            where_: locate(&decay, &fitted),
            over_noise: fitted.over_noise(&decay),
            later_over_noise: None,
            is_explained: search::is_explained(&fitted, &decay),
            decay,
            fitted,
        }
    }
}

/// The name under which the model of a diagnosis is laid over the panels; no effect has it.
pub const DIAGNOSIS: &str = "the diagnosis";

/// Candidates whose curves are kept, best first.
const MAX_GHOSTS: usize = 5;

/// What an effect, or a diagnosis, would do for one release, everything fitted to that release alone.
#[derive(Debug)]
pub struct Ghost {
    /// The effect's identifier, or [`DIAGNOSIS`].
    pub name: String,
    /// The effect's identifier, or those of the diagnosis.
    pub title: String,
    pub fitted: Fitted,
    pub curves: Curves,
    pub picture: AmplitudePicture,
    pub where_: Where,
    pub over_noise: f64,
    pub evidence: f64,
}

impl Ghost {
    /// `fitted` is the present model with the effect, `without` the present model, both fitted to this free
    /// decay.
    pub fn new(decay: &FreeDecay, without: &Fitted, fitted: Fitted, effect: &Effect) -> Self {
        Self::named(decay, without, fitted, effect.id(), effect.id())
    }

    /// The model that a diagnosis ends with, where it has effects.
    pub fn of_diagnosis(diagnosed: &Diagnosed) -> Option<Self> {
        let (present, last) = (diagnosed.models(0).next()?, diagnosed.last(0));
        let effects = &diagnosed.diagnosis.effects;
        if diagnosed.path.len() < 2 || effects.is_empty() {
            return None;
        }
        let names: Vec<&str> = effects.iter().map(|e| e.id()).collect();
        let title = names.join(", ");
        Some(Self::named(&diagnosed.decays[0], present, last.clone(), DIAGNOSIS, &title))
    }

    /// Those of the best candidates, and of the model that a diagnosis ends with.
    pub fn all_of(diagnosed: &Diagnosed) -> Vec<Self> {
        let present = &diagnosed.path[0][0];
        let best = diagnosed.diagnosis.candidates.iter().map(|c| &c.effect).take(MAX_GHOSTS);
        let best: Vec<&Effect> = best.collect();
        let of = |effect: &&Effect| {
            let is_its = |single: &&Fitted| single.structure.effects.last() == Some(*effect);
            let single = diagnosed.singles.iter().find(is_its)?;
            Some(Self::new(&diagnosed.decays[0], present, single.clone(), effect))
        };
        let mut all: Vec<Self> = best.par_iter().filter_map(of).collect();
        all.extend(Self::of_diagnosis(diagnosed));
        all
    }

    fn named(decay: &FreeDecay, without: &Fitted, fitted: Fitted, name: &str, title: &str) -> Self {
        Self {
            name: name.to_owned(),
            title: title.to_owned(),
            curves: Curves::new(decay, &fitted),
            picture: amplitude::picture(decay, &[(name, &fitted)]),
            where_: locate(decay, &fitted),
            over_noise: fitted.over_noise(decay),
            evidence: fitted.bic().gain_over(&without.bic()),
            fitted,
        }
    }

    /// What came of a trial, as a sentence.
    pub fn said(&self) -> String {
        format!(
            "{} tried in this release: residual over noise {:.2}, difference of BIC {:.0}",
            self.title, self.over_noise, self.evidence
        )
    }

    /// Fits the present model to the free decay, and with `effect` again.
    ///
    /// # Errors
    /// Exit 6 where the present model cannot be fitted to it, 130 where the work is stopped.
    pub fn fit(decay: &FreeDecay, options: &Options, effect: &Effect) -> Result<Self> {
        let without = search::present(decay, options)?;
        let fitted = fit_added(decay, &without, effect);
        yawrig_base::interrupt::check()?;
        Ok(Self::new(decay, &without, fitted, effect))
    }
}

/// How the present model stands in a diagnosis of a release.
///
/// # Errors
/// Exit 3 where bounds stand beside several conditions.
pub fn options(
    model: Option<&Model>,
    decay: &FreeDecay,
    unknown_zero: bool,
    own: &[Effect],
) -> Result<Options> {
    Ok(Options {
        zero_unknown: unknown_zero || model.is_some_and(|m| m.unknown_zero),
        own: own.to_vec(),
        present: model.map(structure).transpose()?.unwrap_or_default(),
        wind_speed_m_s: decay.wind_speed_m_s,
        wind_speeds_m_s: Vec::new(),
        stop: interrupt::stop(),
    })
}
