//! Curves, views, candidates: what is known of a release, for the page.

use super::app::App;
use super::folder::times_of;
use super::session::Session;
use super::view::{Ghost, DIAGNOSIS};
use serde_json::{json, Value};
use std::ops::Range;
use std::sync::Arc;
use yawrig_base::error::{Error, Result};
use yawrig_core::diagnosis::amplitude::AmplitudePoint;
use yawrig_core::diagnosis::compare::{locate_within, Where};
use yawrig_core::diagnosis::diagnose::SECOND_ORDER;
use yawrig_core::effects::Card;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::Fitted;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Measurand;
use yawrig_model::effects::ready_made_effects;
use yawrig_model::journal::{Action, JournalStep};
use yawrig_report::drawn::{short, shorts, Stretches};

/// Most stretches a curve is cut into.
const MOST_POINTS: usize = 4000;
/// Fewest cycles for which the picture of a stretch is drawn: with fewer there is nothing to average.
const LEAST_CYCLES: f64 = 1.5;

/// Every effect of the library with its card.
pub fn library() -> Value {
    let all: Vec<Value> =
        Effect::ALL.into_iter().chain(ready_made_effects()).map(described).collect();
    json!({ "effects": all })
}

fn described(effect: Effect) -> Value {
    let Card { title, formula, cause, fingerprint, confirm, remove, release } = effect.card();
    json!({
        "effect": effect, "title": title, "formula": formula, "cause": cause, "fingerprint": fingerprint,
        "confirm": confirm, "remove": remove, "release": release,
        "is_own": effect.is_own(),
        "can_be_tried": !effect.is_random(),
    })
}

