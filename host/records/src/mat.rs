//! MAT-files of version 5, the default of MATLAB's `save` (-v6, -v7).

use super::table::Channel;
use matfile::{MatFile, NumericData};
use std::fs::File;
use std::path::Path;

pub(super) fn read(file: &Path) -> std::result::Result<Vec<Channel>, String> {
    let opened = File::open(file).map_err(|e| e.to_string())?;
    let parsed = MatFile::parse(opened).map_err(|e| e.to_string())?;
    let mut channels = Vec::new();
    for array in parsed.arrays() {
        let one = |name: String, values| Channel { name, unit: None, step_s: None, values };
        let values = numbers(array.data());
        match (array.size().as_slice(), values) {
            // Column by column.
            (&[rows, 2..=MOST_COLUMNS], Ok(values)) if rows > 1 && values.len() % rows == 0 => {
                for (k, column) in values.chunks(rows).enumerate() {
                    channels.push(one(column_name(array.name(), k), Ok(column.to_vec())));
                }
            }
            (size, values) => {
                let values = vector(size).and(values);
                channels.push(one(array.name().to_owned(), values));
            }
        }
    }
    Ok(channels)
}

/// Columns of a matrix that are channels of their own, at most.
pub(super) const MOST_COLUMNS: usize = 32;

/// As MATLAB writes a column: `data(:,2)`.
pub(super) fn column_name(matrix: &str, index: usize) -> String {
    format!("{matrix}(:,{})", index + 1)
}

/// That a variable is a row or a column.
fn vector(size: &[usize]) -> std::result::Result<(), String> {
    if size.iter().filter(|n| **n != 1).count() <= 1 {
        return Ok(());
    }
    let size: Vec<String> = size.iter().map(usize::to_string).collect();
    Err(format!("a {} matrix", size.join(" by ")))
}

fn numbers(data: &NumericData) -> std::result::Result<Vec<f64>, String> {
    macro_rules! real {
        ($($kind:ident),*) => {
            match data {
                $(NumericData::$kind { real, imag: None } => {
                    Ok(real.iter().map(|value| *value as f64).collect())
                })*
                _ => Err("complex numbers".to_owned()),
            }
        };
    }
    real!(Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Single, Double)
}
