//! The panels of a release as a page draws them: curves over time, where a model fails, candidates.

use crate::drawn::{short, shorts, Series, Stretches};
use crate::view::{Ghost, Loaded, View, DIAGNOSIS};
use serde_json::{json, Value};
use std::ops::Range;
use std::sync::Arc;
use yawrig_base::error::{Error, Result};
use yawrig_core::diagnosis::amplitude::{AmplitudePoint, PredictedAmplitudes};
use yawrig_core::diagnosis::compare::{locate_within, PhaseCell, Where};
use yawrig_core::diagnosis::diagnose::Diagnosed;
use yawrig_core::effects::{Card, Effect};
use yawrig_core::fit::fitting::Fitted;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Measurand;

/// Most stretches a curve is cut into.
const MAX_POINTS: usize = 4000;
/// Fewest cycles for which the picture of a stretch is drawn: with fewer there is nothing to average.
const MIN_CYCLES: f64 = 1.5;

/// From one time to another, of the record's clock in s; to its end on a side where there is none.
pub type Span = [Option<f64>; 2];

/// What is drawn of one release.
pub struct Panels<'a> {
    pub release: usize,
    pub loaded: &'a Loaded,
    /// Once it has been computed.
    pub view: Option<&'a View>,
    /// What is laid over it.
    pub ghost: Option<&'a Ghost>,
    /// The stretch that is looked at.
    pub span: Span,
}

/// An effect with its card, in the words of `measurand`.
pub fn described(effect: Effect, measurand: &Measurand) -> Value {
    let Card { title, formula, cause, fingerprint, confirm, remove, release } =
        effect.card_in(measurand);
    json!({
        "effect": effect, "title": title, "formula": formula, "cause": cause, "fingerprint": fingerprint,
        "confirm": confirm, "remove": remove, "release": release,
        "is_own": effect.is_own(),
        "can_be_tried": !effect.is_random(),
    })
}

impl Panels<'_> {
    /// Measurement, model and residual in about so many points; `cut_s` where only that part of the record is
    /// analysed.
    ///
    /// # Errors
    /// Exit 2 where nothing of the record lies in the stretch.
    pub fn curves(&self, points: usize, cut_s: Option<Span>) -> Result<Value> {
        let record = self.loaded.whole.as_ref().unwrap_or(&self.loaded.record);
        let (first, last) = (record.time_s[0], record.time_s[record.len() - 1]);
        let [from, to] = self.span;
        let (from_s, to_s) = (from.unwrap_or(first).max(first), to.unwrap_or(last).min(last));
        if from_s >= to_s || !(to_s - from_s).is_finite() {
            let span = [from.unwrap_or(first), to.unwrap_or(last)];
            let what = format!("the record has nothing between {} s and {} s", span[0], span[1]);
            return Err(Error::usage(what).help("show all of it (z)"));
        }
        let stretches = Stretches { from_s, to_s, count: (points / 2).clamp(10, MAX_POINTS) };
        // Times to a millionth of what is drawn.
        let fine = 10f64.powf((6.0 - (to_s - from_s).log10()).ceil());
        let measured = Series::new(record.time_s.clone(), record.yaw_deg.clone());
        let mut out = json!({
            "release": self.release,
            "whole_s": [first, last],
            "time_s": stretches.times_s().iter().map(|t| (t * fine).round() / fine).collect::<Vec<_>>(),
            "measured_deg": shorts(measured.drawn(&stretches)),
            "units": units(&record.measurand),
            "cut_s": cut_s,
        });
        if let Some(view) = self.view {
            let decay = &view.decay;
            let instant = |k: usize| decay.release_time_s + decay.grid.time_s(k);
            out["model_deg"] = json!(shorts(view.curves.model.drawn(&stretches)));
            out["residual_deg"] = json!(shorts(view.curves.residual.drawn(&stretches)));
            out["noise_deg"] = json!(short(decay.measurand.shown(decay.noise_rad)));
            out["release_s"] = json!(decay.release_time_s);
            out["analysed_s"] = json!([instant(0), instant(decay.grid.count.saturating_sub(1))]);
            out["analysed"] = json!([decay.begins.words(), decay.ends.words()]);
        }
        if let Some(ghost) = self.ghost {
            out["ghost"] = json!(ghost.name);
            out["ghost_title"] = json!(ghost.title);
            out["ghost_deg"] = json!(shorts(ghost.curves.model.drawn(&stretches)));
            out["ghost_residual_deg"] = json!(shorts(ghost.curves.residual.drawn(&stretches)));
        }
        Ok(out)
    }

    /// The release against the model, and what the effects on trial would do.
    pub fn of(&self, view: &View, trials: &[Arc<Ghost>]) -> Value {
        let decay = &view.decay;
        let is_whole = self.span == [None, None];
        let located = |fitted: &Fitted, whole: &Where| match is_whole {
            true => where_json(whole),
            false => where_json(&locate_within(decay, fitted, part(decay, fitted, self.span))),
        };
        let w = &view.where_;
        let is_white = w.correlation.abs() <= w.correlation_of_white;
        let predicted = |p: &PredictedAmplitudes| json!({"name": p.name, "points": points_json(&p.points, decay.release_time_s)});
        let trial = |g: &Arc<Ghost>| {
            let points = g.picture.predictions.first().map(predicted);
            json!({"effect": g.name, "points": points.map(|p| p["points"].clone())})
        };
        let mut out = json!({
            "release": self.release,
            "over_noise": short(view.over_noise),
            "is_explained": view.is_explained,
            "correlation": short(w.correlation),
            "correlation_of_white": short(w.correlation_of_white),
            "is_white": is_white,
            "noise_rms_deg": short(decay.measurand.shown(decay.sample_noise_rad)),
            "residual_rms_deg": short(decay.raw_rms_deg(view.fitted.rms_rad())),
            "natural_frequency_rad_s": quantity(view.modal.natural_frequency_rad_s),
            "damping_ratio": quantity(view.modal.damping_ratio),
            "measured": points_json(&view.picture.measured, decay.release_time_s),
            "predicted": view.picture.predictions.first().map(predicted),
            "trials": trials.iter().map(trial).collect::<Vec<_>>(),
            "where": located(&view.fitted, w),
            "states": {
                "time_s": shorts(view.states.time_s.iter().copied()),
                "yaw_deg": shorts(view.states.yaw_deg.iter().copied()),
                "rate_deg_s": shorts(view.states.rate_deg_s.iter().copied()),
            },
        });
        if let Some(ghost) = self.ghost {
            out["ghost"] = located(&ghost.fitted, &ghost.where_);
        }
        out
    }
}

