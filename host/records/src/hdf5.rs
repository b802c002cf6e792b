//! HDF5, with MATLAB's files from version 7.3 on.

use super::mat;
use super::table::Channel;
use bytes::Bytes;
use hdf5_pure::mat::{MatBuilder, Options};
use hdf5_pure::{AttrValue, DType, Dataset, File, FileBuilder, Group};
use yawrig_core::record::Record;

/// Groups in groups, at most.
const DEEPEST: usize = 8;

pub(super) fn of_bytes(bytes: Bytes) -> std::result::Result<Vec<Channel>, String> {
    let opened = File::from_bytes(bytes.into()).map_err(|e| e.to_string())?;
    let mut channels = Vec::new();
    gather(&opened.root(), "", DEEPEST, &mut channels)?;
    Ok(channels)
}

fn gather(
    group: &Group,
    prefix: &str,
    deep: usize,
    channels: &mut Vec<Channel>,
) -> std::result::Result<(), String> {
    for name in group.datasets().map_err(|e| e.to_string())? {
        let dataset = group.dataset(&name).map_err(|e| e.to_string())?;
        if let Some(columns) = columns_of(&dataset) {
            for (k, column) in columns.into_iter().enumerate() {
                let name = format!("{prefix}{}", mat::column_name(&name, k));
                channels.push(Channel { name, unit: None, step_s: None, values: Ok(column) });
            }
            continue;
        }
        channels.push(Channel {
            name: format!("{prefix}{name}"),
            unit: unit(&dataset),
            step_s: None,
            values: numbers(&dataset),
        });
    }
    if deep == 0 {
        return Ok(());
    }
    for name in group.groups().map_err(|e| e.to_string())? {
        // MATLAB keeps there what is no variable.
        if name.starts_with('#') {
            continue;
        }
        let inner = group.group(&name).map_err(|e| e.to_string())?;
        gather(&inner, &format!("{prefix}{name}/"), deep - 1, channels)?;
    }
    Ok(())
}

/// The columns of a matrix, along its longer side; MATLAB's stand there as rows.
fn columns_of(dataset: &Dataset) -> Option<Vec<Vec<f64>>> {
    let shape = dataset.shape().ok()?;
    let &[rows, columns] = shape.as_slice() else { return None };
    let (rows, columns) = (rows as usize, columns as usize);
    let least = rows.min(columns);
    if !(2..=mat::MOST_COLUMNS).contains(&least) || rows == columns {
        return None;
    }
    let values = dataset.read_f64().ok().filter(|v| v.len() == rows * columns)?;
    let at = |k: usize, i: usize| {
        if rows < columns {
            values[k * columns + i]
        } else {
            values[i * columns + k]
        }
    };
    Some((0..least).map(|k| (0..rows.max(columns)).map(|i| at(k, i)).collect()).collect())
}

fn unit(dataset: &Dataset) -> Option<String> {
    let attributes = dataset.attrs().ok()?;
    ["units", "unit"].into_iter().find_map(|name| match attributes.get(name)? {
        AttrValue::String(text)
        | AttrValue::AsciiString(text)
        | AttrValue::VarLenString(text)
        | AttrValue::VarLenAsciiString(text)
        | AttrValue::StringSized { value: text, .. }
        | AttrValue::AsciiStringSized { value: text, .. } => Some(text.clone()),
        _ => None,
    })
}

fn numbers(dataset: &Dataset) -> std::result::Result<Vec<f64>, String> {
    use DType::{F32, F64, I16, I32, I64, I8, U16, U32, U64, U8};
    let fail = |e: hdf5_pure::Error| e.to_string();
    let shape = dataset.shape().map_err(fail)?;
    if shape.iter().filter(|n| **n != 1).count() > 1 {
        let shape: Vec<String> = shape.iter().map(u64::to_string).collect();
        return Err(format!("a {} array", shape.join(" by ")));
    }
    match dataset.dtype().map_err(fail)? {
        F32 | F64 | I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64 => dataset.read_f64().map_err(fail),
        _ => Err("no numbers".to_owned()),
    }
}

pub(super) fn bytes(record: &Record) -> std::result::Result<Vec<u8>, String> {
    let mut builder = FileBuilder::new();
    for (name, unit, values) in columns(record) {
        builder
            .create_dataset(name)
            .with_f64_data(values)
            .with_shape(&[values.len() as u64])
            .set_attr("units", AttrValue::AsciiString(unit.into()));
    }
    builder.finish().map_err(|e| e.to_string())
}

pub(super) fn mat_bytes(record: &Record) -> std::result::Result<Vec<u8>, String> {
    let mut builder = MatBuilder::new(Options::default());
    for (name, _, values) in columns(record) {
        builder.write_f64(name, &[values.len(), 1], values).map_err(|e| e.to_string())?;
    }
    builder.finish().map_err(|e| e.to_string())
}

fn columns(record: &Record) -> [(&'static str, &'static str, &[f64]); 2] {
    [("time_s", "s", &record.time_s), ("yaw_deg", "deg", &record.yaw_deg)]
}
