//! What is seen of one release: the record, a model fitted to it or held against it, and where they part.

use crate::drawn::Series;
use crate::model::document::{Model, RecordEntry};
use crate::model::limits::structure;
use crate::model::model_fit::{held_against, modal_of, Recorded};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::diagnosis::amplitude::{self, AmplitudePicture};
use yawrig_core::diagnosis::compare::{locate, Where};
use yawrig_core::diagnosis::diagnose::Modal;
use yawrig_core::diagnosis::diagnose::{self, Options};
use yawrig_core::diagnosis::search;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_added, fit_plain_within, Fitted, Structure};
use yawrig_core::fit::swing::Swing;
use yawrig_core::motion::simulate::Grid;
use yawrig_core::record::Record;

/// Points of a drawn model between two of the fit's.
const FINER: usize = 4;

/// A record as it was read.
#[derive(Debug)]
pub struct Loaded {
    pub record: Record,
    /// Its free decay, or why there is none.
    pub swing: std::result::Result<Swing, Error>,
}

impl Loaded {
    /// # Errors
    /// Those of [`Record::read`].
    pub fn read(path: &Path, wind_speed_m_s: f64) -> Result<Self> {
        let record = yawrig_records::read(path)?;
        let swing = Swing::of(&record).map(|swing| Swing { wind_speed_m_s, ..swing });
        Ok(Self { record, swing: swing.map_err(Error::from) })
    }

    pub fn recorded(&self, entry: &RecordEntry) -> Result<Recorded> {
        let swing = Swing { stop: interrupt::stop(), ..self.swing.clone()? };
        Ok(Recorded { entry: entry.clone(), path: self.record.file.clone(), swing })
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
    fn of(swing: &Swing, fitted: &Fitted) -> Self {
        let grid = swing.grid;
        let finer = FINER.min(swing.block.max(1));
        let fine = Grid {
            step_s: grid.step_s / finer as f64,
            count: (grid.count.saturating_sub(1)) * finer + 1,
            mean_width_s: 0.0,
            ..grid
        };
        let clock = |grid: &Grid| {
            (0..grid.count).map(|k| swing.release_time_s + grid.time_s(k)).collect::<Vec<_>>()
        };
        let degrees = |values: Vec<f64>| values.into_iter().map(f64::to_degrees).collect();
        let residual = fitted.residuals.iter().map(|r| -r.to_degrees()).collect();
        let mut time_s = clock(&grid);
        time_s.truncate(fitted.residuals.len());
        Self {
            model: Series::new(clock(&fine), degrees(fitted.readings(&fine))),
            residual: Series::new(time_s, residual),
        }
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
const MOST_STATES: usize = 2000;

impl States {
    fn of(swing: &Swing, fitted: &Fitted) -> Self {
        let (yaw, rate) = fitted.motion().readings_and_rates(&swing.grid);
        let every = yaw.len().div_ceil(MOST_STATES).max(1);
        let chosen = || (0..yaw.len()).step_by(every);
        Self {
            time_s: chosen().map(|k| swing.release_time_s + swing.grid.time_s(k)).collect(),
            yaw_deg: chosen().map(|k| yaw[k].to_degrees()).collect(),
            rate_deg_s: chosen().map(|k| rate[k].to_degrees()).collect(),
        }
    }
}

/// One release and the present model.
#[derive(Debug)]
pub struct View {
    pub swing: Swing,
    pub fitted: Fitted,
    pub modal: Modal,
    pub curves: Curves,
    pub states: States,
    pub picture: AmplitudePicture,
    pub where_: Where,
    pub over_noise: f64,
    /// Of the later part, the earlier having been fitted alone; only without a model, which says itself what it is.
    pub later_over_noise: Option<f64>,
    pub is_explained: bool,
}

impl View {
    /// `model` held against the release; without one, a second-order model fitted to it.
    ///
    /// # Errors
    /// Exit 3 where the model has no values yet, 130 where the work is stopped.
    pub fn of(model: Option<&Model>, recorded: Recorded, unknown_zero: bool) -> Result<Self> {
        let (fitted, name) = match model {
            Some(model) => (held_against(model, &recorded, 1.0)?, "the model"),
            None => {
                let structure = Structure { zero_unknown: unknown_zero, ..Structure::default() };
                let count = recorded.swing.yaw_rad.len();
                (fit_plain_within(&recorded.swing, &structure, count), diagnose::SECOND_ORDER)
            }
        };
        yawrig_base::interrupt::check()?;
        let swing = recorded.swing;
        let known = model.and_then(|m| m.modal.get(&recorded.entry.condition)).and_then(modal_of);
        let [natural_frequency_rad_s, damping_ratio] =
            known.unwrap_or_else(|| [fitted.natural_frequency_rad_s(), fitted.damping_ratio()]);
        let later = || diagnose::step(&swing, &fitted, 0).held_out_over_noise;
        Ok(Self {
            modal: Modal { natural_frequency_rad_s, damping_ratio },
            curves: Curves::of(&swing, &fitted),
            states: States::of(&swing, &fitted),
            picture: amplitude::picture(&swing, &[(name, &fitted)]),
            where_: locate(&swing, &fitted),
            over_noise: fitted.over_noise(&swing),
            later_over_noise: model.is_none().then(later),
            is_explained: search::is_explained(&fitted, &swing),
            swing,
            fitted,
        })
    }
}

/// What an effect would do for one release, everything fitted to that release alone.
#[derive(Debug)]
pub struct Ghost {
    pub effect: Effect,
    pub fitted: Fitted,
    pub curves: Curves,
    pub picture: AmplitudePicture,
    pub where_: Where,
    pub over_noise: f64,
    pub evidence: f64,
}

impl Ghost {
    /// `fitted` is the present model with the effect, `without` the present model, both fitted to this free decay.
    pub fn of(swing: &Swing, without: &Fitted, fitted: Fitted, effect: Effect) -> Self {
        Self {
            effect: effect.clone(),
            curves: Curves::of(swing, &fitted),
            picture: amplitude::picture(swing, &[(effect.id(), &fitted)]),
            where_: locate(swing, &fitted),
            over_noise: fitted.over_noise(swing),
            evidence: search::evidence(without, &fitted, fitted.effective_count()),
            fitted,
        }
    }

    /// Fits the present model to the free decay, and with `effect` again.
    ///
    /// # Errors
    /// Exit 6 where the present model cannot be fitted to it, 130 where the work is stopped.
    pub fn fit(swing: &Swing, options: &Options, effect: Effect) -> Result<Self> {
        let without = search::present(swing, options)?;
        let fitted = fit_added(swing, &without, &effect);
        yawrig_base::interrupt::check()?;
        Ok(Self::of(swing, &without, fitted, effect))
    }
}

/// How the present model stands in a diagnosis of a release.
///
/// # Errors
/// Exit 3 where bounds stand beside several conditions.
pub fn options(
    model: Option<&Model>,
    swing: &Swing,
    unknown_zero: bool,
    own: &[Effect],
) -> Result<Options> {
    Ok(Options {
        zero_unknown: unknown_zero || model.is_some_and(|m| m.unknown_zero),
        own: own.to_vec(),
        present: model.map(structure).transpose()?.unwrap_or_default(),
        wind_speed_m_s: swing.wind_speed_m_s,
        stop: interrupt::stop(),
    })
}