/// Of these, what is drawn as trials, best first: the model of a diagnosis only where it is not that of one
/// effect, which is drawn as that effect's.
pub fn trials(ghosts: impl Iterator<Item = Arc<Ghost>>) -> Vec<Arc<Ghost>> {
    let is_of_its_own =
        |g: &Arc<Ghost>| g.name != DIAGNOSIS || g.fitted.structure.effects.len() > 1;
    let mut all: Vec<Arc<Ghost>> = ghosts.filter(is_of_its_own).collect();
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    all
}

/// An effect that the model of a record of `measurand` may lack: its card, and what it would do as far as a
/// diagnosis or a trial has found it.
pub fn candidate(
    effect: Effect,
    measurand: &Measurand,
    diagnosed: Option<&Diagnosed>,
    tried: Option<&Ghost>,
) -> Value {
    let mut out = described(effect.clone(), measurand);
    let ranked = diagnosed.and_then(|d| d.diagnosis.candidates.iter().find(|c| c.effect == effect));
    let found = ranked
        .map(|c| (c.delta_bic, c.residual_over_noise, c.converged))
        .or_else(|| tried.map(|g| (g.evidence, g.over_noise, g.fitted.converged)));
    if let Some((evidence, over_noise, converged)) = found {
        out["evidence"] = json!(short(evidence));
        out["over_noise"] = json!(short(over_noise));
        out["converged"] = json!(converged);
    }
    out["is_tried"] = json!(tried.is_some());
    out["is_suggested"] = json!(diagnosed.is_some_and(|d| d.diagnosis.effects.contains(&effect)));
    out
}

/// Which effects a diagnosis cannot tell apart, and what would.
pub fn alike(diagnosed: Option<&Diagnosed>) -> Vec<String> {
    let pairs = diagnosed.into_iter().flat_map(|d| &d.diagnosis.indistinguishable);
    let measurand = diagnosed.map(|d| d.diagnosis.said.measurand()).unwrap_or_default();
    let said = |[a, b]: &[Effect; 2]| {
        format!(
            "{} and {} cannot be distinguished in this release; what would: {}",
            a.card().title,
            b.card().title,
            a.card_in(&measurand).release
        )
    };
    pairs.map(said).collect()
}

/// The words and units of axes.
fn units(measurand: &Measurand) -> Value {
    json!({
        "recorded": measurand.recorded(),
        "unit": measurand.unit(),
        "coordinate": measurand.coordinate(),
        "word": measurand.word(),
        "rate": measurand.rate(),
        "of": measurand.coordinate_unit(),
        "rate_unit": measurand.rate_unit(),
        "moment": measurand.parameter_unit("rad/s²"),
        "shows_rest": measurand.shows_rest(),
    })
}

/// The fit's means between two instants of the record's clock.
fn part(decay: &FreeDecay, fitted: &Fitted, [from, to]: Span) -> Range<usize> {
    let count = fitted.residuals.len();
    let index = |time_s: f64| {
        let k = (time_s - decay.release_time_s - decay.grid.start_s) / decay.grid.step_s;
        (k.round().max(0.0) as usize).min(count)
    };
    let range = from.map_or(0, index)..to.map_or(count, index);
    let least = (MIN_CYCLES * decay.per_cycle()) as usize;
    if range.len() < least {
        0..count
    } else {
        range
    }
}

fn where_json(w: &Where) -> Value {
    let cell = |c: &PhaseCell| [short(c.yaw_deg), short(c.rate_deg_s), short(c.moment_rad_s2)];
    json!({
        "noise": short(w.noise_rad_s2),
        "phase": w.phase.iter().map(cell).collect::<Vec<_>>(),
        "damping_law": w.damping_law.iter().map(|p| [p.rate_deg_s, p.moment_rad_s2, p.u_rad_s2].map(short)).collect::<Vec<_>>(),
        "stiffness_law": w.stiffness_law.iter().map(|p| [p.yaw_deg, p.moment_rad_s2, p.u_rad_s2].map(short)).collect::<Vec<_>>(),
        "frequency": w.frequency.iter().map(|f| [f.hz, f.share, f.over_noise].map(short)).collect::<Vec<_>>(),
    })
}

fn points_json(points: &[AmplitudePoint], release_s: f64) -> Value {
    let row = |p: &AmplitudePoint| {
        let (wn, zeta) = (p.natural_frequency_rad_s, p.damping_ratio);
        [p.amplitude_deg, wn.value, wn.u, zeta.value, zeta.u, p.time_s + release_s].map(short)
    };
    json!(points.iter().map(row).collect::<Vec<_>>())
}

/// A quantity, and as it is printed.
pub fn quantity(q: Quantity) -> Value {
    json!({"value": q.value, "u": Some(q.u).filter(|u| u.is_finite()), "text": q.to_string()})
}
