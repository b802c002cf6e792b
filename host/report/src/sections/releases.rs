//! The table of releases, with a drawing of each.

use super::answer::{answered, why_not_valid};
use super::cells::{figure, quantity, shown};
use super::lacking::lacking;
use crate::answer::NOT_VALID;
use crate::charts::{self};
use crate::conditions;
use crate::escape::escaped;
use crate::table::table;
use crate::units::sized;
use crate::{Estimate, ReleaseReport, Report};
use std::fmt::Write as _;
use yawrig_base::error::Result;

/// Header of the table of releases; UNIT is that of their records.
const HEADER: [&str; 9] = [
    "release",
    "method",
    "wn (rad/s)",
    "zeta",
    "residual rms (UNIT)",
    "noise (UNIT)",
    "residual / noise",
    "wn planted",
    "zeta planted",
];

pub(super) fn releases(report: &Report) -> Result<String> {
    let all = &report.releases;
    if all.is_empty() {
        return Ok(String::new());
    }
    let unit = all[0].said.measurand();
    let unit = match all.iter().all(|release| release.said.measurand() == unit) {
        true => unit.unit(),
        false => "its unit",
    };
    let header = HEADER.map(|name| name.replace("UNIT", unit));
    let header = header.each_ref().map(String::as_str);
    let mut out = conditions::pictures(all) + &table(&header, 2, all.iter().flat_map(rows));
    out.push_str(why_not_valid(all.iter().flat_map(|release| &release.estimates)));
    // Each remark once, with all that it is about.
    let mut remarks: Vec<(&String, Vec<String>)> = Vec::new();
    for release in all {
        for text in release.estimates.iter().flat_map(|e| &e.remarks) {
            let say_so: Vec<&str> = (release.estimates.iter())
                .filter(|e| e.remarks.contains(text))
                .map(|e| e.method.as_str())
                .collect();
            let whose = match say_so.len() == release.estimates.len() {
                true => release.name.clone(),
                false => format!("{}, {}", release.name, say_so.join(" and ")),
            };
            match remarks.iter_mut().find(|(known, _)| *known == text) {
                Some((_, about)) if about.contains(&whose) => {}
                Some((_, about)) => about.push(whose),
                None => remarks.push((text, vec![whose])),
            }
        }
    }
    if !remarks.is_empty() {
        let item = |(text, about): &(&String, Vec<String>)| {
            format!("<li>{}: {}</li>", escaped(text), escaped(&about.join("; ")))
        };
        let items: String = remarks.iter().map(item).collect();
        let _ = writeln!(out, "<ul class=\"note\">{items}</ul>");
    }
    // The release with the largest residual over noise is unfolded.
    let over = |r: &ReleaseReport| r.residual_over_noise.last().copied().unwrap_or(0.0);
    let worst = (0..all.len()).max_by(|&a, &b| over(&all[a]).total_cmp(&over(&all[b])));
    let mut room = DRAWINGS;
    for (k, release) in all.iter().enumerate() {
        if release.trace.is_some() || release.amplitude.is_some() {
            let text = drawn(release, k, worst == Some(k), room)?;
            room = room.saturating_sub(text.len());
            out.push_str(&text);
        }
    }
    Ok(out)
}

/// Most bytes that the drawings of all releases take.
const DRAWINGS: usize = 2_200_000;