/// Measurement, model and residual of a release over a stretch of time in about so many points.
///
/// # Errors
/// Exit 3 where the record cannot be read.
pub fn curves(
    app: &App,
    id: usize,
    [from, to]: [Option<f64>; 2],
    points: usize,
    ghost: Option<&str>,
) -> Result<Value> {
    let source = app.session().release(id)?.source.clone();
    let loaded = source.loaded().map_err(Clone::clone)?;
    let record = loaded.whole.as_ref().unwrap_or(&loaded.record);
    let (first, last) = (record.time_s[0], record.time_s[record.len() - 1]);
    let (from_s, to_s) = (from.unwrap_or(first).max(first), to.unwrap_or(last).min(last));
    if from_s >= to_s || !(to_s - from_s).is_finite() {
        return Err(Error::usage(format!("nothing lies between {from_s} s and {to_s} s")));
    }
    let stretches = Stretches { from_s, to_s, count: (points / 2).clamp(10, MOST_POINTS) };
    let (view, ghost) = {
        let session = app.session();
        let view = session.view(id).and_then(|v| v.as_ref().ok()).cloned();
        (view, ghost.and_then(|g| find_ghost(&session, id, g)))
    };
    // Times to a millionth of what is drawn.
    let fine = 10f64.powf((6.0 - (to_s - from_s).log10()).ceil());
    let measured = yawrig_report::drawn::Series::new(record.time_s.clone(), record.yaw_deg.clone());
    let mut out = json!({
        "release": id,
        "whole_s": [first, last],
        "time_s": stretches.times_s().iter().map(|t| (t * fine).round() / fine).collect::<Vec<_>>(),
        "measured_deg": shorts(measured.drawn(&stretches)),
        "units": units(&record.measurand),
        "cut_s": (source.path != source.origin).then(|| times_of(&source.path)),
    });
    if let Some(view) = &view {
        out["model_deg"] = json!(shorts(view.curves.model.drawn(&stretches)));
        out["residual_deg"] = json!(shorts(view.curves.residual.drawn(&stretches)));
        out["noise_deg"] = json!(short(view.decay.measurand.shown(view.decay.noise_rad)));
        let decay = &view.decay;
        let instant = |k: usize| decay.release_time_s + decay.grid.time_s(k);
        out["release_s"] = json!(decay.release_time_s);
        out["analysed_s"] = json!([instant(0), instant(decay.grid.count.saturating_sub(1))]);
        out["analysed"] = json!([decay.begins.words(), decay.ends.words()]);
    }
    if let Some(ghost) = &ghost {
        out["ghost"] = json!(ghost.name);
        out["ghost_title"] = json!(ghost.title);
        out["ghost_deg"] = json!(shorts(ghost.curves.model.drawn(&stretches)));
        out["ghost_residual_deg"] = json!(shorts(ghost.curves.residual.drawn(&stretches)));
    }
    Ok(out)
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

fn find_ghost(session: &Session, id: usize, name: &str) -> Option<Arc<Ghost>> {
    session.ghosts.get(&(id, session.standing.key, name.to_owned())).cloned()
}

/// The fit's means between two instants of the record's clock.
fn part(decay: &FreeDecay, fitted: &Fitted, [from, to]: [Option<f64>; 2]) -> Range<usize> {
    let count = fitted.residuals.len();
    let index = |time_s: f64| {
        let k = (time_s - decay.release_time_s - decay.grid.start_s) / decay.grid.step_s;
        (k.round().max(0.0) as usize).min(count)
    };
    let range = from.map_or(0, index)..to.map_or(count, index);
    let least = (LEAST_CYCLES * decay.per_cycle()) as usize;
    if range.len() < least {
        0..count
    } else {
        range
    }
}

fn where_json(w: &Where) -> Value {
    let cell = |c: &yawrig_core::diagnosis::compare::PhaseCell| {
        [short(c.yaw_deg), short(c.rate_deg_s), short(c.moment_rad_s2)]
    };
    json!({
        "phase": w.phase.iter().map(cell).collect::<Vec<_>>(),
        "damping_law": w.damping_law.iter().map(|p| [p.rate_deg_s, p.moment_rad_s2, p.u_rad_s2].map(short)).collect::<Vec<_>>(),
        "stiffness_law": w.stiffness_law.iter().map(|p| [p.yaw_deg, p.moment_rad_s2, p.u_rad_s2].map(short)).collect::<Vec<_>>(),
        "frequency": w.frequency.iter().map(|f| [f.hz, f.share].map(short)).collect::<Vec<_>>(),
    })
}

fn points_json(points: &[AmplitudePoint], release_s: f64) -> Value {
    let row = |p: &AmplitudePoint| {
        let (wn, zeta) = (p.natural_frequency_rad_s, p.damping_ratio);
        [p.amplitude_deg, wn.value, wn.u, zeta.value, zeta.u, p.time_s + release_s].map(short)
    };
    json!(points.iter().map(row).collect::<Vec<_>>())
}

fn quantity(q: Quantity) -> Value {
    json!({"value": q.value, "u": Some(q.u).filter(|u| u.is_finite()), "text": q.to_string()})
}

/// A release against the model: `pending` until it has been computed.
///
/// # Errors
/// Those of reading the record or holding the model against it.
pub fn view(app: &App, id: usize, span: [Option<f64>; 2], ghost: Option<&str>) -> Result<Value> {
    let (view, shown, ghosts) = {
        let session = app.session();
        session.release(id)?;
        let key = session.standing.key;
        let mut ghosts: Vec<Arc<Ghost>> = session
            .ghosts
            .iter()
            .filter(|(k, _)| k.0 == id && k.1 == key)
            .map(|(_, g)| g.clone())
            // Of one effect it is that effect's.
            .filter(|g| g.name != DIAGNOSIS || g.fitted.structure.effects.len() > 1)
            .collect();
        ghosts.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        match session.view(id) {
            None => return Ok(json!({"release": id, "pending": true})),
            Some(view) => (view.clone()?, ghost.and_then(|g| find_ghost(&session, id, g)), ghosts),
        }
    };
    let decay = &view.decay;
    let is_whole = span == [None, None];
    let where_ = match is_whole {
        true => where_json(&view.where_),
        false => where_json(&locate_within(decay, &view.fitted, part(decay, &view.fitted, span))),
    };
    let w = &view.where_;
    let is_white = w.correlation.abs() <= w.correlation_of_white;
    let predicted = |p: &yawrig_core::diagnosis::amplitude::PredictedAmplitudes| json!({"name": p.name, "points": points_json(&p.points, decay.release_time_s)});
    let trial = |g: &Arc<Ghost>| {
        let points = g.picture.predictions.first().map(predicted);
        json!({"effect": g.name, "points": points.map(|p| p["points"].clone())})
    };
    let mut out = json!({
        "release": id,
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
        "trials": ghosts.iter().map(trial).collect::<Vec<_>>(),
        "where": where_,
        "states": {
            "time_s": shorts(view.states.time_s.iter().copied()),
            "yaw_deg": shorts(view.states.yaw_deg.iter().copied()),
            "rate_deg_s": shorts(view.states.rate_deg_s.iter().copied()),
        },
    });
    if let Some(ghost) = shown {
        out["ghost"] = match is_whole {
            true => where_json(&ghost.where_),
            false => {
                where_json(&locate_within(decay, &ghost.fitted, part(decay, &ghost.fitted, span)))
            }
        };
    }
    Ok(out)
}

/// Effects that could be added, those that a diagnosis has ranked first.
///
/// # Errors
/// Exit 2 where there is no such release.
pub fn candidates(app: &App, id: usize) -> Result<Value> {
    let session = app.session();
    session.release(id)?;
    let standing = &session.standing;
    let in_model: Vec<Effect> =
        standing.model.iter().flat_map(|m| m.effects.iter().map(|e| e.effect.clone())).collect();
    let diagnosed = session.diagnosed.get(&(id, standing.key));
    let rejected = |effect: Effect| {
        let said = |s: &&JournalStep| {
            s.rejected.as_deref() == Some(effect.id()) || s.added.as_deref() == Some(effect.id())
        };
        let last = standing.steps.iter().rev().find(said).filter(|s| s.action == Action::Reject);
        last.map(|s| json!({"step": s.step, "why": s.why}))
    };
    let row = |effect: Effect| {
        let mut out = described(effect.clone());
        let ranked =
            diagnosed.and_then(|d| d.diagnosis.candidates.iter().find(|c| c.effect == effect));
        let tried = session.ghosts.get(&(id, standing.key, effect.id().to_owned()));
        let found = ranked
            .map(|c| (c.evidence, c.residual_over_noise, c.converged))
            .or_else(|| tried.map(|g| (g.evidence, g.over_noise, g.fitted.converged)));
        if let Some((evidence, over_noise, converged)) = found {
            out["evidence"] = json!(short(evidence));
            out["over_noise"] = json!(short(over_noise));
            out["converged"] = json!(converged);
        }
        out["is_tried"] = json!(tried.is_some());
        out["rejected"] = json!(rejected(effect.clone()));
        out["is_suggested"] =
            json!(diagnosed.is_some_and(|d| d.diagnosis.effects.contains(&effect)));
        out
    };
    let mut order: Vec<Effect> = diagnosed
        .iter()
        .flat_map(|d| d.diagnosis.candidates.iter().map(|c| c.effect.clone()))
        .chain(session.own.iter().cloned())
        .chain(Effect::ALL)
        .chain(ready_made_effects())
        .filter(|e| !in_model.contains(e))
        .collect();
    let mut seen = Vec::new();
    order.retain(|e| {
        !seen.contains(e) && {
            seen.push(e.clone());
            true
        }
    });
    let verdict = diagnosed.map(|d| {
        let model = if in_model.is_empty() { SECOND_ORDER } else { "the present model" };
        d.diagnosis.verdict(model)
    });
    let alike = diagnosed.iter().flat_map(|d| &d.diagnosis.indistinguishable).map(|[a, b]| {
        format!(
            "{} and {} cannot be distinguished in this release; what would: {}",
            a.card().title,
            b.card().title,
            a.card().release
        )
    });
    Ok(json!({
        "release": id,
        "verdict": verdict,
        "status": diagnosed.map(|d| d.diagnosis.status),
        "sentence": diagnosed.map(|d| &d.diagnosis.sentence),
        "left": diagnosed.map(|d| &d.diagnosis.left),
        "refused": diagnosed.map(|d| d.diagnosis.refusals()),
        "is_drawn": session.ghosts.contains_key(&(id, standing.key, DIAGNOSIS.to_owned())),
        "alike": alike.collect::<Vec<_>>(),
        "together": session.together().map(|t| [&t.text, &t.sentence]),
        "ticked": session.fitted_sources().len(),
        "candidates": order.into_iter().map(row).collect::<Vec<_>>(),
    }))
}

/// The campaign's derivatives with the second-order model and with the present one.
pub fn derivatives(app: &App) -> Value {
    let (campaign, judged, standing) = {
        let session = app.session();
        (session.campaign.clone(), session.judged.clone(), session.standing.clone())
    };
    let Some(campaign) = campaign else { return json!({"has_campaign": false}) };
    let (before, after) = super::derived::before_and_after(&campaign, &standing);
    let mut out = json!({"has_campaign": true, "before": before, "after": after});
    if let Some(judged) = judged {
        out["judged"] = json!({
            "verdict": judged.verdict(SECOND_ORDER),
            "effects": judged.effects,
            "origin": judged.origin,
            "origin_reason": judged.origin_reason,
            "derivatives": judged.derivatives,
        });
    }
    out
}
