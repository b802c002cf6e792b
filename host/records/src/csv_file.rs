//! Records as CSV files.

use super::asked;
use super::clock;
use super::grid;
use super::quantity::{self, Meant};
use super::suggest;
use super::table::{Selection, LONGEST_S, MIN_SAMPLES};
use csv::ByteRecord;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_core::record::{Measurand, Record};
use yawrig_text::rows;

/// The first lines a record may have.
pub const ACCEPTED_COLUMNS: &str = "time_s,yaw_deg or time_s,yaw_rad";

/// Rows between two looks at Ctrl-C.
const ROWS_PER_CHECK: usize = 100_000;

/// What stands in the second column, from the first line.
fn second_column(file: &Path, header: &ByteRecord, bytes: &[u8]) -> Result<Meant> {
    let names: Vec<String> = header
        .iter()
        .map(|name| String::from_utf8_lossy(name).trim_start_matches('\u{feff}').trim().to_owned())
        .collect();
    let fail = |what: &str| {
        let table = grid::of_text(&rows::decoded(bytes)).unwrap_or_default();
        let command = asked::command(file, &table, &Selection::default(), true);
        Error::data(format!("{}, line 1: {what}", file.display()))
            .help(format!("make the first line {ACCEPTED_COLUMNS}, or name its columns: {command}"))
    };
    match names.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["time_s", name] => quantity::of_column(name)
            .ok_or_else(|| fail(&format!("the second column is {name:?}, not yaw_deg or yaw_rad"))),
        [other, _] => Err(fail(&format!("the first column is {other:?}, not time_s"))),
        [_] => Err(fail("one column instead of two")),
        _ => Err(fail(&format!("{} columns instead of two", names.len()))),
    }
}

/// The first line with something in it.
fn first_line(bytes: &[u8]) -> Option<&[u8]> {
    bytes.split(|b| *b == b'\n').find(|line| !line.trim_ascii().is_empty())
}

/// What parts the columns: a comma, or where the first line has none a semicolon or a tabulator, as programs
/// write it where the comma is the decimal sign.
fn separator(bytes: &[u8]) -> u8 {
    let line = first_line(bytes).unwrap_or_default();
    let others = [b';', b'\t'].into_iter().filter(|other| line.contains(other));
    others.take_while(|_| !line.contains(&b',')).next().unwrap_or(b',')
}

/// A finite number, or why it is none. A comma is its decimal sign where it does not part the columns.
fn number(field: &[u8], separator: u8) -> std::result::Result<f64, String> {
    let text = String::from_utf8_lossy(field.trim_ascii());
    let is_decimal = separator != b',' && !text.contains('.') && text.matches(',').count() == 1;
    let parsed = match is_decimal {
        true => text.replace(',', ".").parse::<f64>(),
        false => text.parse().or_else(|_| text.replacen('\u{2212}', "-", 1).parse()),
    };
    match parsed {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(format!("{text:?} is not a finite number")),
        Err(_) => Err(format!("{text:?} is not a number")),
    }
}

/// What is wrong with a line, and what to do.
type Wrong = (String, String);

const REPAIR: &str = "correct this line or leave it out";

/// Time and motion of a line; none where the cell of the motion is empty, which is a gap.
fn sample(
    row: &ByteRecord,
    separator: u8,
    as_gaps: impl Fn() -> String,
) -> std::result::Result<Option<(f64, f64)>, Wrong> {
    if row.len() != 2 {
        let what = match row.len() {
            1 => "one field instead of two".to_owned(),
            more => format!("{more} fields instead of two"),
        };
        let help = "each line holds a time and an angle, with a decimal point";
        return Err((what, help.to_owned()));
    }
    let time_s =
        number(&row[0], separator).map_err(|why| (format!("time_s: {why}"), REPAIR.to_owned()))?;
    let cell = row[1].trim_ascii();
    if cell.is_empty() {
        return Ok(None);
    }
    let yaw = number(cell, separator).map_err(|why| {
        let is_gap = cell.eq_ignore_ascii_case(b"nan");
        (format!("yaw angle: {why}"), if is_gap { as_gaps() } else { REPAIR.to_owned() })
    })?;
    Ok(Some((time_s, yaw)))
}

/// Whether `time_s` goes on where `record` ends.
fn goes_on(record: &Record, time_s: f64, yaw_name: &str) -> std::result::Result<(), Wrong> {
    if let Some(&before) = record.time_s.last().filter(|before| time_s < **before) {
        let what = format!("time runs backwards, from {before} s to {time_s} s");
        let command = suggest::by_rate(record, record.len(), time_s, yaw_name);
        let sort = || "sort the record by time, or cut it here".to_owned();
        return Err((what, command.unwrap_or_else(sort)));
    }
    // A clock set anew in mid-record, or seconds since 1970 after seconds since the start: to fill such a gap
    // at the device's rate would take more memory than there is.
    if record.time_s.first().is_some_and(|first| time_s - first > LONGEST_S) {
        let what = format!("time runs on to {time_s} s, more than a day after the first sample");
        return Err((what, "cut the record here, or give time_s in seconds".to_owned()));
    }
    Ok(())
}

