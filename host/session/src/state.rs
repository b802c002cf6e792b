//! Releases, model, steps and the verdict, for the page.

use super::bench::Bench;
use super::job::{Ended, Progress};
use super::session::{ListedRelease, Session, Standing, Use};
use serde_json::{json, Value};
use std::path::Path;
use std::sync::Arc;
use yawrig_base::error::Error;
use yawrig_core::diagnosis::diagnose::SECOND_ORDER;
use yawrig_model::journal::{Action, JournalStep};
use yawrig_report::drawn::short;
use yawrig_report::view::View;

/// Everything but curves, and but for what is live.
pub fn state(bench: &Bench, job: Option<&Progress>, ended: Option<&Ended>) -> Value {
    let session = bench.session();
    let releases: Vec<Value> =
        (0..session.releases.len()).map(|id| release(&session, id)).collect();
    let standing = &session.standing;
    json!({
        "model": model(&session),
        "overall": overall(&session),
        "releases": releases,
        "steps": standing.steps.iter().map(step).collect::<Vec<_>>(),
        "has_campaign": session.campaign.is_some(),
        "own": session.own.iter().map(|e| e.id()).collect::<Vec<_>>(),
        "job": job,
        "ended": ended,
        "live": null,
    })
}

fn fault(error: &Error) -> Value {
    json!({"message": error.message, "help": error.help})
}

fn model(session: &Session) -> Value {
    let Standing { model, is_edited, changed, fault: wrong, .. } = &session.standing;
    let effects = model.iter().flat_map(|m| &m.effects).map(|entry| {
        let parameters = entry.parameters.iter().zip(entry.effect.parameters()).map(|(p, known)| {
            json!({"name": known.name, "unit": known.unit, "value": p.value, "u": p.u, "free": p.free})
        });
        json!({
            "effect": entry.effect,
            "title": entry.effect.card().title,
            "parameters": parameters.collect::<Vec<_>>(),
        })
    });
    json!({
        "file": session.model_path.display().to_string(),
        "exists": model.is_some(),
        "edited": is_edited,
        "changed_records": changed,
        "read_only": session.read_only,
        "fault": wrong.as_ref().map(fault),
        "effects": effects.collect::<Vec<_>>(),
        "ticks_changed": session.are_ticks_changed(),
    })
}

/// The model against all its records, and what to make of it.
fn overall(session: &Session) -> Value {
    let standing = &session.standing;
    let is_stale = standing.is_edited || !standing.changed.is_empty();
    let known = standing.steps.last().filter(|_| standing.model.is_some() && !is_stale);
    let of = |used| (0..session.releases.len()).filter(move |k| session.releases[*k].used == used);
    let views =
        |used| of(used).filter_map(|k| session.view(k)?.as_ref().ok().map(|v| (k, v.clone())));
    let fitted: Vec<(usize, Arc<View>)> = views(Use::Fit).collect();
    let is_complete = fitted.len() == of(Use::Fit).count() && !fitted.is_empty();
    let mean = |of: &dyn Fn(&View) -> Option<f64>, weight: &dyn Fn(&View) -> f64| {
        let (mut n, mut sum) = (0.0, 0.0);
        for (_, view) in &fitted {
            n += weight(view);
            sum += weight(view) * of(view)?.powi(2);
        }
        Some((sum / n).sqrt()).filter(|x: &f64| x.is_finite())
    };
    let count = |view: &View| view.fitted.count as f64;
    let (over_noise, held_out) = match known.and_then(|step| step.after) {
        Some(after) => (Some(after.residual_over_noise), Some(after.held_out_over_noise)),
        None if is_complete => {
            (mean(&|v| Some(v.over_noise), &count), mean(&|v| v.later_over_noise, &count))
        }
        None => (None, None),
    };
    let worst = fitted.iter().max_by(|a, b| a.1.over_noise.total_cmp(&b.1.over_noise));
    let failing: Vec<&(usize, Arc<View>)> =
        fitted.iter().filter(|(_, v)| !v.is_explained).collect();
    let is_adequate = is_complete && failing.is_empty();
    let number = of(Use::Fit).count();
    let these = match number {
        1 => "The ticked record".to_owned(),
        _ => format!("All {number} ticked"),
    };
    let (status, text) = match worst {
        _ if session.releases.is_empty() => ("unknown", "No record is open.".to_owned()),
        _ if number == 0 => ("unknown", "No record is ticked to be fitted.".to_owned()),
        Some((_, view)) if is_complete && (is_adequate || number == 1) => {
            let status = if is_adequate { "adequate" } else { "structured" };
            (status, format!("{these}: {}", explained(session, view, is_adequate)))
        }
        Some((k, view)) if is_complete => {
            let text = format!(
                "{these}: {} not explained, {:.1} × noise in {}.",
                failing.len(),
                view.over_noise,
                name(&session.releases[*k])
            );
            ("structured", text)
        }
        _ => ("unknown", format!("{these}: being analysed.")),
    };
    json!({
        "over_noise": over_noise.map(short),
        "held_out": held_out.map(short),
        "held_out_is": if of(Use::HoldOut).count() > 0 { "the releases held out" } else { "the later part of each release" },
        "status": status,
        "verdict": text,
        "left_out": left_out(session),
    })
}

