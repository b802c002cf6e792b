//! Tables of a report's page.

use super::escape::escaped;
use std::fmt::Write as _;

/// The first `left` columns are text. Cells are HTML already; a column of dashes is left out.
pub(super) fn table<R: IntoIterator<Item = String>>(
    header: &[&str],
    left: usize,
    rows: impl IntoIterator<Item = R>,
) -> String {
    let rows: Vec<Vec<String>> = rows.into_iter().map(|row| row.into_iter().collect()).collect();
    let says = |k: &usize| rows.iter().any(|row| row.get(*k).is_some_and(|cell| cell != "-"));
    let columns: Vec<usize> = (0..header.len()).filter(says).collect();
    let class = |k: usize| if k < left { " class=\"text\"" } else { "" };
    let mut out = "<div class=\"wide\"><table>\n<thead><tr>".to_owned();
    for &k in &columns {
        // A column without a name has no heading.
        let cell = if header[k].is_empty() { "td" } else { "th" };
        let _ = write!(out, "<{cell}{}>{}</{cell}>", class(k), escaped(header[k]));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &rows {
        out.push_str("<tr>");
        for &k in &columns {
            let _ = write!(out, "<td{}>{}</td>", class(k), row.get(k).map_or("-", String::as_str));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
    out
}
