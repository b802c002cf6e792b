//! Which format a file has, by what stands in it, and what is written under which name.

use super::names;
use super::table::Channel;
use super::{archive, csv_file, grid, hdf5, labx, lvm, mat, parquet_file, tdms, tracker, workbook};
use bytes::Bytes;
use std::io::Cursor;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_core::record::Record;
use yawrig_text::rows;
use zip::ZipArchive;

/// A format that records are read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Csv,
    /// MATLAB's own until version 7; from 7.3 on its files are HDF5.
    Mat,
    Hdf5,
    Tdms,
    Parquet,
    /// A workbook of Excel or LibreOffice, or an archive of texts.
    Zip,
    /// A workbook of Excel until 2003.
    Xls,
    /// Leybold's CASSY Lab.
    Labx,
    /// Tracker's points on pictures.
    Tracker,
}

impl Format {
    /// Whether its channels stand beside each other as somebody wrote them, and not by their names or by
    /// chance.
    pub(super) fn has_columns(self) -> bool {
        !matches!(self, Self::Mat | Self::Hdf5)
    }
}

/// Whether a file's name ends as those of records do.
pub fn is_named_so(file: &Path) -> bool {
    const ENDINGS: [&str; 19] = [
        "csv", "tsv", "txt", "dat", "asc", "lvm", "labx", "xlsx", "xls", "ods", "zip", "mat", "h5",
        "hdf5", "tdms", "parquet", "gz", "trk", "trz",
    ];
    let ending = file.extension();
    ending.is_some_and(|e| ENDINGS.iter().any(|ending| e.eq_ignore_ascii_case(ending)))
}

/// The format of a file that begins so; what is nothing else is taken for CSV.
///
/// # Errors
/// Exit 3 for a relative of these formats that is not read.
pub(super) fn of(file: &Path, head: &[u8]) -> Result<Format> {
    let named = file.display();
    const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
    // It may stand after a block for others, as MATLAB's.
    if [0, 512, 1024, 2048]
        .into_iter()
        .any(|at| head.get(at..).is_some_and(|b| b.starts_with(HDF5)))
    {
        return Ok(Format::Hdf5);
    }
    if head.starts_with(b"MATLAB 5.0 MAT-file") {
        return Ok(Format::Mat);
    }
    if head.starts_with(b"PK\x03\x04") {
        return Ok(Format::Zip);
    }
    if head.starts_with(b"\xd0\xcf\x11\xe0") {
        return Ok(Format::Xls);
    }
    if head.starts_with(b"PAR1") {
        return Ok(Format::Parquet);
    }
    if head.starts_with(b"TDSm") {
        return Ok(Format::Tdms);
    }
    if head.starts_with(b"TDSh") {
        return Err(Error::data(format!("{named} is a TDMS index, without the samples"))
            .help("give the .tdms file beside it"));
    }
    if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("mat")) {
        return Err(Error::data(format!("{named} is not a MAT-file of version 5 or 7.3"))
            .help("save it again in MATLAB with -v7 or -v7.3"));
    }
    let is_wide = matches!(
        head,
        [0xff, 0xfe, ..]
            | [0xfe, 0xff, ..]
            | [1..=255, 0, 1..=255, 0, ..]
            | [0, 1..=255, 0, 1..=255, ..]
    );
    if head.contains(&0) && !is_wide {
        return Err(Error::data(format!("{named} is neither text nor of a format that is read"))
            .help("give a record: CSV with time_s,yaw_deg, MATLAB, HDF5, TDMS or Parquet"));
    }
    Ok(match head {
        _ if labx::is_one(head) => Format::Labx,
        _ if tracker::is_one(head) => Format::Tracker,
        _ => Format::Csv,
    })
}

/// Whether a text is a record in CSV and not a file of another kind.
pub fn is_record(text: &str) -> bool {
    text.trim_start_matches('\u{feff}').trim_start().starts_with("time_s")
}

/// The channels of a file, of which these are the bytes.
pub(super) fn channels(file: &Path, format: Format, bytes: Bytes) -> Result<Vec<Channel>> {
    let read = match format {
        Format::Csv => text_channels(&rows::decoded(&bytes)),
        Format::Mat => mat::of_bytes(&bytes),
        Format::Hdf5 => hdf5::of_bytes(bytes),
        Format::Tdms => tdms::of_bytes(&bytes),
        Format::Parquet => parquet_file::of_bytes(bytes),
        // A workbook is an archive, too.
        Format::Zip => match ZipArchive::new(Cursor::new(&bytes)) {
            Ok(archive) => match workbook::kind(&archive) {
                Some(kind) => workbook::of_bytes(kind, &bytes),
                None => archive::read(archive),
            },
            Err(why) => Err(why.to_string()),
        },
        Format::Xls => workbook::of_bytes(workbook::Kind::Xls, &bytes),
        Format::Tracker => tracker::of_text(&rows::decoded(&bytes)),
        Format::Labx => labx::of_text(&rows::decoded(&bytes)),
    };
    let mut channels = read.map_err(|why| {
        Error::data(format!("cannot read {}: {why}", file.display()))
            .help("export the record again, or as CSV with time_s,yaw_deg")
    })?;
    with_units(&mut channels);
    Ok(channels)
}

/// Gives channels the units that their names say, where nothing else says one.
pub(super) fn with_units(channels: &mut [Channel]) {
    for channel in channels.iter_mut().filter(|channel| channel.unit.is_none()) {
        channel.unit = names::unit_in(channel.own_name());
    }
}

/// The channels of a text, whatever parts its columns.
fn text_channels(text: &str) -> std::result::Result<Vec<Channel>, String> {
    match lvm::is_one(text) {
        true => lvm::of_text(text),
        false => grid::of_text(text),
    }
}

/// Writes a record under a name whose ending says the format.
///
/// # Errors
/// Exit 2 for another ending, exit 3 where the file cannot be written.
pub(super) fn write(record: &Record, file: &Path) -> Result<()> {
    let ending = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let bytes = match ending.as_str() {
        "csv" => return csv_file::write(record, file),
        "parquet" | "h5" | "hdf5" | "mat" if !record.measurand.is_angle() => {
            return Err(Error::usage(format!(
                "{}: a {} is written to .csv only, whose header keeps its unit",
                file.display(),
                record.measurand.quantity()
            ))
            .help("give it a name that ends in .csv"))
        }
        "parquet" => parquet_file::bytes(record),
        "h5" | "hdf5" => hdf5::bytes(record),
        "mat" => hdf5::mat_bytes(record),
        "tdms" => {
            return Err(Error::usage("TDMS is read and not written")
                .help("give the record a name that ends in .csv, .parquet, .h5 or .mat"))
        }
        _ => {
            return Err(Error::usage(format!(
                "the name of {} does not say which format to write",
                file.display()
            ))
            .help("give it a name that ends in .csv, .parquet, .h5 or .mat"))
        }
    };
    files::write_atomically(file, &bytes.map_err(|e| files::cannot_write(file, &e))?)
}
