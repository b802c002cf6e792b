//! The sections of a report's page.

use super::beside;
use super::charts::{self, Chart};
use super::conditions;
use super::escape::escaped;
use super::table::table;
use super::trust::{budget, doubts, springs};
use super::{Criticism, EffectFound, Estimate, PointReport, ReleaseReport, Report};
use crate::plot::Plot;
use crate::units::sized;
use std::fmt::Write as _;
use yawrig_base::error::Result;
use yawrig_core::derivatives::at::At;
use yawrig_core::quantity::Quantity;

/// Everything the reader sees.
pub fn body(report: &Report) -> Result<String> {
    let mut sections: Vec<(&str, &str, String)> = Vec::new();
    let mut add = |id, title, text: String| {
        if !text.is_empty() {
            sections.push((id, title, text));
        }
    };
    add("doubts", "What could make it wrong", doubts(report));
    add("derivatives", "Derivatives", derivatives(report)?);
    if let Some(criticism) = &report.criticism {
        add("model", "What the second-order model lacks", lacking(criticism)?);
    }
    add("models", "Models side by side", sides(report));
    add("releases", "Releases", releases(report)?);
    if let Some(training) = &report.training {
        let chart = figure(&charts::training(training))?;
        let rows = [[
            escaped(&training.topology),
            training.samples.to_string(),
            training.epochs.to_string(),
            escaped(&training.stopped),
            format!("{:.4}", training.test_rms_percent[0]),
            format!("{:.3}", training.test_rms_percent[1]),
        ]];
        let header =
            ["network", "windows", "epochs", "stopped", "wn test rms (%)", "zeta test rms (%)"];
        add("training", "Training of the network", table(&header, 1, rows) + &chart);
    }
    add("journal", "Journal of the model", journal(report));
    add("made", "How this was made", made(report));
    let links = sections.iter().map(|(id, title, _)| format!("<a href=\"#{id}\">{title}</a>"));
    let mut out = format!(
        "<header>\n<p class=\"kind\">yawrig report</p>\n<h1>{}</h1>\n<p class=\"verdict\">{}</p>\n\
         <nav>{}</nav>\n</header>\n<main>\n",
        escaped(&report.title),
        escaped(&report.verdict),
        links.collect::<Vec<_>>().join("")
    );
    for (id, title, text) in &sections {
        let _ = write!(out, "<section id=\"{id}\">\n<h2>{title}</h2>\n{text}</section>\n");
    }
    out.push_str("</main>");
    Ok(out)
}

/// A chart, each plot a drawing of its own: one is as high as a printed page has room for, several may not
/// be.
fn figure(chart: &Chart) -> Result<String> {
    let alone = |plot: &Plot| {
        Chart { name: chart.name, caption: plot.title.clone(), plots: vec![plot.clone()] }.inline()
    };
    let drawings = chart.plots.iter().map(alone).collect::<Result<String>>()?;
    Ok(format!(
        "<figure>\n{drawings}<figcaption>{}</figcaption>\n</figure>\n",
        escaped(&chart.caption)
    ))
}

fn shown(q: Option<Quantity>) -> String {
    q.map_or("-".to_owned(), quantity)
}

/// An uncertainty that is not known is not shown.
fn quantity(q: Quantity) -> String {
    match q.u.is_finite() && q.u > 0.0 {
        true => q.to_string(),
        false => format!("{:.6}", q.value),
    }
}

fn derivatives(report: &Report) -> Result<String> {
    if report.points.is_empty() {
        return Ok(String::new());
    }
    let mut out = String::new();
    let inertia = report.inertia_kg_m2.iter();
    let inertia: Vec<String> =
        inertia.map(|(axis, q)| format!("{} kg m² about the {axis} axis", quantity(*q))).collect();
    if !inertia.is_empty() {
        let _ = writeln!(out, "<p>Izz: {}.</p>", inertia.join("; "));
    }
    // The result first: it is what a printed first page is for.
    let before = report.points_before.as_slice();
    match before.is_empty() {
        true => out.push_str(&points(&report.points, "")),
        false => {
            out.push_str(&points(&report.points, "With the effects found:"));
            out.push_str(&points(before, "With the second-order model alone:"));
        }
    }
    out.push_str(
        "<p class=\"note\">Per radian, with standard uncertainties (k = 1); Cn_beta and Cn_r about the middle axis. \
         <b>Cn_r is the combined damping derivative Cn_r - Cn_betadot</b>: in pure yaw about a fixed axis yaw rate and \
         rate of sideslip are one motion, and no free-oscillation rig tells them apart.</p>\n",
    );
    out.push_str(&figure(&charts::derivatives(report))?);
    out.push_str(&beside::section(report));
    out.push_str(&springs(report));
    out.push_str(&budget(&report.points));
    Ok(out)
}

