//! The sections of a report's page.

mod answer;
mod cells;
mod lacking;
mod releases;

use super::beside;
use super::charts::{self};
use super::critical;
use super::escape::escaped;
use super::table::table;
use super::trust::{budget, doubts, springs};
use super::{PointReport, Report};
use answer::headline;
use cells::{figure, quantity, shown};
use lacking::lacking;
use releases::releases;
use std::fmt::Write as _;
use yawrig_base::error::Result;
use yawrig_core::derivatives::at::At;

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
        "<header>\n<p class=\"kind\">yawrig report</p>\n<h1>{}</h1>\n<p class=\"verdict\">{}</p>\n{}\
         <nav>{}</nav>\n</header>\n<main>\n",
        escaped(&report.title),
        escaped(&report.verdict),
        headline(report),
        links.collect::<Vec<_>>().join("")
    );
    for (id, title, text) in &sections {
        let _ = write!(out, "<section id=\"{id}\">\n<h2>{title}</h2>\n{text}</section>\n");
    }
    out.push_str("</main>");
    Ok(out)
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
    out.push_str(&critical::text(report));
    if let Some(chart) = charts::critical_speed(&report.critical_speed) {
        out.push_str(&figure(&chart)?);
    }
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
