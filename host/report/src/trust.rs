//! What a report's numbers rest on: doubts, uncertainties nobody has given, springs, the budget.

use super::escape::escaped;
use super::table::table;
use super::{Kind, PointReport, Report};
use std::fmt::Write as _;
use yawrig_campaign::doubted;

/// Doubts and what was taken as exactly known; nothing where a report is about no campaign.
pub(super) fn doubts(report: &Report) -> String {
    if report.kind != Kind::Campaign {
        return String::new();
    }
    let mut out = String::new();
    let open = || report.doubts.iter().filter(|doubt| !doubt.accepted);
    let items: String =
        open().map(|d| format!("<li>{}</li>\n", escaped(&doubted::line(d)))).collect();
    match items.is_empty() {
        true => out.push_str(
            "<p>Nothing in the campaign's file or records contradicts anything else.</p>\n",
        ),
        false => {
            let _ = write!(out, "<ul class=\"doubts\">\n{items}</ul>\n");
        }
    }
    let accepted: Vec<String> =
        report.doubts.iter().filter(|d| d.accepted).map(|d| d.kind.name()).collect();
    if !accepted.is_empty() {
        let _ = writeln!(out, "<p>Accepted in the file: {}.</p>", escaped(&accepted.join(", ")));
    }
    let _ = match report.assumed_zero.is_empty() {
        true => writeln!(out, "<p>Every uncertainty of the instruments is stated.</p>"),
        false => writeln!(
            out,
            "<p class=\"warning\"><b>Uncertainties assumed zero</b>, so that every u below is a lower bound: {}.</p>",
            escaped(&report.assumed_zero.join(", "))
        ),
    };
    out
}

/// The springs as the campaign states them.
pub(super) fn springs(report: &Report) -> String {
    let rows = report.springs.iter().map(|row| {
        let q = row.stiffness_n_per_m;
        let u = if q.u > 0.0 { format!("{}", q.u) } else { "not stated".to_owned() };
        [escaped(&row.spring), format!("{}", q.value), u]
    });
    match report.springs.is_empty() {
        true => String::new(),
        false => table(&["spring", "stiffness (N/m)", "u (N/m)"], 1, rows),
    }
}

/// What each uncertainty is made of: shares of its square as a bar, and in percent of the value.
pub(super) fn budget(points: &[PointReport]) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for point in points {
        let Some(budget) = &point.budget else { continue };
        let all = [
            ("Cn_beta", Some(point.cn_beta), Some(budget.cn_beta)),
            ("Cn_r", Some(point.cn_r), Some(budget.cn_r)),
            ("Cy_beta", point.cy_beta, budget.cy_beta),
            ("Cy_r", point.cy_r, budget.cy_r),
        ];
        for (name, quantity, budget) in all {
            let (Some(q), Some(budget)) = (quantity, budget) else { continue };
            let square: f64 = budget.sources().iter().map(|(_, u)| u * u).sum();
            let share = |u: f64| if square > 0.0 { 100.0 * u * u / square } else { 0.0 };
            let bar: String = budget
                .sources()
                .iter()
                .enumerate()
                .filter(|(_, (_, u))| share(*u) >= 0.5)
                .map(|(k, (source, u))| {
                    format!(
                        "<i class=\"part{k}\" style=\"width:{:.1}%\" title=\"{source}\"></i>",
                        share(*u)
                    )
                })
                .collect();
            let percent = |u: f64| match 100.0 * u / q.value.abs() {
                0.0 => "0".to_owned(),
                p if p < 0.0005 => "&lt;0.001".to_owned(),
                p => format!("{p:.3}"),
            };
            let mut row = vec![escaped(&point.spring), name.to_owned()];
            row.push(format!("<span class=\"budget\">{bar}</span>"));
            row.push(percent(q.u));
            row.extend(budget.sources().map(|(_, u)| percent(u)));
            rows.push(row);
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    let sources = points.iter().find_map(|p| p.budget).map(|b| b.cn_beta.sources());
    let mut header = vec!["spring", "", "share of u²", "u (%)"];
    let names = sources.map(|s| s.map(|(name, _)| name)).unwrap_or_default();
    header.extend(names);
    let legend: String = names
        .iter()
        .enumerate()
        .map(|(k, name)| format!("<span><i class=\"part{k}\"></i>{name}</span>"))
        .collect();
    format!(
        "<h3>Where the uncertainty comes from</h3>\n<p class=\"legend\">{legend}</p>\n{}",
        table(&header, 3, rows)
    )
}
