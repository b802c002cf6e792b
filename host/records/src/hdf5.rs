//! HDF5, with MATLAB's files from version 7.3 on.

use super::mat;
use super::table::Channel;
use bytes::Bytes;
use hdf5_pure::mat::{MatBuilder, Options};
use hdf5_pure::{
    AttrValue, CompoundMember, DType, Dataset, Datatype, DatatypeByteOrder, File, FileBuilder,
    Group,
};
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
        if let Some(fields) = fields_of(&dataset) {
            channels.extend(fields.into_iter().map(|(field, values)| Channel {
                name: format!("{prefix}{name}/{field}"),
                unit: None,
                step_s: None,
                values,
            }));
            continue;
        }
        if let Some(columns) = columns_of(&dataset) {
            for (k, column) in columns.into_iter().enumerate() {
                let name = format!("{prefix}{}", mat::column_name(&name, k));
                let (unit, values) = (unit(&dataset), Ok(column));
                channels.push(Channel { name, unit, step_s: None, values });
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
    if !(2..=mat::MAX_COLUMNS).contains(&least) || rows == columns {
        return None;
    }
    let values = scaled(dataset, dataset.read_f64().ok()?);
    if values.len() != rows * columns {
        return None;
    }
    let at = |k: usize, i: usize| {
        if rows < columns {
            values[k * columns + i]
        } else {
            values[i * columns + k]
        }
    };
    Some((0..least).map(|k| (0..rows.max(columns)).map(|i| at(k, i)).collect()).collect())
}

/// A column of a table: its name, and its numbers or why it has none.
type Field = (String, std::result::Result<Vec<f64>, String>);

/// The members of a table of numbers, each a column.
fn fields_of(dataset: &Dataset) -> Option<Vec<Field>> {
    let Datatype::Compound { size, members } = dataset.datatype().ok()? else { return None };
    if size == 0 {
        return None;
    }
    let rows = dataset.read_raw().ok()?;
    let of = |member: &CompoundMember| {
        let at = member.byte_offset as usize;
        let number = |row: &[u8]| number(&member.datatype, row.get(at..)?);
        let values: Option<Vec<f64>> = rows.chunks_exact(size as usize).map(number).collect();
        (member.name.clone(), values.ok_or_else(|| "no numbers".to_owned()))
    };
    Some(members.iter().map(of).collect())
}

/// The number of this kind that `bytes` begin with.
fn number(kind: &Datatype, bytes: &[u8]) -> Option<f64> {
    let (size, order, is_float, signed) = match kind {
        Datatype::FixedPoint { size, byte_order, layout } => {
            (*size, byte_order, false, layout.signed)
        }
        Datatype::FloatingPoint { size, byte_order, .. } => (*size, byte_order, true, true),
        _ => return None,
    };
    let mut eight = [0; 8];
    let size = size as usize;
    let own = bytes.get(..size).filter(|_| (1..=8).contains(&size))?;
    match order {
        DatatypeByteOrder::LittleEndian => eight[..size].copy_from_slice(own),
        DatatypeByteOrder::BigEndian => {
            eight[..size].iter_mut().zip(own.iter().rev()).for_each(|(to, from)| *to = *from);
        }
        DatatypeByteOrder::Vax => return None,
    }
    let bits = u64::from_le_bytes(eight);
    Some(match (is_float, size) {
        (true, 8) => f64::from_bits(bits),
        (true, 4) => f64::from(f32::from_bits(bits as u32)),
        (true, _) => return None,
        (false, _) if signed => {
            let shift = 64 - 8 * size as u32;
            ((bits << shift) as i64 >> shift) as f64
        }
        (false, _) => bits as f64,
    })
}

fn unit(dataset: &Dataset) -> Option<String> {
    let attributes = dataset.attrs().ok()?;
    let text = ["units", "unit"].into_iter().find_map(|name| match attributes.get(name)? {
        AttrValue::String(text)
        | AttrValue::AsciiString(text)
        | AttrValue::VarLenString(text)
        | AttrValue::VarLenAsciiString(text)
        | AttrValue::StringSized { value: text, .. }
        | AttrValue::AsciiStringSized { value: text, .. } => Some(text.clone()),
        _ => None,
    })?;
    // `days since 1970-01-01`, as the convention for climate has it.
    Some(text.split(" since ").next().unwrap_or_default().to_owned())
}

/// What `values` that were packed stand for, by the attributes that say so: `scale_factor`, `add_offset`; the
/// `_FillValue` is none.
fn scaled(dataset: &Dataset, mut values: Vec<f64>) -> Vec<f64> {
    let Ok(attributes) = dataset.attrs() else { return values };
    let of = |name: &str| as_number(attributes.get(name)?);
    for fill in ["_FillValue", "missing_value"].into_iter().filter_map(of) {
        values.iter_mut().filter(|value| **value == fill).for_each(|value| *value = f64::NAN);
    }
    let (scale, offset) = (of("scale_factor").unwrap_or(1.0), of("add_offset").unwrap_or(0.0));
    if (scale, offset) != (1.0, 0.0) {
        values.iter_mut().for_each(|value| *value = *value * scale + offset);
    }
    values
}

fn as_number(value: &AttrValue) -> Option<f64> {
    fn one<T: Copy + TryInto<i64>>(values: &[T]) -> Option<f64> {
        let whole: i64 = (*values.first()?).try_into().ok()?;
        Some(whole as f64)
    }
    match value {
        AttrValue::F32(x) => Some(f64::from(*x)),
        AttrValue::F64(x) => Some(*x),
        AttrValue::F32Array(x) => x.first().map(|x| f64::from(*x)),
        AttrValue::F64Array(x) => x.first().copied(),
        AttrValue::I8(x) => one(&[*x]),
        AttrValue::I16(x) => one(&[*x]),
        AttrValue::I32(x) => one(&[*x]),
        AttrValue::I64(x) => one(&[*x]),
        AttrValue::U8(x) => one(&[*x]),
        AttrValue::U16(x) => one(&[*x]),
        AttrValue::U32(x) => one(&[*x]),
        AttrValue::U64(x) => one(&[*x]),
        AttrValue::I8Array(x) => one(x),
        AttrValue::I16Array(x) => one(x),
        AttrValue::I32Array(x) => one(x),
        AttrValue::I64Array(x) => one(x),
        AttrValue::U8Array(x) => one(x),
        AttrValue::U16Array(x) => one(x),
        AttrValue::U32Array(x) => one(x),
        _ => None,
    }
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
        F32 | F64 | I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64 => {
            Ok(scaled(dataset, dataset.read_f64().map_err(fail)?))
        }
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
