//! Parquet.

use super::table::Channel;
use bytes::Bytes;
use parquet::basic::{ConvertedType, LogicalType};
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
    let channels = columns.map(|(index, column)| Channel {
        name: column.path().parts().join("/"),
        unit: None,
        step_s: None,
        values: is_number(column).and_then(|()| numbers(&reader, index)),
    });
    Ok(channels.collect())
}

/// That whole numbers of a column are just that.
fn is_number(column: &ColumnDescriptor) -> std::result::Result<(), String> {
    if column.max_rep_level() > 0 {
        return Err("lists".to_owned());
    }
    match (column.logical_type_ref(), column.converted_type()) {
        (None | Some(LogicalType::Integer { .. }), ConvertedType::NONE) => Ok(()),
        (Some(LogicalType::Integer { .. }), _) => Ok(()),
        (Some(other), _) => Err(format!("{other:?}, which is not a plain number")),
        (None, other) => Err(format!("{other:?}, which is not a plain number")),
    }
}

fn numbers(
    reader: &SerializedFileReader<Bytes>,
    column: usize,
) -> std::result::Result<Vec<f64>, String> {
    let mut values = Vec::new();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(|e| e.to_string())?;
        let rows = group.metadata().num_rows() as usize;
        match group.get_column_reader(column).map_err(|e| e.to_string())? {
            ColumnReader::DoubleColumnReader(column) => take(column, rows, &mut values, |x| x),
            ColumnReader::FloatColumnReader(column) => take(column, rows, &mut values, f64::from),
            ColumnReader::Int32ColumnReader(column) => take(column, rows, &mut values, f64::from),
            ColumnReader::Int64ColumnReader(column) => {
                take(column, rows, &mut values, |x| x as f64)
            }
            _ => Err("no numbers".to_owned()),
        }?;
    }
    Ok(values)
}

fn take<T: DataType>(
    mut column: ColumnReaderImpl<T>,
    rows: usize,
    to: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
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
        if there != records {
            return Err("holes without a number".to_owned());
        }
        to.extend(values.into_iter().map(&number));
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