/// A row for each estimate; those without any have one all the same.
fn rows(release: &ReleaseReport) -> Vec<[String; HEADER.len()]> {
    let dash = || "-".to_owned();
    let name = match release.held_out {
        true => format!("{} (held out)", escaped(&release.name)),
        false => escaped(&release.name),
    };
    let digits = |x: Option<f64>, n: usize| x.map_or_else(dash, |x| format!("{x:.n$}"));
    let measurand = release.said.measurand();
    let read = |x: Option<f64>, n: usize| x.map_or_else(dash, |x| sized(&measurand, x, n));
    let row = |e: Option<&Estimate>| {
        [
            name.clone(),
            e.map_or_else(dash, method),
            shown(e.map(|e| e.natural_frequency_rad_s)),
            shown(e.map(|e| e.damping_ratio)),
            read(e.and_then(|e| e.residual_rms_deg), 5),
            read(release.noise_rms_deg, 4),
            digits(
                e.and_then(|e| e.residual_over_noise)
                    .or(release.residual_over_noise.last().copied()),
                3,
            ),
            digits(release.truth.map(|t| t[0]), 5),
            digits(release.truth.map(|t| t[1]), 6),
        ]
    };
    let answer = release.answer.iter().filter(|_| !by_the_model(release)).map(|a| Estimate {
        method: a.model.clone(),
        natural_frequency_rad_s: a.natural_frequency_rad_s,
        damping_ratio: a.damping_ratio,
        residual_rms_deg: None,
        residual_over_noise: Some(a.residual_over_noise),
        refused: false,
        remarks: Vec::new(),
    });
    // What is not valid below what is.
    let mut all: Vec<Estimate> = answer.chain(release.estimates.iter().cloned()).collect();
    all.sort_by_key(|e| e.refused);
    match all.is_empty() {
        true => vec![row(None)],
        false => all.iter().map(|e| row(Some(e))).collect(),
    }
}

/// Whether its only estimate is what the answer says.
fn by_the_model(release: &ReleaseReport) -> bool {
    let [only] = &release.estimates[..] else { return false };
    release.answer.as_ref().is_some_and(|a| a.damping_ratio == only.damping_ratio)
}

/// An estimate's method, and that it is not valid where the diagnosis says so.
fn method(e: &Estimate) -> String {
    let method = escaped(&e.method);
    match e.refused {
        true => format!("{method} <b class=\"refused\">{NOT_VALID}</b>"),
        false => method,
    }
}

/// `room`: most bytes for its drawings.
fn drawn(release: &ReleaseReport, index: usize, open: bool, room: usize) -> Result<String> {
    let open = if open { " open" } else { "" };
    let mut out = format!("<details{open}>\n<summary>{}</summary>\n", escaped(&release.name));
    if let Some(trace) = &release.trace {
        let drawn = match trace.of > trace.time_s.len() {
            true => format!(
                "Drawn decimated by minimum and maximum: {} values of {}, the least and the largest of each stretch, \
                 whose times are rounded to it.",
                trace.time_s.len(),
                trace.of
            ),
            false => format!("All {} values.", trace.of),
        };
        let _ = writeln!(
            out,
            "<figure class=\"live\" data-release=\"{index}\"><div class=\"plots\"></div>\
             <noscript><p>The overlay is drawn by a script of this page, which is switched off.</p></noscript>\
             <figcaption>Measured {} and models above, measured less model below; means over a fiftieth of a period, \
             as the fits see them, of {} samples at {} Hz. {drawn} Drag to zoom, double click for all.</figcaption>\
             </figure>",
            trace.said.measurand().word(),
            release.samples,
            (release.rate_hz * 1e3).round() / 1e3
        );
    }
    let live = out.len();
    if let Some(picture) = &release.amplitude {
        out.push_str(&figure(&charts::amplitude(picture, release.truth))?);
    }
    let measurand = release.said.measurand();
    let rows = release.at_amplitude.iter().map(|at| {
        let [wn, zeta] = [at.natural_frequency_rad_s, at.damping_ratio].map(quantity);
        [sized(&measurand, at.amplitude_deg, 4), wn, zeta]
    });
    let amplitude = format!("amplitude ({})", measurand.coordinate_unit());
    let header = [&amplitude, "wn (rad/s)", "zeta"];
    if !release.at_amplitude.is_empty() {
        out.push_str("<p>A cycle begun at rest at each amplitude:</p>\n");
        out.push_str(&table(&header, 0, rows));
    }
    if let Some(criticism) = &release.criticism {
        out.push_str(&release.answer.as_ref().map_or(String::new(), answered));
        out.push_str(&lacking(criticism)?);
    }
    if out.len() > room {
        out.truncate(live);
        out.push_str("<p class=\"note\">Its further drawings would make the page too large; their values are in the data.</p>\n");
    }
    out.push_str("</details>\n");
    Ok(out)
}
