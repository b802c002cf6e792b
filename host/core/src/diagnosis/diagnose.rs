//! The verdict on a record: adequate, explained by these effects, or unexplained.

use crate::diagnosis::account::{self, Account};
pub(crate) use crate::diagnosis::answer::modal;
pub use crate::diagnosis::answer::{
    step, Candidate, Diagnosed, Diagnosis, Modal, Options, Status, Step, FITTED_SHARE,
};
use crate::diagnosis::buffeting;
pub(crate) use crate::diagnosis::by_likelihood::forced_rather_than;
use crate::diagnosis::by_likelihood::{buffeted_verdict, by_likelihood, holds};
use crate::diagnosis::compare;
pub use crate::diagnosis::over_pieces::fit_over_pieces;
use crate::diagnosis::reach;
use crate::diagnosis::search::{self, Found};
use crate::diagnosis::survivors;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{fit_added, Fitted, Structure};
use crate::fit::floor;
use crate::fit::free_decay::FreeDecay;
use crate::quantity::Quantity;
use crate::record::Record;
use rayon::prelude::*;

/// Residual over noise, of what all effects at once would leave in one linear step, up to which a model down to the
/// noise is looked for.
const WITHIN_REACH: f64 = 8.0;
/// The same for a model that is as near to the noise as that already.
const MISSED: f64 = 1.5;
/// Residual of the plain model over the noise beyond which the likelihood is not used.
const NEAR: f64 = 40.0;
/// Share of the amplitude that may be left where a model mostly explains a record, and share of the plain model's mean
/// square.
pub(crate) const SMALL: f64 = 0.01;
pub(crate) const MOST_LEFT: f64 = 0.25;
/// What a diagnosis begins with where no model is there.
pub const SECOND_ORDER: &str = "the second-order model";

/// The verdict in one line; `model` says what was there before.
pub fn verdict(status: Status, effects: &[Effect], model: &str) -> String {
    let names: Vec<&str> = effects.iter().map(|e| e.id()).collect();
    match status {
        Status::Adequate => format!("adequate: {model} explains it to its noise"),
        Status::Explained if model == SECOND_ORDER => format!("explained by {}", names.join(", ")),
        Status::Explained => format!("explained by {model} with {}", names.join(", ")),
        Status::MostlyExplained if names.is_empty() => format!("mostly explained by {model}"),
        Status::MostlyExplained => format!("mostly explained by {}", names.join(", ")),
        Status::Unexplained if names.is_empty() => {
            "unexplained: no effect of the library accounts for it".to_owned()
        }
        Status::Unexplained => {
            format!("unexplained: {} helped, but not to the noise", names.join(", "))
        }
    }
}

/// Judges `record`.
///
/// # Errors
/// As [`diagnose_with_fits`].
pub fn diagnose(record: &Record, options: &Options) -> Result<Diagnosis> {
    Ok(diagnose_with_fits(record, options)?.diagnosis)
}

/// Judges `record`, and keeps what was fitted.
///
/// # Errors
/// No free decay in it, a present model that cannot be fitted, or interrupted.
pub fn diagnose_with_fits(record: &Record, options: &Options) -> Result<Diagnosed> {
    let (wind_speed_m_s, stop) = (options.wind_speed_m_s, options.stop.clone());
    let decay = FreeDecay { wind_speed_m_s, stop, ..FreeDecay::of(record)? };
    judged(record, decay, options)
}

