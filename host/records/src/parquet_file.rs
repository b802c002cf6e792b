//! Parquet.

use super::table::Channel;
use bytes::Bytes;
use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, DoubleType};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::ColumnDescriptor;
use std::sync::Arc;
use yawrig_core::record::Record;

/// Numbers read at a time.
const BATCH: usize = 65_536;

pub(super) fn of_bytes(bytes: Bytes) -> std::result::Result<Vec<Channel>, String> {
    let reader = SerializedFileReader::new(bytes).map_err(|e| e.to_string())?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let columns = schema.columns().iter().enumerate();
    let channels = columns.map(|(index, column)| {
        let (unit, values) = match scale_of(column) {
            Ok(scale) => (scale.map(|_| "s".to_owned()), numbers(&reader, index, scale)),
            Err(why) => (None, Err(why)),
        };
        Channel { name: column.path().parts().join("/"), unit, step_s: None, values }
    });
    Ok(channels.collect())
}

/// Seconds in a unit of a column that holds times; none of one whose numbers are just that.
fn scale_of(column: &ColumnDescriptor) -> std::result::Result<Option<f64>, String> {
    if column.max_rep_level() > 0 {
        return Err("lists".to_owned());
    }
    let of = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e-3,
        TimeUnit::MICROS => 1e-6,
        TimeUnit::NANOS => 1e-9,
    };
    match (column.logical_type_ref(), column.converted_type()) {
        (Some(LogicalType::Timestamp(stamp)), _) => Ok(Some(of(&stamp.unit))),
        (Some(LogicalType::Time(time)), _) => Ok(Some(of(&time.unit))),
        (None, ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS) => Ok(Some(1e-3)),
        (None, ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS) => Ok(Some(1e-6)),
        (None | Some(LogicalType::Integer { .. }), ConvertedType::NONE) => Ok(None),
        (Some(LogicalType::Integer { .. }), _) => Ok(None),
        (Some(other), _) => Err(format!("{other:?}, which is not a plain number")),
        (None, other) => Err(format!("{other:?}, which is not a plain number")),
    }
}

/// The numbers of a column; times, of which `scale` is a unit, in seconds since the first.
fn numbers(
    reader: &SerializedFileReader<Bytes>,
    column: usize,
    scale: Option<f64>,
) -> std::result::Result<Vec<f64>, String> {
    let mut values = Vec::new();
    let mut first = None;
    // What has passed since some year leaves no digits for the time between samples.
    let mut whole = |x: i64| match scale {
        None => x as f64,
        Some(scale) => (x - *first.get_or_insert(x)) as f64 * scale,
    };
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(|e| e.to_string())?;
        let rows = group.metadata().num_rows() as usize;
        match group.get_column_reader(column).map_err(|e| e.to_string())? {
            ColumnReader::DoubleColumnReader(column) => take(column, rows, &mut values, |x| x),
            ColumnReader::FloatColumnReader(column) => take(column, rows, &mut values, f64::from),
            ColumnReader::Int32ColumnReader(column) => {
                take(column, rows, &mut values, |x| whole(i64::from(x)))
            }
            ColumnReader::Int64ColumnReader(column) => take(column, rows, &mut values, &mut whole),
            _ => Err("no numbers".to_owned()),
        }?;
    }
    Ok(values)
}

/// Appends the numbers of a group of rows; a row without one is a gap.
fn take<T: DataType>(
    mut column: ColumnReaderImpl<T>,
    rows: usize,
    to: &mut Vec<f64>,
    mut number: impl FnMut(T::T) -> f64,
) -> std::result::Result<(), String> {
    let mut taken = 0;
    while taken < rows {
        let (mut levels, mut values) = (Vec::new(), Vec::new());
        let (records, there, _) = column
            .read_records(BATCH.min(rows - taken), Some(&mut levels), None, &mut values)
            .map_err(|e| e.to_string())?;
        if records == 0 {
            return Err(format!("{taken} numbers of {rows}, the file is cut off"));
        }
        let mut values = values.into_iter();
        if there == records {
            to.extend(values.map(&mut number));
        } else {
            // A row holds a number where its level is that of the others that do.
            let full = levels.iter().copied().max().filter(|_| there > 0);
            to.extend(levels.iter().map(|level| match Some(*level) == full {
                true => values.next().map_or(f64::NAN, &mut number),
                false => f64::NAN,
            }));
        }
        taken += records;
    }
    Ok(())
}

pub(super) fn bytes(record: &Record) -> std::result::Result<Vec<u8>, String> {
    write(record).map_err(|e| e.to_string())
}

fn write(record: &Record) -> parquet::errors::Result<Vec<u8>> {
    let schema = "message record { REQUIRED DOUBLE time_s; REQUIRED DOUBLE yaw_deg; }";
    let schema = Arc::new(parse_message_type(schema)?);
    let properties =
        WriterProperties::builder().set_compression(parquet::basic::Compression::SNAPPY).build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for values in [&record.time_s, &record.yaw_deg] {
        if let Some(mut column) = group.next_column()? {
            column.typed::<DoubleType>().write_batch(values, None, None)?;
            column.close()?;
        }
    }
    group.close()?;
    writer.into_inner()
}
