//! The table of derivatives as other documents take it in: LaTeX, Markdown.

use clap::ValueEnum;
use yawrig_core::derivatives::at::At;
use yawrig_core::derivatives::critical::CriticalSpeed;
use yawrig_core::derivatives::table::{Point, Table};
use yawrig_core::quantity::Quantity;

/// What the table is written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Typeset {
    /// A tabular that needs no package
    Latex,
    /// A table with bars
    Markdown,
}

impl Typeset {
    /// The points, and below them what a reader must know: what was taken as exactly known, and what is
    /// doubtful.
    pub fn of(self, table: &Table) -> String {
        let names = At::names(table.points.iter().map(|point| &point.at));
        let row = |point: &Point| {
            let quantities = [Some(point.cn_beta), Some(point.cn_r), point.cy_beta, point.cy_r];
            let first = names.iter().map(|name| self.text(&point.at.shown(name)));
            let first = first.chain([self.text(&point.spring)]);
            let numbers =
                [format!("{:.2}", point.wind_speed_m_s), format!("{:.3}", point.reduced_frequency)];
            first.chain(numbers).chain(quantities.map(|q| self.quantity(q))).collect::<Vec<_>>()
        };
        let rows: Vec<Vec<String>> = table.points.iter().map(row).collect();
        let mut header: Vec<String> = names.iter().map(|name| self.text(name)).collect();
        header.push("spring".to_owned());
        header.extend(self.symbols().map(str::to_owned));
        let mut below = vec![format!(
            "{}, {}: per rad about the middle axis, with standard uncertainties (k = 1); Cn_r is combined, Cn_r - Cn_betadot.",
            table.model, table.method
        )];
        if !table.assumed_zero.is_empty() {
            let zero = table.assumed_zero.join(", ");
            below.push(format!(
                "Uncertainties assumed zero, so that each u is a lower bound: {zero}."
            ));
        }
        below.extend(table.critical_speed.iter().flatten().map(CriticalSpeed::with_cycles));
        let open = table.doubts.iter().filter(|doubt| !doubt.accepted);
        below.extend(open.map(|doubt| format!("Doubt: {}.", doubt.message)));
        match self {
            Self::Latex => latex(&header, &rows, names.len() + 1, &below),
            Self::Markdown => markdown(&header, &rows, names.len() + 1, &below),
        }
    }

    fn symbols(self) -> [&'static str; 6] {
        match self {
            Self::Latex => [
                "$V$ (m/s)",
                "$k_m$",
                "$C_{n\\beta}$",
                "$C_{nr} - C_{n\\dot\\beta}$",
                "$C_{y\\beta}$",
                "$C_{yr}$",
            ],
            Self::Markdown => ["V (m/s)", "km", "Cn_beta", "Cn_r - Cn_betadot", "Cy_beta", "Cy_r"],
        }
    }

    fn quantity(self, quantity: Option<Quantity>) -> String {
        let text = quantity.map_or("-".to_owned(), |q| q.to_string());
        match self {
            Self::Latex if quantity.is_some() => format!("${}$", text.replace('±', "\\pm")),
            Self::Latex => "--".to_owned(),
            Self::Markdown => text,
        }
    }

    /// What a user has named.
    fn text(self, text: &str) -> String {
        match self {
            Self::Latex => latex_text(text),
            Self::Markdown => text.replace('|', "\\|"),
        }
    }
}

fn latex_text(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '±' => out.push_str("$\\pm$"),
            '<' | '>' | '|' => out.push_str(&format!("${c}$")),
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}

fn latex(header: &[String], rows: &[Vec<String>], texts: usize, below: &[String]) -> String {
    let line = |cells: &[String]| format!("{} \\\\\n", cells.join(" & "));
    let columns = "l".repeat(texts) + &"r".repeat(header.len() - texts);
    let rows: String = rows.iter().map(|row| line(row)).collect();
    let below: Vec<String> = below.iter().map(|text| latex_text(text)).collect();
    format!(
        "\\begin{{tabular}}{{{columns}}}\n\\hline\n{}\\hline\n{rows}\\hline\n\\end{{tabular}}\n\n{}",
        line(header),
        below.join("\n\n")
    )
}

fn markdown(header: &[String], rows: &[Vec<String>], texts: usize, below: &[String]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule: String =
        (0..header.len()).map(|k| if k < texts { "---|" } else { "---:|" }).collect();
    let rows: String = rows.iter().map(|row| line(row)).collect();
    format!("{}|{rule}\n{rows}\n{}", line(header), below.join("\n\n"))
}
