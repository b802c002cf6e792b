//! What a study found: plain tables, text and plots; text and JSON are made from them.

use crate::plot::Plot;
use serde::Serialize;

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

/// All of one study.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub study: String,
    pub title: String,
    pub tables: Vec<Table>,
    /// What came out, and how and why it differs from the thesis.
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

/// For a number the thesis does not give.
pub const NOT_GIVEN: &str = "-";
