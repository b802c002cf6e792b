//! Workbooks of Excel and LibreOffice: the sheet that holds the most rows of numbers.

use super::grid;
use super::table::Channel;
use super::text::Row;
use calamine::{open_workbook, Data, Range, Reader, Xlsx};
use std::path::Path;

const SECONDS_PER_DAY: f64 = 86_400.0;

pub(super) fn read(file: &Path) -> Result<Vec<Channel>, String> {
    let mut book: Xlsx<_> = open_workbook(file).map_err(|e: calamine::XlsxError| e.to_string())?;
    let names = book.sheet_names();
    let mut best: Option<Vec<Channel>> = None;
    let mut why = "there is no sheet in it".to_owned();
    let longest = |channels: &[Channel]| {
        channels.iter().filter_map(|c| c.values.as_ref().ok()).map(Vec::len).max().unwrap_or(0)
    };
    for name in names {
        let sheet = book.worksheet_range(&name).map_err(|e| e.to_string());
        match sheet.and_then(|sheet| channels(&sheet)) {
            Ok(found) if best.as_ref().is_none_or(|b| longest(b) < longest(&found)) => {
                best = Some(found)
            }
            Ok(_) => {}
            Err(reason) => why = format!("sheet {name}: {reason}"),
        }
    }
    best.ok_or(why)
}

fn channels(sheet: &Range<Data>) -> Result<Vec<Channel>, String> {
    let first = sheet.start().map_or(0, |(row, _)| row as usize);
    let rows: Vec<Row> = sheet
        .rows()
        .enumerate()
        .map(|(index, cells)| Row {
            line: first + index + 1,
            fields: cells.iter().map(|cell| field(cell).into()).collect(),
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
