//! Curves, views, candidates: what is known of a release, for the page.

use super::bench::Bench;
use super::opened::times_of;
use super::session::Session;
use serde_json::{json, Value};
use std::sync::Arc;
use yawrig_base::error::Result;
use yawrig_core::diagnosis::diagnose::SECOND_ORDER;
use yawrig_core::effects::Effect;
use yawrig_core::record::Measurand;
use yawrig_model::effects::ready_made_effects;
use yawrig_model::journal::{Action, JournalStep};
use yawrig_report::panels::{alike, candidate, described, trials, Panels, Span};
use yawrig_report::view::{Ghost, DIAGNOSIS};

/// Every effect of the library with its card.
pub fn library() -> Value {
    let described = |effect| described(effect, &Measurand::default());
    let all: Vec<Value> =
        Effect::ALL.into_iter().chain(ready_made_effects()).map(described).collect();
    json!({ "effects": all })
}

/// Measurement, model and residual of a release over a stretch of time in about so many points.
///
/// # Errors
/// Exit 3 where the record cannot be read.
pub fn curves(
    bench: &Bench,
    id: usize,
    span: Span,
    points: usize,
    ghost: Option<&str>,
) -> Result<Value> {
    let source = bench.session().release(id)?.source.clone();
    let loaded = source.loaded().map_err(Clone::clone)?;
    let (view, ghost) = {
        let session = bench.session();
        let view = session.view(id).and_then(|v| v.as_ref().ok()).cloned();
        (view, ghost.and_then(|g| find_ghost(&session, id, g)))
    };
    let panels =
        Panels { release: id, loaded, view: view.as_deref(), ghost: ghost.as_deref(), span };
    panels.curves(points, (source.path != source.origin).then(|| times_of(&source.path)))
}

fn find_ghost(session: &Session, id: usize, name: &str) -> Option<Arc<Ghost>> {
    session.ghosts.get(&(id, session.standing.key, name.to_owned())).cloned()
}

/// A release against the model: `pending` until it has been computed.
///
/// # Errors
/// Those of reading the record or holding the model against it.
pub fn view(bench: &Bench, id: usize, span: Span, ghost: Option<&str>) -> Result<Value> {
    let session = bench.session();
    let source = session.release(id)?.source.clone();
    let Some(view) = session.view(id).cloned() else {
        return Ok(json!({"release": id, "pending": true}));
    };
    let key = session.standing.key;
    let of_this = session.ghosts.iter().filter(|(k, _)| k.0 == id && k.1 == key);
    let trials = trials(of_this.map(|(_, ghost)| ghost.clone()));
    let ghost = ghost.and_then(|name| find_ghost(&session, id, name));
    drop(session);
    let (view, loaded) = (view?, source.loaded().map_err(Clone::clone)?);
    let panels = Panels { release: id, loaded, view: Some(&view), ghost: ghost.as_deref(), span };
    Ok(panels.of(&view, &trials))
}

/// Effects that could be added, those that a diagnosis has ranked first.
///
/// # Errors
/// Exit 2 where there is no such release.
pub fn candidates(bench: &Bench, id: usize) -> Result<Value> {
    let source = bench.session().release(id)?.source.clone();
    let loaded = source.loaded();
    let measurand = loaded.map_or_else(|_| Measurand::default(), |l| l.record.measurand.clone());
    let session = bench.session();
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
        let tried = session.ghosts.get(&(id, standing.key, effect.id().to_owned()));
        let diagnosed = diagnosed.map(Arc::as_ref);
        let mut out = candidate(effect.clone(), &measurand, diagnosed, tried.map(Arc::as_ref));
        out["rejected"] = json!(rejected(effect));
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
    Ok(json!({
        "release": id,
        "verdict": verdict,
        "status": diagnosed.map(|d| d.diagnosis.status),
        "sentence": diagnosed.map(|d| &d.diagnosis.sentence),
        "left": diagnosed.map(|d| &d.diagnosis.left),
        "refused": diagnosed.map(|d| d.diagnosis.refusals()),
        "is_drawn": session.ghosts.contains_key(&(id, standing.key, DIAGNOSIS.to_owned())),
        "alike": alike(diagnosed.map(Arc::as_ref)),
        "together": session.together().map(|t| [&t.text, &t.sentence]),
        "ticked": session.fitted_sources().len(),
        "candidates": order.into_iter().map(row).collect::<Vec<_>>(),
    }))
}

/// The campaign's derivatives with the second-order model and with the present one.
pub fn derivatives(bench: &Bench) -> Value {
    let (campaign, judged, standing) = {
        let session = bench.session();
        (session.campaign.clone(), session.judged.clone(), session.standing.clone())
    };
    let Some(campaign) = campaign else { return json!({"has_campaign": false}) };
    let (before, after) = super::derived::before_and_after(&campaign, &standing);
    let critical = after.as_ref().or(before.as_ref()).and_then(|t| t.critical_speed.as_deref());
    let critical = critical.into_iter().flatten().map(|critical| {
        json!({"text": critical.sentence(), "by": critical.law(), "rows": critical.rows()})
    });
    let mut out = json!({
        "has_campaign": true,
        "before": before.as_ref().map(|t| &t.points),
        "after": after.as_ref().map(|t| &t.points),
        "critical_speed": critical.collect::<Vec<_>>(),
    });
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
