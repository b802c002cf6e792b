//! Records as CSV files.

use super::clock;
use super::quantity::{self, Meant};
use super::suggest;
use super::table::{FEWEST_SAMPLES, LONGEST_S};
use csv::ByteRecord;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_core::record::{Measurand, Record};

/// The first lines a record may have.
pub const ACCEPTED_COLUMNS: &str = "time_s,yaw_deg or time_s,yaw_rad";

/// A first line is looked for in so many bytes.
const LONGEST_HEADER: u64 = 65_536;

/// Rows between two looks at Ctrl-C.
const ROWS_PER_CHECK: usize = 100_000;

/// What stands in the second column, from the first line.
fn second_column(file: &Path, header: &ByteRecord) -> Result<Meant> {
    let names: Vec<String> = header
        .iter()
        .map(|name| String::from_utf8_lossy(name).trim_start_matches('\u{feff}').trim().to_owned())
        .collect();
    let named = |k: usize| names.get(k).map_or("NAME", String::as_str);
    let fail = |what: &str| {
        let columns = [("time", named(0)), ("yaw", named(1)), ("unit", "deg")];
        let command = suggest::reading(file, &columns);
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

/// What parts the columns: a comma, or where the first line has none a semicolon or a tabulator, as programs
/// write it where the comma is the decimal sign.
fn separator(file: &Path) -> std::io::Result<u8> {
    let mut line = Vec::new();
    let mut reader = BufReader::new(File::open(file)?.take(LONGEST_HEADER));
    // Empty lines at the beginning are passed over when the file is read, too.
    while reader.read_until(b'\n', &mut line)? > 0 && line.trim_ascii().is_empty() {}
    let others = [b';', b'\t'].into_iter().filter(|other| line.contains(other));
    Ok(others.take_while(|_| !line.contains(&b',')).next().unwrap_or(b','))
}

/// A finite number, or why it is none. A comma is its decimal sign where it does not part the columns.
fn number(field: &[u8], separator: u8) -> std::result::Result<f64, String> {
    let text = String::from_utf8_lossy(field);
    let is_decimal = separator != b',' && !text.contains('.') && text.matches(',').count() == 1;
    let parsed = match is_decimal {
        true => text.replace(',', ".").parse::<f64>(),
        false => text.parse(),
    };
    match parsed {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(format!("{text:?} is not a finite number")),
        Err(_) => Err(format!("{text:?} is not a number")),
    }
}

pub(super) fn read(file: &Path) -> Result<Record> {
    let named = file.display();
    let unreadable = |e: &dyn std::fmt::Display| {
        Error::data(format!("cannot read {named}: {e}")).help("give the path of a CSV record")
    };
    if file.is_dir() {
        return Err(unreadable(&"it is a folder"));
    }
    let separator = separator(file).map_err(|e| unreadable(&e))?;
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_path(file)
        .map_err(|e| unreadable(&e))?;
    let mut row = ByteRecord::new();
    if !reader.read_byte_record(&mut row).map_err(|e| unreadable(&e))? {
        return Err(Error::data(format!("{named}, line 1: the file is empty"))
            .help(format!("a record starts with {ACCEPTED_COLUMNS}")));
    }
    let Meant { measurand, scale } = second_column(file, &row)?;
    let yaw_name = String::from_utf8_lossy(&row[1]).into_owned();
    let as_gaps = format!(
        "where it is a gap, leave the field empty, or read it so: {}",
        suggest::reading(file, &[("yaw", &yaw_name)])
    );
    let mut record = Record::new(file.to_owned(), Vec::new(), Vec::new());
    record.measurand = measurand;
    let mut line = 1;
    while reader.read_byte_record(&mut row).map_err(|e| unreadable(&e))? {
        line = row.position().map_or(line + 1, csv::Position::line);
        let fail = |what: String, help: &str| {
            Error::data(format!("{named}, line {line}: {what}")).help(help.to_owned())
        };
        if row.len() != 2 {
            let what = match row.len() {
                1 => "one field instead of two".to_owned(),
                more => format!("{more} fields instead of two"),
            };
            return Err(fail(what, "each line holds a time and an angle, with a decimal point"));
        }
        let repair = "correct this line or leave it out";
        let time_s =
            number(&row[0], separator).map_err(|why| fail(format!("time_s: {why}"), repair))?;
        // An empty cell is a gap.
        if row[1].is_empty() {
            continue;
        }
        let is_gap = row[1].eq_ignore_ascii_case(b"nan");
        let repair = if is_gap { as_gaps.as_str() } else { repair };
        let yaw =
            number(&row[1], separator).map_err(|why| fail(format!("yaw angle: {why}"), repair))?;
        if let Some(&before) = record.time_s.last().filter(|before| time_s < **before) {
            let what = format!("time runs backwards, from {before} s to {time_s} s");
            let command = suggest::by_rate(&record, record.len(), time_s, &yaw_name);
            let sort = "sort the record by time, or cut it here".to_owned();
            return Err(fail(what, &command.unwrap_or(sort)));
        }
        // A clock set anew in mid-record, or seconds since 1970 after seconds since the start: to fill
        // such a gap at the device's rate would take more memory than there is.
        if record.time_s.first().is_some_and(|first| time_s - first > LONGEST_S) {
            let what =
                format!("time runs on to {time_s} s, more than a day after the first sample");
            return Err(fail(what, "cut the record here, or give time_s in seconds"));
        }
        let yaw_deg = yaw * scale;
        if !yaw_deg.is_finite() {
            return Err(fail(format!("yaw angle: {yaw} is too large"), repair));
        }
        record.time_s.push(time_s);
        record.yaw_deg.push(yaw_deg);
        if record.len().is_multiple_of(ROWS_PER_CHECK) {
            interrupt::check()?;
        }
    }
    clock::spread(&mut record);
    if record.len() < FEWEST_SAMPLES {
        return Err(Error::data(format!(
            "{named}, line {line}: the record ends after {} samples, too short for three cycles",
            record.len()
        ))
        .help("record at least three cycles of the free decay"));
    }
    Ok(record)
}

/// Whether the first line is that of a record of ours, or there is none.
pub(super) fn is_ours(file: &Path) -> Result<bool> {
    let unreadable = |e: std::io::Error| {
        Error::data(format!("cannot read {}: {e}", file.display()))
            .help("give the path of a CSV record")
    };
    let mut line = Vec::new();
    let mut reader = BufReader::new(File::open(file).map_err(unreadable)?.take(LONGEST_HEADER));
    while line.trim_ascii().is_empty() {
        line.clear();
        if reader.read_until(b'\n', &mut line).map_err(unreadable)? == 0 {
            return Ok(true);
        }
    }
    let text = String::from_utf8_lossy(&line);
    let names: Vec<&str> = text.trim_start_matches('\u{feff}').split([',', ';', '\t']).collect();
    Ok(names[0].trim() == "time_s" && names.len() <= 2)
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