fn points(points: &[PointReport], caption: &str) -> String {
    let mut header =
        vec!["spring", "V (m/s)", "km", "Cn_beta", "Cn_r - Cn_betadot", "Cy_beta", "Cy_r"];
    let names = At::names(points.iter().map(|p| &p.at));
    header.splice(1..1, names.iter().map(String::as_str));
    let planted = points.iter().any(|p| p.truth.is_some());
    if planted {
        header.extend(["Cn_beta planted", "Cn_r planted", "Cy_beta planted", "Cy_r planted"]);
    }
    let row = |p: &PointReport| {
        let mut row = vec![
            escaped(&p.spring),
            format!("{}", p.wind_speed_m_s),
            format!("{:.4}", p.reduced_frequency),
            quantity(p.cn_beta),
            quantity(p.cn_r),
            shown(p.cy_beta),
            shown(p.cy_r),
        ];
        row.splice(1..1, names.iter().map(|name| escaped(&p.at.shown(name))));
        if let (true, Some(truth)) = (planted, p.truth) {
            row.extend(truth.map(|t| format!("{t:.4}")));
        }
        row
    };
    let caption = if caption.is_empty() { String::new() } else { format!("<p>{caption}</p>\n") };
    caption + &table(&header, 1, points.iter().map(row))
}

fn lacking(c: &Criticism) -> Result<String> {
    let mut out = String::new();
    for sentence in &c.sentences {
        let _ = writeln!(out, "<p>{}.</p>", escaped(sentence));
    }
    if let Some(chart) = charts::staircase(c) {
        // A staircase needs two steps.
        if c.steps.len() > 1 {
            out.push_str(&figure(&chart)?);
        }
        let row = |s: &super::StaircaseStep| {
            [
                escaped(&s.name),
                sized(&c.said.measurand(), s.residual_rms_deg, 5),
                format!("{:.4}", s.residual_over_noise),
                format!("{:.4}", s.held_out_over_noise),
            ]
        };
        let residual = format!("residual rms ({})", c.said.measurand().unit());
        let header = ["model", &residual, "residual / noise", "held out / noise"];
        out.push_str(&table(&header, 1, c.steps.iter().map(row)));
    }
    for effect in &c.effects {
        out.push_str(&card(effect));
    }
    for [a, b] in &c.indistinguishable {
        let _ = writeln!(
            out,
            "<p class=\"note\">{} and {} cannot be distinguished in these data.</p>",
            escaped(a),
            escaped(b)
        );
    }
    if !c.candidates.is_empty() {
        let row = |c: &super::CandidateRow| {
            let evidence = match c.converged {
                true => format!("{:.1}", c.evidence),
                false => "not converged".to_owned(),
            };
            [escaped(&c.effect), format!("{:.4}", c.residual_over_noise), evidence]
        };
        out.push_str("<h3>Every effect alone</h3>\n");
        let header = ["effect", "residual / noise", "difference of BIC"];
        out.push_str(&table(&header, 1, c.candidates.iter().map(row)));
    }
    if let Some(chart) = charts::laws(c) {
        out.push_str("<h3>Where it fails</h3>\n");
        out.push_str(&figure(&chart)?);
    }
    Ok(out)
}

fn card(e: &EffectFound) -> String {
    let mut out = format!(
        "<div class=\"card\"><h3>{} <code>{}</code></h3>\n<p class=\"formula\">{}</p>\n",
        escaped(&e.title),
        escaped(&e.id),
        escaped(&e.formula)
    );
    if !e.parameters.is_empty() {
        let row = |p: &super::ParameterRow| {
            let value = quantity(Quantity::new(p.value, p.u.unwrap_or(f64::NAN)));
            [escaped(&p.name), value, escaped(&p.unit)]
        };
        out.push_str(&table(
            &["parameter", "value, k = 1", "unit"],
            1,
            e.parameters.iter().map(row),
        ));
    }
    out.push_str("<dl>");
    if let Some([origin, reason]) = &e.origin {
        let _ = write!(out, "<dt>Origin</dt><dd>{}: {}</dd>", escaped(origin), escaped(reason));
    }
    for (name, text) in [
        ("Usual cause", &e.cause),
        ("Fingerprint", &e.fingerprint),
        ("To confirm", &e.confirm),
        ("To remove", &e.remove),
    ] {
        let _ = write!(out, "<dt>{name}</dt><dd>{}</dd>", escaped(text));
    }
    out.push_str("</dl></div>\n");
    out
}

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

