//! The speed from which on the model swings by itself: its sentence and its table.

use super::escape::escaped;
use super::table::table;
use super::Report;
use std::fmt::Write as _;

/// A paragraph and a table for each spring and axis.
pub(super) fn text(report: &Report) -> String {
    let mut out = String::new();
    for critical in &report.critical_speed {
        let _ = writeln!(
            out,
            "<p><b>{}</b> {}</p>",
            escaped(&critical.sentence()),
            escaped(&critical.law())
        );
        let rows = critical.rows().into_iter().map(|(speed, zeta, cycle)| {
            [
                format!("{speed:.4}").trim_end_matches('0').trim_end_matches('.').to_owned(),
                zeta.map_or("not measured".to_owned(), |zeta| zeta.to_string()),
                cycle.map_or("-".to_owned(), |amplitude| amplitude.to_string()),
            ]
        });
        out.push_str(&table(&["V (m/s)", "zeta at rest", "limit cycle (deg)"], 0, rows));
    }
    out
}
