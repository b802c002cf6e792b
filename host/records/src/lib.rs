//! Records as files: text, workbooks, MATLAB, HDF5, TDMS and Parquet.
#![forbid(unsafe_code)]

// Its example is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

#[cfg(target_family = "wasm")]
mod absent;
mod archive;
mod asked;
mod clock;
mod columns;
mod computed;
mod csv_file;
mod cut;
pub mod format;
mod grid;
#[cfg(not(target_family = "wasm"))]
mod hdf5;
mod header;
mod kept;
mod labx;
mod lvm;
mod mat;
mod names;
mod once;
#[cfg(not(target_family = "wasm"))]
mod parquet_file;
pub mod place;
mod quantity;
mod source;
mod suggest;
mod sweep_file;
mod swing;
mod table;
mod tdms;
mod times;
mod tracker;
mod turns;
pub mod units;
mod when;
mod workbook;

pub use csv_file::{as_written, write, write_samples, write_samples_of, ACCEPTED_COLUMNS};
pub use kept::keep;
pub use quantity::Quantity;
pub use source::{content, content_when_read, holds, Content};
pub use sweep_file::read_sweep;
pub use table::{Channel, Selection};
pub use units::TimeUnit;

#[cfg(target_family = "wasm")]
use absent as hdf5;
#[cfg(target_family = "wasm")]
use absent as parquet_file;
use place::{Part, Times};
use quantity::Meant;
use std::ops::Range;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_core::identify::several;
use yawrig_core::record::{Called, Measurand, Record};

/// Reads one release of `r.csv#2`, what lies between two times of `r.csv#12.5s..40s`, or all of `r.csv`:
/// `time_s` and `yaw_deg` (or `yaw_rad`, converted) from a file: CSV, MATLAB, HDF5, TDMS or Parquet, whatever
/// it is called; `-` is standard input.
///
/// # Errors
/// Exit 3, naming file and line or sample: not readable, other columns, not a number, NaN or infinity, time
/// not increasing, nothing or too little in it.
pub fn read(file: &Path) -> Result<Record> {
    read_selected(file, &Selection::default())
}

/// The same with the channels that `selection` names, where their own names do not say what they are.
///
/// # Errors
/// As [`read`]; with the channels there are where it is not clear which are meant.
pub fn read_selected(named: &Path, selection: &Selection) -> Result<Record> {
    match place::is_standard_input(named) {
        true => part_of(named, selection, Selection::default()).map_err(source::said),
        // What neither the file nor the user says may have been said for its folder.
        false => part_of(named, selection, kept::for_record(&place::parted(named).0)?),
    }
}

fn part_of(named: &Path, selection: &Selection, kept: Selection) -> Result<Record> {
    let (file, part) = place::parted(named);
    let whole = once::whole(&file, [selection, &kept], || parsed(&file, selection, &kept))?;
    let all = || whole.record.clone();
    let mut record = match part {
        // What is said of one record goes before what is kept for its folder.
        Some(Part::Between(times)) => cut::between(all(), times, false)?,
        Some(Part::Release(number)) if kept.times() == Times::default() => {
            release(&whole.record, whole.releases(), number)?
        }
        Some(Part::Release(number)) => {
            let record = cut::between(all(), kept.times(), true)?;
            release(&record, &several::releases(&record), number)?
        }
        None => cut::between(all(), kept.times(), true)?,
    };
    record.file = named.to_owned();
    Ok(record)
}

/// All of `file`'s record, from the channels that are meant.
fn parsed(file: &Path, selection: &Selection, kept: &Selection) -> Result<Record> {
    let (format, bytes) = source::read(file)?;
    let file = source::shown(file);
    let in_order = format.has_columns();
    // A name for the motion changes nothing in how it is read.
    let reading = Selection { motion: None, ..selection.clone() };
    let ours = (format == format::Format::Csv && reading.is_empty() && csv_file::is_ours(&bytes))
        .then(|| csv_file::of_bytes(file, &bytes))
        .filter(|read| read.is_ok() || !csv_file::begins_anew(&bytes));
    let mut record = match ours {
        Some(read) => read?,
        None => {
            let table = format::channels(file, format, bytes)?;
            let with = |selection: &Selection| asked::record(file, &table, selection, in_order);
            let (record, notes) = match with(&reading) {
                Err(unclear) if kept.is_empty() => return Err(unclear),
                Err(_) => with(&reading.over(kept))?,
                Ok(read) => read,
            };
            say(file, &notes);
            record
        }
    };
    finish(&mut record, selection.motion.or(kept.motion));
    Ok(record)
}