fn releases(report: &Report) -> Result<String> {
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
            e.map_or_else(dash, |e| escaped(&e.method)),
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
    match release.estimates.is_empty() {
        true => vec![row(None)],
        false => release.estimates.iter().map(|e| row(Some(e))).collect(),
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
        out.push_str(&lacking(criticism)?);
    }
    if out.len() > room {
        out.truncate(live);
        out.push_str("<p class=\"note\">Its further drawings would make the page too large; their values are in the data.</p>\n");
    }
    out.push_str("</details>\n");
    Ok(out)
}

/// A column for each model.
fn sides(report: &Report) -> String {
    let sides = &report.sides;
    if sides.is_empty() {
        return String::new();
    }
    let header: Vec<&str> =
        std::iter::once("").chain(sides.iter().map(|s| s.model.as_str())).collect();
    let row = |name: &str, of: &dyn Fn(&super::SideReport) -> String| {
        std::iter::once(escaped(name)).chain(sides.iter().map(of)).collect::<Vec<_>>()
    };
    let mut rows = vec![
        row("effects", &|s| match s.effects.is_empty() {
            true => "none".to_owned(),
            false => escaped(&s.effects.join(", ")),
        }),
        row("numbers fitted", &|s| s.numbers.to_string()),
        row("residual (deg)", &|s| format!("{:.4}", s.residual_rms_deg)),
        row("residual / noise", &|s| format!("{:.4}", s.residual_over_noise)),
        row("held out / noise", &|s| {
            s.held_out_over_noise.map_or("-".to_owned(), |x| format!("{x:.4}"))
        }),
        row("difference of BIC to the first", &|s| format!("{:+.1}", s.bic_gain)),
    ];
    let mut names: Vec<&String> = Vec::new();
    for (name, _) in sides.iter().flat_map(|s| &s.parameters) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    for name in names {
        rows.push(row(name, &|s| {
            shown(s.parameters.iter().find(|(n, _)| n == name).map(|(_, q)| *q))
        }));
    }
    table(&header, 1, rows)
}

fn journal(report: &Report) -> String {
    if report.journal.is_empty() {
        return String::new();
    }
    let digits = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.4}"));
    let row = |s: &super::JournalRow| {
        [
            s.step.to_string(),
            escaped(&s.time_utc),
            escaped(&s.what),
            escaped(&s.why),
            format!("<code>{}</code>", escaped(&s.command)),
            digits(s.residual_over_noise),
            digits(s.held_out_over_noise),
        ]
    };
    let header =
        ["step", "time (UTC)", "what", "why", "command", "residual / noise", "held out / noise"];
    table(&header, 5, report.journal.iter().map(row))
}

fn made(report: &Report) -> String {
    let made = &report.made;
    let mut out = format!(
        "<dl><dt>Program</dt><dd>{}</dd><dt>Time (UTC)</dt><dd>{}</dd><dt>Command</dt><dd><code>{}</code></dd></dl>\n",
        escaped(&made.program),
        escaped(&made.time_utc),
        escaped(&made.command)
    );
    if !report.settings.is_empty() {
        let row = |s: &super::SettingRow| [escaped(&s.name), escaped(&s.value), escaped(&s.unit)];
        out.push_str(&table(&["setting", "value", "unit"], 3, report.settings.iter().map(row)));
    }
    if !report.sources.is_empty() {
        let row = |s: &super::SourceFile| [escaped(&s.file), s.bytes.to_string(), s.crc32.clone()];
        out.push_str(&table(&["file read", "bytes", "CRC-32"], 1, report.sources.iter().map(row)));
    }
    for note in &report.notes {
        let _ = writeln!(out, "<p class=\"note\">{}</p>", escaped(note));
    }
    out.push_str(
        "<p>Everything above stands in this page as JSON, in the element <code>report-data</code>: \
         <code>yawrig report --data report.html</code> prints it (with this file's own name)\
         <span class=\"on-screen\">, and <button type=\"button\" id=\"save-data\">Save the data</button> writes it to a \
         file</span>. Tables are of full \
         figures; traces are as their captions say.</p>\n",
    );
    out
}