/// The record that these bytes of `file` are.
pub(super) fn of_bytes(file: &Path, bytes: &[u8]) -> Result<Record> {
    let at =
        |line: u64, what: String| Error::data(format!("{}, line {line}: {what}", file.display()));
    let unreadable = |e: csv::Error| {
        Error::data(format!("cannot read {}: {e}", file.display()))
            .help("give the path of a CSV record")
    };
    let separator = separator(bytes);
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .flexible(true)
        .from_reader(bytes);
    let mut row = ByteRecord::new();
    if !reader.read_byte_record(&mut row).map_err(unreadable)? {
        return Err(at(1, "the file is empty".to_owned())
            .help(format!("a record starts with {ACCEPTED_COLUMNS}")));
    }
    let Meant { measurand, scale } = second_column(file, &row, bytes)?;
    let yaw_name = String::from_utf8_lossy(row[1].trim_ascii()).into_owned();
    let as_gaps = || {
        let command = suggest::reading(file, &[("yaw", &yaw_name)]);
        format!("where it is a gap, leave the field empty, or read it so: {command}")
    };
    let mut record = Record::new(file.to_owned(), Vec::new(), Vec::new());
    record.measurand = measurand;
    let mut line = 1;
    while reader.read_byte_record(&mut row).map_err(unreadable)? {
        line = row.position().map_or(line + 1, csv::Position::line);
        let wrong = |(what, help): Wrong| at(line, what).help(help);
        let Some((time_s, yaw)) = sample(&row, separator, as_gaps).map_err(wrong)? else {
            continue;
        };
        goes_on(&record, time_s, &yaw_name).map_err(wrong)?;
        let yaw_deg = yaw * scale;
        if !yaw_deg.is_finite() {
            return Err(wrong((format!("yaw angle: {yaw} is too large"), REPAIR.to_owned())));
        }
        record.time_s.push(time_s);
        record.yaw_deg.push(yaw_deg);
        if record.len().is_multiple_of(ROWS_PER_CHECK) {
            interrupt::check()?;
        }
    }
    clock::spread(&mut record)
        .map_err(|why| at(line, why).help("give the times in smaller parts of a second"))?;
    if record.len() < MIN_SAMPLES {
        let what =
            format!("the record ends after {} samples, too short for three cycles", record.len());
        return Err(at(line, what).help("record at least three cycles of the free decay"));
    }
    Ok(record)
}

/// Whether the first line is that of a record of ours, or there is none.
pub(super) fn is_ours(bytes: &[u8]) -> bool {
    let Some(line) = first_line(bytes) else { return true };
    let text = String::from_utf8_lossy(line);
    let names: Vec<&str> = text.trim_start_matches('\u{feff}').split([',', ';', '\t']).collect();
    names[0].trim() == "time_s" && names.len() <= 2
}

/// Whether the first line comes once more: a second recording begins there.
pub(super) fn begins_anew(bytes: &[u8]) -> bool {
    let Some(first) = first_line(bytes).map(<[u8]>::trim_ascii) else { return false };
    bytes.split(|b| *b == b'\n').filter(|line| line.trim_ascii() == first).count() > 1
}

/// Writes `time_s,yaw_deg` with microdegrees and microseconds, or another quantity with its unit and all its
/// digits, whole or not at all.
///
/// # Errors
/// Exit 3 where the file cannot be written, 130 where the user stops it.
pub fn write(record: &Record, file: &Path) -> Result<()> {
    let samples = record.time_s.iter().copied().zip(record.yaw_deg.iter().copied());
    write_samples_of(file, &record.measurand, samples)
}

/// To a microsecond and a microdegree.
const DECIMALS: usize = 6;

/// Time and angle as a file holds them.
pub fn as_written((time_s, yaw_deg): (f64, f64)) -> (f64, f64) {
    let read = |number: f64| format!("{number:.DECIMALS$}").parse().unwrap_or(number);
    (read(time_s), read(yaw_deg))
}

/// Writes (time in s, yaw angle in deg) as they come, whole or not at all.
///
/// # Errors
/// Exit 3 where the file cannot be written, 130 where the user stops it.
pub fn write_samples(file: &Path, samples: impl Iterator<Item = (f64, f64)>) -> Result<()> {
    write_samples_of(file, &Measurand::default(), samples)
}

/// The same of (time in s, what `measurand` says).
///
/// # Errors
/// Exit 3 where the file cannot be written, 130 where the user stops it.
pub fn write_samples_of(
    file: &Path,
    measurand: &Measurand,
    samples: impl Iterator<Item = (f64, f64)>,
) -> Result<()> {
    files::write_atomically_with(file, |out| {
        let fail = |e: std::io::Error| files::cannot_write(file, &e);
        writeln!(out, "time_s,{}", quantity::column(measurand)).map_err(fail)?;
        for (row, (time_s, yaw_deg)) in samples.enumerate() {
            // A displacement may be of any size.
            let written = match measurand.is_of_angle() {
                true => writeln!(out, "{time_s:.DECIMALS$},{yaw_deg:.DECIMALS$}"),
                false => writeln!(out, "{time_s:.DECIMALS$},{yaw_deg}"),
            };
            written.map_err(fail)?;
            if row % ROWS_PER_CHECK == 0 {
                interrupt::check()?;
            }
        }
        Ok(())
    })
}
