//! Workbooks of Excel and LibreOffice: the first sheet.

use super::grid;
use super::table::Channel;
use super::text::Row;
use calamine::{open_workbook, Data, Reader, Xlsx};
use std::path::Path;

const SECONDS_PER_DAY: f64 = 86_400.0;

pub(super) fn read(file: &Path) -> Result<Vec<Channel>, String> {
    let mut book: Xlsx<_> = open_workbook(file).map_err(|e: calamine::XlsxError| e.to_string())?;
    let sheet = book.worksheet_range_at(0).ok_or("there is no sheet in it")?;
    let sheet = sheet.map_err(|e| e.to_string())?;
    let first = sheet.start().map_or(0, |(row, _)| row as usize);
    let rows: Vec<Row> = sheet
        .rows()
        .enumerate()
        .map(|(index, cells)| Row {
            line: first + index + 1,
            fields: cells.iter().map(field).collect(),
            is_comment: false,
        })
        .filter(|row| row.fields.iter().any(|field| !field.is_empty()))
        .collect();
    grid::of_rows(&rows, true)
}

/// A cell as text would have it; times and dates are days there.
fn field(cell: &Data) -> String {
    match cell {
        Data::Float(value) => format!("{value}"),
        Data::DateTime(days) => format!("{}", days.as_f64() * SECONDS_PER_DAY),
        Data::Error(_) => String::new(),
        other => other.to_string().trim().to_owned(),
    }
}