/// The record in `channels` that are in memory, in the order in which somebody put them, as `selection` says.
///
/// # Errors
/// As [`read_selected`], calling it `name`.
pub fn of_channels(
    name: &Path,
    mut channels: Vec<Channel>,
    selection: &Selection,
) -> Result<Record> {
    format::with_units(&mut channels);
    let reading = Selection { motion: None, ..selection.clone() };
    let (mut record, notes) = asked::record(name, &channels, &reading, true)?;
    say(name, &notes);
    finish(&mut record, selection.motion);
    Ok(record)
}

fn say(file: &Path, notes: &[String]) {
    for note in notes {
        yawrig_base::warn!("{}: {note}", file.display());
    }
}

/// Takes out whole turns, and calls the motion as it is said to be called.
fn finish(record: &mut Record, called: Option<Called>) {
    if record.measurand.is_angle() {
        turns::take_out(&mut record.yaw_deg);
    }
    if let Some(called) = called {
        record.measurand = record.measurand.clone().called(called);
    }
}

/// What numbers in memory are by quantity, unit and motion of `said`, and by what they are multiplied to be
/// in the record's own unit; without a unit angles in deg.
///
/// # Errors
/// Exit 2 where the unit is none of the quantity.
///
/// ```
/// use yawrig_records::{measurand, Selection};
///
/// let said = Selection { unit: Some("rad/s".to_owned()), ..Selection::default() };
/// let (measurand, deg_s) = measurand(&said).unwrap();
/// assert_eq!((measurand.quantity(), measurand.unit(), deg_s.round()), ("rate", "deg/s", 57.0));
/// ```
pub fn measurand(said: &Selection) -> Result<(Measurand, f64)> {
    let unit = said.unit.as_deref().unwrap_or("deg");
    let Meant { measurand, scale } =
        quantity::meant(said.quantity, Some(unit)).map_err(|unclear| {
            Error::usage(unclear.said_of("the record", unit)).help(
            "say what it holds: quantity angle, rate, acceleration or displacement, and its unit",
        )
        })?;
    Ok((said.motion.map_or(measurand.clone(), |called| measurand.called(called)), scale))
}

/// A record in memory as one that was read: whole turns taken out.
///
/// # Errors
/// Exit 3, naming record and sample, for what is refused of a file.
pub fn checked(mut record: Record) -> Result<Record> {
    let column = quantity::column(&record.measurand);
    let notes = asked::settled(&mut record, &column)?;
    say(&record.file, &notes);
    finish(&mut record, None);
    Ok(record)
}

/// Release `number` of `record`, whose releases are `parts`.
fn release(record: &Record, parts: &[Range<usize>], number: usize) -> Result<Record> {
    let Some(part) = parts.get(number - 1) else {
        let what = format!("{} holds {} of them", record.file.display(), parts.len());
        return Err(Error::data(format!("there is no release {number}: {what}"))
            .help(format!("choose one from 1 to {}", parts.len())));
    };
    Ok(several::sliced(record, part))
}

/// What a file holds, whatever of it is meant.
///
/// # Errors
/// Exit 3 where it cannot be read.
pub fn channels(file: &Path) -> Result<Vec<Channel>> {
    let (format, bytes) = source::read(file)?;
    format::channels(source::shown(file), format, bytes)
}

/// How many releases a file holds, read as `selection` says.
///
/// # Errors
/// As [`read_selected`].
pub fn releases(file: &Path, selection: &Selection) -> Result<usize> {
    Ok(several::releases(&read_selected(file, selection)?).len())
}

/// Writes the record in the format that the name's ending says: csv, parquet, h5, hdf5 or mat (7.3).
///
/// # Errors
/// Exit 2 for another ending, exit 3 where the file cannot be written.
pub fn write_as(record: &Record, file: &Path) -> Result<()> {
    format::write(record, file)
}

#[cfg(test)]
mod tests;
