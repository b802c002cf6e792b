//! All tables of a report as one workbook (Office Open XML, ECMA-376): the parts that every spreadsheet
//! program needs and no more, in the ZIP writer that reading workbooks brings along.

use super::answer::NOT_VALID;
use super::{Estimate, PointReport, Report};
use std::fmt::Write as _;
use std::io::{Cursor, Write};
use yawrig_base::error::{Error, Result};
use yawrig_campaign::doubted;
use yawrig_core::derivatives::at::At;
use yawrig_core::quantity::Quantity;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

const MAIN: &str = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
const PACKAGE: &str = "http://schemas.openxmlformats.org/package/2006";
const OFFICE: &str = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
const TYPE: &str = "application/vnd.openxmlformats-officedocument.spreadsheetml";
const HEAD: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n";

/// A cell; a number that is none is left empty.
enum Cell {
    Text(String),
    Number(f64),
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

struct Sheet {
    name: &'static str,
    rows: Vec<Vec<Cell>>,
}

impl Sheet {
    fn new(name: &'static str, header: &[&str]) -> Self {
        Self { name, rows: vec![header.iter().map(|name| Cell::from(*name)).collect()] }
    }

    fn xml(&self) -> String {
        let mut out = format!("{HEAD}<worksheet xmlns=\"{MAIN}\"><sheetData>");
        for row in &self.rows {
            out.push_str("<row>");
            for cell in row {
                let _ = match cell {
                    Cell::Number(x) if x.is_finite() => write!(out, "<c><v>{x}</v></c>"),
                    Cell::Number(_) => write!(out, "<c/>"),
                    Cell::Text(text) => write!(
                        out,
                        "<c t=\"inlineStr\"><is><t xml:space=\"preserve\">{}</t></is></c>",
                        escaped(text)
                    ),
                };
            }
            out.push_str("</row>");
        }
        out.push_str("</sheetData></worksheet>");
        out
    }
}

/// As XML has it; what it has no characters for is left out.
fn escaped(text: &str) -> String {
    let allowed = text.chars().filter(|c| !c.is_control() || matches!(c, '\n' | '\t'));
    let text: String = allowed.collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn pair(q: Option<Quantity>) -> [Cell; 2] {
    let q = q.unwrap_or(Quantity::new(f64::NAN, f64::NAN));
    [Cell::Number(q.value), Cell::Number(q.u)]
}

fn quantities(p: &PointReport) -> [(&'static str, Option<Quantity>); 4] {
    [
        ("Cn_beta", Some(p.cn_beta)),
        ("Cn_r - Cn_betadot", Some(p.cn_r)),
        ("Cy_beta", p.cy_beta),
        ("Cy_r", p.cy_r),
    ]
}

fn derivatives(name: &'static str, points: &[PointReport]) -> Sheet {
    let names = At::names(points.iter().map(|p| &p.at));
    let mut header: Vec<&str> = vec!["spring", "wind speed (m/s)", "reduced frequency"];
    header.extend(names.iter().map(String::as_str));
    header.extend(["Cn_beta (1/rad)", "u", "Cn_r - Cn_betadot (1/rad)", "u"]);
    header.extend(["Cy_beta (1/rad)", "u", "Cy_r (1/rad)", "u"]);
    let mut sheet = Sheet::new(name, &header);
    for p in points {
        let mut row = vec![Cell::from(p.spring.as_str())];
        row.extend([p.wind_speed_m_s, p.reduced_frequency].map(Cell::Number));
        row.extend(names.iter().map(|name| {
            let text = p.at.shown(name);
            text.parse().map_or(Cell::Text(text), Cell::Number)
        }));
        row.extend(quantities(p).into_iter().flat_map(|(_, q)| pair(q)));
        sheet.rows.push(row);
    }
    sheet
}

fn budget(points: &[PointReport]) -> Sheet {
    let sources = points.iter().find_map(|p| p.budget).map(|b| b.cn_beta.sources());
    let mut header = vec!["spring", "wind speed (m/s)", "derivative", "u (1/rad)"];
    header.extend(sources.iter().flatten().map(|(name, _)| *name));
    let mut sheet = Sheet::new("budget", &header);
    for p in points {
        let Some(b) = &p.budget else { continue };
        let of = [Some(b.cn_beta), Some(b.cn_r), b.cy_beta, b.cy_r];
        for ((name, q), of) in quantities(p).into_iter().zip(of) {
            let (Some(q), Some(of)) = (q, of) else { continue };
            let mut row =
                vec![p.spring.as_str().into(), Cell::Number(p.wind_speed_m_s), name.into()];
            row.push(Cell::Number(q.u));
            row.extend(of.sources().map(|(_, u)| Cell::Number(u)));
            sheet.rows.push(row);
        }
    }
    sheet
}

fn releases(report: &Report) -> Sheet {
    let header =
        ["release", "method", "natural frequency (rad/s)", "u", "damping ratio", "u", "remarks"];
    let mut sheet = Sheet::new("releases", &header);
    for release in &report.releases {
        for Estimate { method, natural_frequency_rad_s, damping_ratio, refused, remarks, .. } in
            &release.estimates
        {
            let mut row = vec![Cell::from(release.name.as_str()), method.as_str().into()];
            row.extend(pair(Some(*natural_frequency_rad_s)));
            row.extend(pair(Some(*damping_ratio)));
            let refused = refused.then_some(NOT_VALID).into_iter();
            let remarks = refused.chain(remarks.iter().map(String::as_str));
            row.push(Cell::Text(remarks.collect::<Vec<_>>().join("; ")));
            sheet.rows.push(row);
        }
    }
    sheet
}

/// What is to be taken from each release that was diagnosed.
fn answers(report: &Report) -> Sheet {
    let mut sheet = Sheet::new("answer", &["release", "model", "quantity", "value", "u", "unit"]);
    for release in &report.releases {
        let Some(answer) = &release.answer else { continue };
        for (name, q, unit) in answer.rows() {
            let mut row: Vec<Cell> =
                [&release.name, &answer.model, &name].map(|text| text.as_str().into()).into();
            row.extend(pair(Some(q)));
            row.push(Cell::Text(unit));
            sheet.rows.push(row);
        }
    }
    sheet
}

/// What the numbers rest on, in the order of the page.
fn about(report: &Report) -> Sheet {
    let mut sheet = Sheet::new("about", &["", "", ""]);
    let mut add = |what: &str, value: Cell, unit: &str| {
        sheet.rows.push(vec![what.into(), value, unit.into()]);
    };
    add("title", report.title.as_str().into(), "");
    add("verdict", report.verdict.as_str().into(), "");
    report.doubts.iter().for_each(|doubt| {
        add(
            if doubt.accepted { "doubt, accepted" } else { "doubt" },
            Cell::Text(doubted::line(doubt)),
            "",
        );
    });
    report.assumed_zero.iter().for_each(|entry| add("assumed zero", entry.as_str().into(), ""));
    report.notes.iter().for_each(|note| add("note", note.as_str().into(), ""));
    for (axis, q) in &report.inertia_kg_m2 {
        add(&format!("Izz about the {axis} axis"), Cell::Number(q.value), "kg m2");
        add("u", Cell::Number(q.u), "kg m2");
    }
    for spring in &report.springs {
        let q = spring.stiffness_n_per_m;
        add(&format!("stiffness of {}", spring.spring), Cell::Number(q.value), "N/m");
        add("u", if q.u > 0.0 { Cell::Number(q.u) } else { "not stated".into() }, "N/m");
    }
    for row in &report.settings {
        let value = row.value.parse().map_or_else(|_| row.value.as_str().into(), Cell::Number);
        add(&row.name, value, &row.unit);
    }
    for source in &report.sources {
        add("source", source.file.as_str().into(), &format!("crc32 {}", source.crc32));
    }
    add("program", report.made.program.as_str().into(), "");
    add("command", report.made.command.as_str().into(), "");
    add("time (UTC)", report.made.time_utc.as_str().into(), "");
    sheet
}

/// The bytes of the workbook.
///
/// # Errors
/// Exit 1, for a defect of this program only.
pub fn workbook(report: &Report) -> Result<Vec<u8>> {
    let mut sheets = vec![about(report)];
    if report.releases.iter().any(|release| release.answer.is_some()) {
        sheets.push(answers(report));
    }
    if !report.points.is_empty() {
        sheets.push(derivatives("derivatives", &report.points));
        sheets.push(budget(&report.points));
    }
    if !report.points_before.is_empty() {
        sheets.push(derivatives("second order", &report.points_before));
    }
    if let Some(beside) = &report.beside {
        sheets.push(derivatives("beside", &beside.points));
    }
    sheets.push(releases(report));
    zipped(&parts(&sheets)).map_err(|e| Error::internal(format!("cannot make the workbook: {e}")))
}

fn parts(sheets: &[Sheet]) -> Vec<(String, String)> {
    let (mut types, mut listed, mut related) = (String::new(), String::new(), String::new());
    let mut parts = Vec::new();
    for (k, sheet) in (1..).zip(sheets) {
        let _ = write!(
            types,
            "<Override PartName=\"/xl/worksheets/sheet{k}.xml\" ContentType=\"{TYPE}.worksheet+xml\"/>"
        );
        let _ = write!(listed, "<sheet name=\"{}\" sheetId=\"{k}\" r:id=\"r{k}\"/>", sheet.name);
        let _ = write!(
            related,
            "<Relationship Id=\"r{k}\" Type=\"{OFFICE}/worksheet\" Target=\"worksheets/sheet{k}.xml\"/>"
        );
        parts.push((format!("xl/worksheets/sheet{k}.xml"), sheet.xml()));
    }
    let all = [
        (
            "[Content_Types].xml",
            format!(
                "{HEAD}<Types xmlns=\"{PACKAGE}/content-types\"><Default Extension=\"rels\" \
                 ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
                 <Override PartName=\"/xl/workbook.xml\" ContentType=\"{TYPE}.sheet.main+xml\"/>{types}</Types>"
            ),
        ),
        (
            "_rels/.rels",
            format!(
                "{HEAD}<Relationships xmlns=\"{PACKAGE}/relationships\"><Relationship Id=\"r1\" \
                 Type=\"{OFFICE}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>"
            ),
        ),
        (
            "xl/workbook.xml",
            format!(
                "{HEAD}<workbook xmlns=\"{MAIN}\" xmlns:r=\"{OFFICE}\"><sheets>{listed}</sheets></workbook>"
            ),
        ),
        (
            "xl/_rels/workbook.xml.rels",
            format!("{HEAD}<Relationships xmlns=\"{PACKAGE}/relationships\">{related}</Relationships>"),
        ),
    ];
    let all = all.into_iter().map(|(name, text)| (name.to_owned(), text));
    all.chain(parts).collect()
}

fn zipped(parts: &[(String, String)]) -> zip::result::ZipResult<Vec<u8>> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, text) in parts {
        writer.start_file(name.as_str(), options)?;
        writer.write_all(text.as_bytes())?;
    }
    Ok(writer.finish()?.into_inner())
}