fn judged(record: &Record, decay: FreeDecay, options: &Options) -> Result<Diagnosed> {
    if options.present != Structure::default() {
        return Ok(by_likelihood(record, &decay, options)?.0);
    }
    let survivors = survivors::search(&decay, &options.own)?;
    let account = account::account(&decay, survivors, options.zero_unknown)?;
    let best = &account.last().model;
    let plain = search::present(&decay, options)?;
    let lowest = plain.rms_rad().min(account.plain_rad());
    let own = options.own.iter().filter(|e| e.is_own());
    let library = Effect::deterministic().filter(|e| !e.is_flexible());
    let candidates: Vec<Effect> = library.chain(own.cloned()).collect();
    let from = |model| reach::reach(&decay, model, &candidates);
    let reached = (lowest < NEAR * decay.noise_rad).then(|| (from(best), from(&plain)));
    // From near the noise a linear step is to be believed.
    let out_of_reach =
        |(beyond_best, _)| beyond_best > MISSED && best.over_noise(&decay) < WITHIN_REACH;
    let within = reached.is_some_and(|r| r.0.min(r.1) < WITHIN_REACH && !out_of_reach(r));
    if within || one_explains(&decay, &plain, &candidates) {
        let (diagnosed, good) = by_likelihood(record, &decay, options)?;
        if good {
            return Ok(diagnosed);
        }
    } else if let Some(b) = reached.and_then(|_| buffeting::fit(&decay, &plain)) {
        let (deterministic, n) = buffeting::definite_criterion(&decay, best);
        if holds(&b, plain.parameters.len(), deterministic, n) {
            let found = Found {
                decay: decay.clone(),
                plain: plain.clone(),
                singles: Vec::new(),
                path: vec![plain.clone()],
                explained: false,
                indistinguishable: Vec::new(),
                refused: Vec::new(),
            };
            let diagnosis = buffeted_verdict(&decay, &found, &b, None);
            return Ok(Diagnosed { diagnosis, path: vec![plain], decay, singles: Vec::new() });
        }
    }
    decay.stop.check()?;
    Ok(by_prediction(record, decay, account))
}

/// Whether a single effect brings the plain model down to the noise, however strong it is: a linear step does not see as
/// far, and what follows time alone or has corners is not among what is predicted with.
fn one_explains(decay: &FreeDecay, plain: &Fitted, candidates: &[Effect]) -> bool {
    candidates.par_iter().any(|effect| {
        let with = fit_added(decay, plain, effect);
        with.converged && search::is_explained(&with, decay)
    })
}

/// The answer that survives prediction.
fn by_prediction(record: &Record, decay: FreeDecay, account: Account) -> Diagnosed {
    let decay = floor::with_steps(decay, record);
    let last = &account.last().model;
    let where_ = compare::locate(&decay, last);
    let left = account.left(&decay, &where_);
    let named = account.effects.iter().any(|e| *e != Effect::StaticOffset);
    let status = match (search::is_explained(last, &decay), account.effects.is_empty()) {
        (true, true) => Status::Adequate,
        (true, false) => Status::Explained,
        (false, _) if left.share_of_amplitude < SMALL => Status::MostlyExplained,
        (false, _) if named && left.share_of_misfit < MOST_LEFT => Status::MostlyExplained,
        (false, _) => Status::Unexplained,
    };
    let step = |s: &account::Step| Step {
        added: s.added.clone(),
        residual_rms_deg: decay.raw_rms_deg(s.model.rms_rad()),
        residual_over_noise: s.model.over_noise(&decay),
        held_out_over_noise: s.held_out_rad / decay.noise_rad,
        parameters: s.parameters.clone(),
    };
    let diagnosis = Diagnosis {
        noise_rms_deg: decay.sample_noise_rad.to_degrees(),
        mean_noise_deg: decay.noise_rad.to_degrees(),
        status,
        effects: account.effects.clone(),
        indistinguishable: Vec::new(),
        modal: modal(last),
        steps: account.steps.iter().map(step).collect(),
        candidates: account.candidates.clone(),
        where_,
        sentence: Some(account::sentence(&account.effects, &left, SECOND_ORDER)),
        left: Some(left),
        rest_angle_deg: Some(Quantity::new(
            account.rest_angle.value.to_degrees(),
            account.rest_angle.u.to_degrees(),
        )),
    };
    let path = account.steps.into_iter().map(|s| s.model).collect();
    Diagnosed { diagnosis, decay, singles: Vec::new(), path }
}
