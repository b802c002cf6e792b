//! What a study found: plain tables, text and plots; text and JSON are made from them.

use serde::Serialize;
use yawrig_report::plot::Plot;

/// One table.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    pub caption: String,
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new(caption: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(|h| (*h).to_owned()).collect();
        Self { caption: caption.into(), header, rows: Vec::new() }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }
}

/// What a study comes to.
pub struct Outcome {
    pub tables: Vec<Table>,
    /// What came out, computed from the tables, and how it differs from the thesis.
    pub findings: Vec<String>,
    pub plots: Vec<Plot>,
}

/// All of one study.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub study: String,
    pub title: String,
    pub tables: Vec<Table>,
    pub findings: Vec<String>,
    #[serde(skip)]
    pub plots: Vec<Plot>,
}

/// Two significant digits in scientific notation.
pub fn scientific(x: f64) -> String {
    format!("{x:.1e}")
}

/// Two or three significant digits without an exponent.
pub fn percent(x: f64) -> String {
    match x.abs() {
        x if x >= 10.0 => format!("{x:.0}"),
        x if x >= 1.0 => format!("{x:.1}"),
        x if x >= 0.1 => format!("{x:.2}"),
        x if x >= 0.001 => format!("{x:.3}"),
        0.0 => "0".into(),
        x => scientific(x),
    }
}

/// How a figure goes over the settings it is given for: at the first, at the last, and at the least and the
/// largest where those lie between.
pub fn course<T: std::fmt::Display>(figures: &[(T, f64)], shown: fn(f64) -> String) -> String {
    let Some(last) = figures.len().checked_sub(1) else { return NOT_GIVEN.to_owned() };
    let at = |k: usize| format!("{} at {}", shown(figures[k].1), figures[k].0);
    let by = |a: &usize, b: &usize| figures[*a].1.total_cmp(&figures[*b].1);
    let mut out = format!("{}, {}", at(0), at(last));
    for (name, k) in [("least", (0..=last).min_by(by)), ("largest", (0..=last).max_by(by))] {
        if let Some(k) = k.filter(|k| (1..last).contains(k)) {
            out += &format!(", {name} {}", at(k));
        }
    }
    out
}

/// The least and the largest.
pub fn extremes(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::MAX, f64::MIN], |[l, h], v| [l.min(v), h.max(v)])
}

/// How many times the one is the other: `3.4 times`, or `0.29 times`.
pub fn times(one: f64, other: f64) -> String {
    format!("{} times", percent(one / other))
}

/// For a number the thesis does not give.
pub const NOT_GIVEN: &str = "-";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_names_its_ends_and_the_extremes_between_them() {
        let shown = |x: f64| format!("{x}");
        assert_eq!(course(&[(40, 3.0), (50, 2.0), (60, 1.0)], shown), "3 at 40, 1 at 60");
        assert_eq!(course(&[(1, 3.0), (2, 1.0), (3, 2.0)], shown), "3 at 1, 2 at 3, least 1 at 2");
        let both = [(1, 3.0), (2, 1.0), (3, 9.0), (4, 2.0)];
        assert_eq!(course(&both, shown), "3 at 1, 2 at 4, least 1 at 2, largest 9 at 3");
        assert_eq!(course::<usize>(&[], shown), NOT_GIVEN);
    }

    #[test]
    fn times_are_those_of_the_figures() {
        assert_eq!(times(34.0, 10.0), "3.4 times");
        assert_eq!(times(1.0, 250.0), "0.004 times");
        assert_eq!(extremes([2.0, -1.0, 5.0]), [-1.0, 5.0]);
    }
}