/// The present model in words.
fn called(session: &Session) -> String {
    match &session.standing.model {
        Some(m) if !m.effects.is_empty() => {
            let names: Vec<&str> = m.effects.iter().map(|e| e.effect.card().title).collect();
            format!("the model with {}", names.join(", ").to_lowercase())
        }
        _ => SECOND_ORDER.to_owned(),
    }
}

/// The verdict on a record, to stand behind its name.
fn explained(session: &Session, view: &View, is_explained: bool) -> String {
    let called = called(session);
    match is_explained {
        true => format!("{called} explains it to the noise."),
        false => {
            format!("something is missing, {called} leaves {:.1} times the noise.", view.over_noise)
        }
    }
}

/// A sentence about releases that are bad data, where there are any.
fn left_out(session: &Session) -> Option<String> {
    let is_bad = |r: &&ListedRelease| r.source.fault().is_some();
    let bad: Vec<String> = session.releases.iter().filter(is_bad).map(name).collect();
    match &bad[..] {
        [] => None,
        [one] => Some(format!("{one} is bad data and left out.")),
        [first, ..] => {
            Some(format!("{} releases are bad data and left out, {first} first.", bad.len()))
        }
    }
}

/// What a release is called on the page.
fn name(release: &ListedRelease) -> String {
    match &release.entry.made_under {
        Some(m) if m.wind_speed_m_s == 0.0 => format!("{} {} wind off", m.spring, m.axis),
        Some(m) => format!("{} {} {} m/s", m.spring, m.axis, m.wind_speed_m_s),
        None => {
            let path = Path::new(&release.entry.file);
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        }
    }
}

fn release(session: &Session, id: usize) -> Value {
    let release = &session.releases[id];
    let view = session.view(id);
    let wrong = release.source.fault().or_else(|| view.and_then(|v| v.as_ref().err()));
    let badge = match (wrong, view) {
        (Some(_), _) => "bad",
        (None, Some(Ok(view))) if view.is_explained => "adequate",
        (None, Some(Ok(_))) => "structured",
        _ => "pending",
    };
    let made = release.entry.made_under.as_ref();
    let known = view.and_then(|v| v.as_ref().ok());
    let verdict = known.map(|view| explained(session, view, view.is_explained));
    json!({
        "verdict": verdict.unwrap_or_else(|| "being analysed.".to_owned()),
        "id": id,
        "name": name(release),
        "file": release.source.path.display().to_string(),
        "condition": release.entry.condition,
        "spring": made.map(|m| m.spring.clone()),
        "axis": made.map(|m| m.axis.to_string()),
        "wind_speed_m_s": made.map(|m| m.wind_speed_m_s),
        "used": release.used,
        "badge": badge,
        "over_noise": known.map(|v| short(v.over_noise)),
        "fault": wrong.map(fault),
        "is_left_out": release.source.fault().is_some(),
    })
}

fn step(step: &JournalStep) -> Value {
    let named = |name: &Option<String>| name.clone().unwrap_or_default();
    let (of, what) = match step.action {
        Action::Fit => (String::new(), "fit"),
        Action::Add => (named(&step.added), "add"),
        Action::Remove => (named(&step.removed), "remove"),
        Action::Reject => (named(&step.rejected), "reject"),
        Action::Return => (step.returned_to.unwrap_or_default().to_string(), "return to"),
        Action::Edit => (String::new(), "edit by hand"),
    };
    let what = format!("{what} {of}").trim_end().to_owned();
    json!({
        "step": step.step,
        "time_utc": step.time_utc,
        "action": step.action,
        "what": what,
        "of": of,
        "why": step.why,
        "command": step.command,
        "over_noise": step.after.map(|a| short(a.residual_over_noise)),
        "held_out": step.after.map(|a| short(a.held_out_over_noise)),
    })
}
