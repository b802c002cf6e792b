//! Workbooks of Excel, of today (`.xlsx`) and until 2003 (`.xls`), and of LibreOffice (`.ods`): the sheet that holds
//! the most rows of numbers, and others about as long.

use super::grid;
use super::table::Channel;
use calamine::{Data, Ods, Range, Reader, Xls, Xlsx};
use std::fmt::Display;
use std::io::{Cursor, Read, Seek};
use yawrig_text::rows::Row;
use zip::ZipArchive;

const SECONDS_PER_DAY: f64 = 86_400.0;

/// Channels of a sheet that is at least so long, of the longest, are among those to choose from.
const SHARE: f64 = 0.5;

/// As what its archive, if it is one, is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Xls,
    Xlsx,
    Ods,
}

/// Which workbook an archive is; `None` of one that is none.
pub(super) fn kind(archive: &ZipArchive<impl Read + Seek>) -> Option<Kind> {
    let of = |name: &str| match name {
        "[Content_Types].xml" => Some(Kind::Xlsx),
        "content.xml" => Some(Kind::Ods),
        _ => name.starts_with("xl/").then_some(Kind::Xlsx),
    };
    archive.file_names().flatten().find_map(|name| of(&name))
}

pub(super) fn of_bytes(kind: Kind, bytes: &[u8]) -> Result<Vec<Channel>, String> {
    let bytes = Cursor::new(bytes);
    match kind {
        Kind::Xls => of_book(Xls::new(bytes)),
        Kind::Xlsx => of_book(Xlsx::new(bytes)),
        Kind::Ods => of_book(Ods::new(bytes)),
    }
}

fn of_book<'a, B>(book: Result<B, B::Error>) -> Result<Vec<Channel>, String>
where
    B: Reader<Cursor<&'a [u8]>>,
    B::Error: Display,
{
    let mut book = book.map_err(|e| e.to_string())?;
    let names = book.sheet_names();
    let mut sheets: Vec<(String, Vec<Channel>)> = Vec::new();
    let mut why = "there is no sheet in it".to_owned();
    let longest = |channels: &[Channel]| {
        channels.iter().filter_map(|c| c.values.as_ref().ok()).map(Vec::len).max().unwrap_or(0)
    };
    for name in names {
        let sheet = book.worksheet_range(&name).map_err(|e| e.to_string());
        match sheet.and_then(|sheet| channels(&sheet)) {
            Ok(found) => sheets.push((name, found)),
            Err(reason) => why = format!("sheet {name}: {reason}"),
        }
    }
    let most = sheets.iter().map(|(_, channels)| longest(channels)).max().ok_or(why)?;
    // A few rows about the device or the calibration are no record.
    sheets.retain(|(_, channels)| longest(channels) as f64 >= SHARE * most as f64);
    if let [(_, _)] = sheets.as_slice() {
        return Ok(sheets.remove(0).1);
    }
    let named = |(sheet, channels): (String, Vec<Channel>)| {
        channels.into_iter().map(move |c| Channel { name: format!("{sheet}/{}", c.name), ..c })
    };
    Ok(sheets.into_iter().flat_map(named).collect())
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
            text: "",
        })
        .filter(|row| row.fields.iter().any(|field| !field.is_empty()))
        .collect();
    grid::of_rows(&rows)
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
